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
// in portions of ROOM, again and again until nothing changes. The loops over the roots have constant bounds: then
// llvmpipe keeps them in registers.
const int ROOM = 8;
const int NO_LEAF = -1;

// The code of the next leaf that the ray may meet before the distance `before`, from the entry k on; NO_LEAF without
// one. The search sets `last` to 0, and ends, at a leaf that is False all along the ray. It is a loop of its own, so
// that pixels that are drawn together compute their roots together.
int nextLeaf(Ray ray, inout int k, int end, int complement, real blur, real before, inout real last) {
    while (k < end) {
        int code = listAt(k) ^ complement;
        k++;
        if (mayMeet(ray, code >> 5, blur, before)) return code;
        if ((code & 8) == 0) {
            last = 0.0;
            break;
        }
    }
    return NO_LEAF;
}

void meetChain(Ray ray, int begin, int end, int object, inout Nearest nearest) {
    int complement = (listAt(begin) & 7) == OR_LEAF ? 8 : 0;
    // A ray that starts on a ball starts off its surface, by the rounding of a point at that distance from the camera.
    real blur = ray.ofCamera ? 0.0 : SLACK * length(ray.ro);
    real at = 0.0;      // up to here a leaf among those tested is False
    real last = INF;    // from here on a leaf among those tested is False for good
    real until = INF;   // for a ray that starts inside: where the first leaf among those tested becomes False
    real met = 0.0;
    int mat = 0, k = begin;
    for (;;) {
        int first = k, count = 0;
        int codes[ROOM];
        real2 spans[ROOM];  // where a negated leaf is False; for any other leaf, where it is True, with swapped ends
        for (int j = 0; j < ROOM; j++) {
            codes[j] = 0;
            spans[j] = real2(INF, -INF);
        }
        int code = nextLeaf(ray, k, end, complement, blur, nearest.t, last);
        // llvmpipe computes one more round of a loop that tests for the end first.
        do {
            real2 span = leafRoots(ray, max(code, 0) >> 5);
            if (span.x >= span.y) span = real2(INF, -INF);  // roots that round to one number are no surface
            bool isLeaf = code != NO_LEAF, within = isLeaf && (code & 8) == 0;
            at = within ? max(at, span.x) : at;
            last = within ? min(last, span.y) : last;
            for (int j = 0; j < ROOM; j++) {
                bool isHere = isLeaf && j == count;
                codes[j] = isHere ? code : codes[j];
                spans[j] = isHere ? (within ? span.yx : span) : spans[j];
            }
            count++;
            code = count < ROOM && last > 0.0 ? nextLeaf(ray, k, end, complement, blur, nearest.t, last) : NO_LEAF;
        } while (code != NO_LEAF);
        if (last == 0.0) return;
        for (;;) {
            real before = at;
            for (int j = 0; j < ROOM; j++) at = isInside(spans[j], at) ? spans[j].y : at;
            if (at == before) break;
        }
        if (at >= last || !nearer(at, object, nearest)) return;
        real next = at;
        if (at == 0.0) {
            for (int j = 0; j < ROOM; j++) until = spans[j].x > 0.0 ? min(until, spans[j].x) : until;
            next = until;
        }
#ifdef OWNERS
        for (int j = 0; j < ROOM; j++) {
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
