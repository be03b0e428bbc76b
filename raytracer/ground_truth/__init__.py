"""The same picture in float64 NumPy, independent of the shaders.

May import: core, scene, formats.
"""
