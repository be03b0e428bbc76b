"""The window of `raytracer view`: events, orbits of lights and camera, text over the picture, and watched files."""
