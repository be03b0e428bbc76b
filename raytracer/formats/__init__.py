"""Files: scene files and the files beside them, published materials, pictures; and `Image`.

No file is trusted: the package reads at most a fixed number of bytes, and every error names the file and, where it can,
the key and the line. The package imports core and scene alone. Other packages may use:

    scene_file: load, load_all, load_settings, loads, SceneFile (as rt.*); find_scene, read_document, parse_document,
        SceneDocument (one reading for all uses of a file); read_text, companion_paths, edit_positions, examples
    settings_section: SettingsSection, DEFAULT_SIZE, section_text
    companion_files: copied
    material_library: published, MaterialLibrary, collections, read_collection
    material_schema: materials_schema
    image: Image, Geometry, GeometrySource
    estimate: Estimate, largest, rests_on_few, FEW_PIXELS, LEAST, UNSEEN, WORST
    image_files: FORMATS, load_radiance, read_size
    radiance: row_blocks, check_radiance, MAX_RADIANCE; srgb: encode_srgb8, decode_srgb
    toml_text: parse_toml

A new format is a module here and an entry in a table by suffix: FORMATS in image_files.py for pictures, READERS in
instance_files.py for places of instances, READERS in measured_files.py for measured materials. A new key of a scene
file is read in scene_sections.py.
"""
