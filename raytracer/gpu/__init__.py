"""OpenGL: contexts, devices, programs, buffers, draws; calls of one GLSL function over arrays.

May import: core, compiler.
"""
