"""OpenGL: one device draws and computes, and threads take turns with it. moderngl is imported in this package alone.

May import: core, compiler. Other packages may use

- device: Device, shared_device; ADD, OVER (ways of blending)
- glsl_call: call, dtype, struct_dtype (public as raytracer.glsl)
- turns: ContextError (public as raytracer.ContextError)
- context: open_window, the names of backends; adapters: Adapter; context_report: for `raytracer doctor`
- gl: types of OpenGL's objects; cell_draw, rectangle_draw: draws of cells and of rectangles
"""
