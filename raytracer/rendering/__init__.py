"""The picture on the GPU: a compiled scene is drawn sample by sample, its error estimated, and the end decided.

May import: core, scene, formats, compiler, gpu.
"""
