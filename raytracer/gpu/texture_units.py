"""The texture unit of each sampler. Each sampler has its own unit, so that no draw reads the texture of another."""

from __future__ import annotations

# The scene's buffer textures and tables.
SCENE_UNITS = {
    "numbers": 2,
    "materials": 3,
    "items": 4,
    "lists": 5,
    "ends": 6,
    "objects": 7,
    "measured": 8,
    "bodies": 9,
    "grids": 15,
    "gridLeaves": 1,
}
# All samplers of the shaders. OpenGL 3.3 promises 16 units to each shader.
UNITS = SCENE_UNITS | {
    "surface": 0,
    "normalDepth": 1,
    "others": 9,
    "radianceSum": 10,
    "earlierSum": 11,
    "summedBefore": 12,
    "blockSamples": 13,
    "panel": 14,
}
