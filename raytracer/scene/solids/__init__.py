"""Solids: the primitives, one module for each kind, their affine maps, and CSG trees of them.

Other packages may use:

    solid: Solid, Primitive; Union, Intersection, Difference, Complement, Transform; postfix
    flattening: leaves, simplify, with_leaves
    body: Body, Placed, Slab, Wall
    primitives: the registry of the primitives, each of which its module provides
    kinds: KINDS, the primitives by their keys in scene files
    polyhedron: MAX_POINTS
    plane: is_on_plane
    tree: list_distinct
    affine: Map
    affine_arrays: compose, apply, cofactors, determinants, map_slabs, map_planes, unit_slabs
    bounds: Bounds, EVERYWHERE
    limits: MAX_LEAVES, MAX_NODES, MAX_SURFACES, ROUNDING
"""
