// The intersection of a ray with a chain: a program that is one conjunction or one disjunction of leaves.
// Provides meetChain(): if the ray meets the chain before `nearest`, it sets `nearest` to that surface. `begin` and
// `end` are the program's place among the entries of the candidate lists; `object` is its object's number in the scene.
// Most programs (program.glsl) are chains: a solid minus many others, or a tree of which a cell sees one branch.
//
// The code treats a disjunction as the conjunction of its leaves' complements (De Morgan): its surfaces are where that
// conjunction ends and begins.
// From outside, a ray enters a conjunction where the last of the leaves becomes True. So if a leaf is False, the ray
// goes on to where that leaf becomes True, whatever the other leaves are, until no leaf is False. From inside, the ray
// leaves the conjunction where the first leaf becomes False. The walk from root to root (walk.glsl) stops at every
// root. This loop stops at few of them, and computes each leaf's roots only once, because it keeps them.
//
// If the host defines OWNERS, the result names the surface that the ray meets; otherwise its `mat` is 1 for any
// surface.

#include "csg/program.glsl"

// The number of leaves whose roots are kept at once. If a ray may meet more leaves, the loop goes through all of them
// in portions of ROOM, again and again until nothing changes.
const int ROOM = 16;

void meetChain(Ray ray, int begin, int end, int object, inout Nearest nearest) {
    int complement = (listAt(begin) & 7) == OR_LEAF ? 8 : 0;
    // A ray that starts on a ball starts off its surface, by the rounding of a point at that distance from the camera.
    real blur = ray.ofCamera ? 0.0 : SLACK * length(ray.ro);
    real at = 0.0;      // up to here a leaf among those tested is False
    real last = INF;    // from here on a leaf among those tested is False for good
    real until = INF;   // for a ray that starts inside: where the first leaf among those tested becomes False
    real met = 0.0;
    int mat = 0, k = begin;
    int codes[ROOM];
    real2 spans[ROOM];  // where a negated leaf is False; for any other leaf, where it is True, with swapped ends
    for (;;) {
        int first = k, count = 0;
        while (k < end && count < ROOM) {
            int code = listAt(k) ^ complement;
            k++;
            bool may = mayMeet(ray, code >> 5, blur, nearest.t);
            codes[count] = code;
            count += may ? 1 : 0;
            last = may || (code & 8) != 0 ? last : 0.0;
        }
        if (last == 0.0) return;
        for (int j = 0; j < count; j++) {
            real2 span = leafRoots(ray, codes[j] >> 5);
            if (span.x >= span.y) span = real2(INF, -INF);  // roots that round to one number are no surface
            bool within = (codes[j] & 8) == 0;
            at = within ? max(at, span.x) : at;
            last = within ? min(last, span.y) : last;
            spans[j] = within ? span.yx : span;
        }
        for (;;) {
            real before = at;
            for (int j = 0; j < count; j++) at = isInside(spans[j], at) ? spans[j].y : at;
            if (at == before) break;
        }
        if (at >= last || !nearer(at, object, nearest)) return;
        real next = at;
        if (at == 0.0) {
            for (int j = 0; j < count; j++) until = spans[j].x > 0.0 ? min(until, spans[j].x) : until;
            next = until;
        }
#ifdef OWNERS
        for (int j = 0; j < count; j++) {
            int surface = codes[j] >> 5;
            bool enters = min(spans[j].x, spans[j].y) == next, leaves = max(spans[j].x, spans[j].y) == next;
            if ((enters || leaves) && (mat == 0 || (codes[j] & 16) != 0)) mat = enters ? surface + 1 : -surface - 1;
        }
#else
        mat = 1;
#endif
        if (k < end) continue;
        bool all = first == begin || next == met;
        met = next;
        if (all) break;
        mat = 0;
        k = begin;
    }
    if (nearer(met, object, nearest)) nearest = Nearest(met, mat, object);
}
