"""The compiler: a scene and its settings become arrays and GLSL. NumPy only, no OpenGL.

May import: core, scene.
"""
