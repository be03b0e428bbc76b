// Provides shadow(): the lecture's S for a point light at `distance` along a ray from a surface:
// 1 lit, 0 where something is in between.

float shadow(Ray ray, real distance) {
    real3 Q, N;
    int mat;
    return rayCSG(ray, distance, Q, N, mat) < distance ? 0.0 : 1.0;
}
