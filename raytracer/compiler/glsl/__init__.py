"""GLSL text: shaders assembled from the files of `shaders/` and from text generated for a scene."""
