"""File formats: scene files and their companion files, published materials, and pictures (`Image`).

Files are untrusted input: the package limits the number of bytes that it reads, and every error names the file and, if
possible, the key and the line. The package imports only core and scene. Other packages may use:

    scene_file: load, load_all, load_settings, loads, SceneFile (as rt.*); find_scene, read_document, parse_document,
        SceneDocument (a file that was read once for several uses); read_text, companion_paths, edit_positions,
        examples
    scene_paths: parse_path, replace_value, replace_values (values in the tables of a scene file, by paths)
    animated_scene: animation, AnimatedScene (as rt.*), open_animation
    value_texts: Value, MAX_COMPONENTS, MAX_VALUES, parse_values, value_text; value_table: read_value_table
    settings_section: SettingsSection, DEFAULT_SIZE, parse_section, section_text
    companion_files: copy_files
    material_library: published, MaterialLibrary, collections, read_collection
    material_schema: materials_schema
    image: Image, Geometry, GeometrySource
    estimate: Estimate, join_estimates, measured_estimate, picture_texts, find_largest, is_dominated_by_few, FEW_PIXELS,
        LOWER_BOUND_FACTOR, UNSEEN, WORST_PIXEL_FACTOR
    contact_sheet: Cell, choose_cells, count_columns, reduce_picture, small_side, write_sheet
    image_files: FORMATS, check_bits, check_picture_output, load_picture, read_metadata, read_size
    png_chunks: PngWriter; image_png: encode_levels, read_pixels; image_exr: channels
    movies: MOVIES, Picture, write_movie, check_movie, DEFAULT_CRF, MAX_CRF
    radiance: row_blocks, check_radiance, MAX_RADIANCE, PictureRows, StoredPicture; srgb: encode_srgb8, decode_srgb
    toml_text: parse_toml

To add a file format, add a module here and an entry for its suffix to a table: FORMATS in image_files.py for pictures,
READERS in instance_files.py for positions of instances, READERS in measured_files.py for measured materials.
To add a key to scene files, read it in scene_sections.py.
"""
