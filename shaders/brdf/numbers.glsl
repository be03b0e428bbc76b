// Constants of the reflectance models.
// Provides PI, GRAZING.

const float PI = 3.14159265;
// The least N.V that is divided by: rounding makes it 0, or negative, where a surface is seen edge-on.
const float GRAZING = 1e-20;
