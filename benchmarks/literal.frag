// The assignment written down literally, as a peer for benchmarks only: Roth diagrams by value with a normal
// in every hit, toggles as uniforms, and a loop over the samples of a pixel.
#version 330

struct Hit {
    float t;
    vec3 normal;
    int mat;
};

struct Roth {
    int n;
    Hit hit[8];
};

struct Material {
    vec3 ka, kd, ks;
    float h;
};

uniform vec2 resolution;
uniform vec3 lightPosition, lightColor, ambient, background;
uniform Material materials[4];
uniform bool blinn, shadows;
uniform int grid;  // number of samples along a side of a pixel
out vec4 color;

const float FAR = 1e30;
const float BIAS = 1e-3;  // offset of the origin of a shadow ray

Roth raySphere(vec3 ro, vec3 rd, vec3 center, float radius, int mat) {
    Roth r;
    r.n = 0;
    vec3 o = ro - center;
    float b = dot(o, rd), d = b * b - dot(o, o) + radius * radius;
    if (d > 0.0) {
        float t0 = -b - sqrt(d), t1 = -b + sqrt(d);
        r.n = 2;
        r.hit[0] = Hit(t0, (o + t0 * rd) / radius, mat);
        r.hit[1] = Hit(t1, (o + t1 * rd) / radius, mat);
    }
    return r;
}

// Merges the hits of two diagrams in order of t, and keeps the hits at which the inside count crosses `level`.
Roth filterCSG(Roth r1, Roth r2, int level) {
    Roth r;
    r.n = 0;
    int i = 0, j = 0, inside = 0;
    while (i < r1.n || j < r2.n) {
        Hit next;
        int before = inside;
        if (j >= r2.n || (i < r1.n && r1.hit[i].t < r2.hit[j].t)) {
            next = r1.hit[i];
            inside += i % 2 == 0 ? 1 : -1;
            i++;
        } else {
            next = r2.hit[j];
            inside += j % 2 == 0 ? 1 : -1;
            j++;
        }
        if (max(before, inside) == level && r.n < 8) {
            r.hit[r.n] = next;
            r.n++;
        }
    }
    return r;
}

Roth unionCSG(Roth r1, Roth r2) {
    return filterCSG(r1, r2, 1);
}

Roth intersectionCSG(Roth r1, Roth r2) {
    return filterCSG(r1, r2, 2);
}

Roth complementCSG(Roth r1) {
    Roth r;
    r.hit[0] = Hit(-FAR, vec3(0.0), 0);
    r.n = 1;
    for (int i = 0; i < r1.n && r.n < 7; i++) {
        r.hit[r.n] = Hit(r1.hit[i].t, -r1.hit[i].normal, r1.hit[i].mat);
        r.n++;
    }
    r.hit[r.n] = Hit(FAR, vec3(0.0), 0);
    r.n++;
    return r;
}

Roth differenceCSG(Roth r1, Roth r2) {
    return intersectionCSG(r1, complementCSG(r2));
}

float rayCSG(vec3 ro, vec3 rd, out vec3 P, out vec3 N, out int mat) {
    Roth sphere1 = raySphere(ro, rd, vec3(-1.0, 2.0, 0.0), 1.5, 0);
    Roth sphere2 = raySphere(ro, rd, vec3(1.0, 2.0, 0.0), 1.5, 0);
    Roth sphere3 = raySphere(ro, rd, vec3(0.0, 2.7, -0.3), 0.8, 1);
    Roth sphere4 = raySphere(ro, rd, vec3(0.0, 2.8, 0.3), 0.8, 2);
    Roth r = differenceCSG(unionCSG(intersectionCSG(sphere1, sphere2), sphere3), sphere4);
    for (int i = 0; i < r.n; i++) {
        if (r.hit[i].t > 0.0) {
            P = ro + r.hit[i].t * rd;
            N = r.hit[i].normal;
            mat = r.hit[i].mat;
            return r.hit[i].t;
        }
    }
    return FAR;
}

float rayScene(vec3 ro, vec3 rd, out vec3 P, out vec3 N, out int mat) {
    float t = rayCSG(ro, rd, P, N, mat), plane = -ro.y / rd.y;
    if (plane > 0.0 && plane < t) {
        t = plane;
        P = ro + t * rd;
        N = vec3(0.0, 1.0, 0.0);
        mat = 3;
    }
    return t;
}

vec3 shade(vec3 ro, vec3 rd) {
    vec3 P, N;
    int mat;
    if (rayScene(ro, rd, P, N, mat) == FAR) return background;
    Material m = materials[mat];
    vec3 I = m.ka * ambient;
    float distance = length(lightPosition - P);
    vec3 L = (lightPosition - P) / distance;
    if (dot(N, L) <= 0.0) return I;
    if (shadows) {
        vec3 Q, unused;
        int blocker;
        if (rayScene(P + BIAS * N, L, Q, unused, blocker) < distance) return I;
    }
    float cosine = blinn ? dot(N, normalize(L - rd)) : dot(reflect(-L, N), -rd);
    float specular = pow(max(cosine, 0.0), blinn ? 4.0 * m.h : m.h);
    return I + lightColor * (m.kd * dot(N, L) + m.ks * specular);
}

void main() {
    vec3 ro = vec3(0.0, 3.0, 6.0), forward = normalize(vec3(0.0, 2.0, 0.0) - ro);
    vec3 right = normalize(cross(forward, vec3(0.0, 1.0, 0.0))), up = cross(right, forward);
    vec3 sum = vec3(0.0);
    for (int y = 0; y < grid; y++) {
        for (int x = 0; x < grid; x++) {
            vec2 at = gl_FragCoord.xy - 0.5 + (vec2(x, y) + 0.5) / float(grid);
            vec2 p = (2.0 * at - resolution) / resolution.y * 0.5;  // the factor is the tangent of half the angle of view
            sum += shade(ro, normalize(forward + p.x * right + p.y * up));
        }
    }
    color = vec4(sum / float(grid * grid), 1.0);
}
