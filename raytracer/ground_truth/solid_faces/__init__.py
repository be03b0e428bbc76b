"""The faces of solids, from the definition of each kind, in a module with the name of the kind.

definition: Faces, WallDefinition, HalfSpace. registry: find_faces.
"""
