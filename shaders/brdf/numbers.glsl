// Constants of the reflectance models.
// Provides PI, GRAZING.

const float PI = 3.14159265;
// The smallest N.V that models divide by: on a surface seen edge-on, rounding makes N.V 0 or negative.
const float GRAZING = 1e-20;
