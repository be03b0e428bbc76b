// Provides indexOf(): which surface a hit is on.
//
// A hit says that in one number, `mat`: the surface's index + 1, negative where the ray comes out of the
// primitive; 0 for no surface. So the hit's root is known again without comparing distances.
// Where the host knows that rays meet only one surface, it defines ONLY as its index.

// mat is not 0.
int indexOf(int mat) {
#ifdef ONLY
    return ONLY;
#else
    return abs(mat) - 1;
#endif
}
