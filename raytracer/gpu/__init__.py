"""OpenGL: one device draws and computes, and threads take turns with it. Only this package imports moderngl.

May import: core, compiler. Other packages may use

- device: Device, shared_device; ADD, OVER (ways of blending)
- glsl_call: call, dtype, struct_dtype (public as raytracer.glsl)
- turns: hold_lock, has_turn, is_cut_off, ContextError (public as raytracer.ContextError)
- context: open_window, Backend, PACKAGES, VARIABLE; adapters: Adapter, VARIABLE
- context_report: examine_contexts, ContextReport, for `raytracer doctor`
- scene_buffers: SceneBuffers, the numbers of a frame; draw_player: DrawPlayer, which plays lists of draws
- gl: set_constants, set_uniforms; Context, Framebuffer, Program and Texture, the types of OpenGL's objects

turns holds the one lock of a process. cell_draw and rectangle_draw draw the meshes of compiler/meshes.py.
"""
