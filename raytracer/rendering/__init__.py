"""Rendering on the GPU: draws a compiled scene sample by sample, estimates the error, and decides when to stop.

May import: core, scene, formats, compiler, gpu. Other packages may use

- picture: render (public as raytracer.render)
- renderer: Renderer, for pictures by a device that the caller owns, in tiles, or without an estimate; metadata;
    shared_renderer, the one of rt.render()
- progressive: ProgressivePicture, the picture of a window
- brdf: evaluate, bake, call (public as raytracer.brdf)

Renderer draws a picture in the tiles of tiles.py. geometry draws depth, normal and material at their first access.
The path of a sample through the other modules: accumulation steps from sample to sample, for one tile, or with a
stopping rule for all tiles together. tile_sums holds the sums of a tile's samples. tile_renderer draws each sample as a
list of draws (compiler/draws.py). block_measurements measures blocks of pixels on the GPU, estimator turns the
measurements into statistics, and stopping_rule chooses the blocks that get more samples; the last two are pure
functions. picture_arrays fills the arrays of a picture, and replicate measures the error of a finished picture.
"""
