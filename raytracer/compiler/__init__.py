"""The compiler: a scene and its options become arrays and GLSL. NumPy only, no OpenGL.

A scene is compiled once. A CompiledScene holds the parts that depend neither on the camera nor on the picture's size;
the texts of the programs follow from it. A Frame holds all numbers of one view. Draws are a list of values, which gpu's
DrawPlayer carries out. All values are frozen. A new Frame shares the unchanged parts with the frame before it, so that
gpu uploads only the changed parts.

May import: core, scene. Other packages may use:

- compiled_scene: compile, CompiledScene
- bodies: make_bodies, PlacedShapes, WALLS
- frame: make_frame, Frame
- bright_features: bright_features; features: Features, NO_FEATURES
- light_scale: light_scale, scale_light
- limits: DriverLimits, MAX_ROTH_LOOPS, MAX_PRIMITIVES
- glsl.shaders: program_sources, plain_vertex_source, ProgramSource, Show
- glsl.preprocessor: assemble, is_current, shaders_folder, FileVersion, ShaderError, Source
- glsl.materials: material_text, reflected_text
- material_layout: make_layout, pack_struct, Layout
- draws: sample_at, replicate_at, sample_draws, viewport, Clear, Draw, Sample, Screen, Step, MARGIN, SAMPLES_PER_SUM,
  SAMPLES_AT_ONCE
- meshes: tile_meshes, cell_blocks, Cells, Coverage, Mask, Meshes, Rectangle, Rectangles, PER_CELL; the names of
  programs, SEE, SHAPES, SHADE, PICTURE, PLANE_ONLY, SEVERAL and EMPTY
- direction_cells: BLOCK, CELL
- roth_bounds: roth_loops
- rounds: MAX_ROUNDS
- surfaces: make_surfaces
- view_space: project_point, pixel_scale, rotation, view_origin
"""
