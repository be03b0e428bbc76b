// The intersection of a ray with a chain: a program that is one conjunction or one disjunction of leaves.
// Provides meetChain(). Most programs (program.glsl) are chains: a solid minus many others, or a tree of which a cell
// sees one branch.
//
// A disjunction begins and ends where the conjunction of its leaves' complements ends and begins: so all are
// conjunctions here. One is entered, from outside, where the last of its leaves becomes True; so a ray that some
// leaf keeps out may go on to where that one lets it in, whatever the others, until none keeps it out. It is
// left, from inside, where the first leaf becomes False. Unlike the walk from root to root (walk.glsl), which
// stops at each, this stops rarely at one, and needs each leaf's roots only once: they are kept.
//
// If the host defines OWNERS, it is found whose surface is met; else that is 1.

#include "csg/program.glsl"

// Of so many leaves the roots are kept at a time. Where a ray may meet more, it goes through all of them again until
// nothing changes.
const int ROOM = 16;

void meetChain(Ray ray, int begin, int end, int object, inout Nearest nearest) {
    int complement = (listAt(begin) & 7) == OR_LEAF ? 8 : 0;
    // A ray that leaves a ball starts beside its surface by what rounds so distant a point.
    real blur = ray.ofCamera ? 0.0 : SLACK * length(ray.ro);
    real at = 0.0;      // no leaf that was looked at lets the ray in before
    real last = INF;    // and from here on one of them keeps it out
    real until = INF;   // if it starts inside, where the first of them begins to
    real met = 0.0;
    int mat = 0, k = begin;
    int codes[ROOM];
    real2 spans[ROOM];  // where leaves that are complements are False; of others where they are True, its ends swapped
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
            if (span.x >= span.y) span = real2(INF, -INF);  // roots that round to one are no surface (walk.glsl)
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
