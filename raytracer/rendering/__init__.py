"""The picture on the GPU: a compiled scene is drawn sample by sample, its error estimated, and the end decided.

May import: core, scene, formats, compiler, gpu. Other packages may use

- picture: render (public as raytracer.render)
- renderer: Renderer, for pictures by a device of one's own, in tiles, or without an estimate; metadata
- progressive: ProgressivePicture, the picture of a window
- brdf: evaluate, bake, call (public as raytracer.brdf)

Renderer draws a picture in the tiles of tiles.py. geometry draws depth, normal and material when they are asked for.
A sample's way through the other modules: accumulation steps from sample to sample of one tile, or of all tiles
together with a stopping rule. tile_sums holds the sums of a tile's samples. tile_renderer draws each sample by a list
of draws (compiler/draws.py). block_measurements measures blocks of pixels on the GPU, estimator makes
statistics of the measurements, and stopping_rule chooses the blocks that get more samples; the last two are pure
functions. picture_arrays fills the arrays of a picture, and replicate measures the error of a finished one.
"""
