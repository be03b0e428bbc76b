"""The picture on the GPU: a compiled scene is drawn sample by sample, its error estimated, and the end decided.

May import: core, scene, formats, compiler, gpu. Other packages may use

- picture: render (public as raytracer.render)
- brdf: evaluate, bake, call (public as raytracer.brdf)
- renderer: Renderer, for pictures by a device of one's own, in tiles, or without an estimate; metadata
- progressive: the picture in a window, which gains by every sample
"""
