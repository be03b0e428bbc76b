"""GLSL text: shaders that are put together of `shaders/` and of text generated for a scene."""
