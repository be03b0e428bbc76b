"""Tools that know nothing of pictures: checks of a user's values, vectors, files, progress, Ctrl-C, text on a terminal.

The package imports no other package, and NumPy only where arrays are made: a scene is made, and a user's mistake is
found, without NumPy. Other packages may use:

    validation: InputError, about, within; Vec3, Key, Keys; MAX_COLOR, MAX_EXPONENT, MAX_LENGTH, MAX_SIDE, MIN_RADIUS;
        checks that return the checked value: number, whole, vector, three, point, color, direction, items,
        check_choice, check_flag, check_keys, check_path, check_size, check_text; is_number, set_fields
    suggest: did_you_mean, did_you_mean_file, known (remedies that end an error)
    shown: shown, printable, shortened (values as an error shows them)
    record: Record (frozen structs with `replace`), public
    vectors: add, sub, dot, cross, scaled, divided
    arrays: number_array
    files: opened, read_bounded (a user's files); packaged, read_packaged (the package's own)
    output: check_output, check_folder, written_whole, replaced_whole, write_new, write_numbered, Writer
    npz: read_arrays, read_shape
    memory: check_memory, physical_memory, picture_bytes
    collector: collector_paused
    interrupts: run_guarded, deferred, STATUS
    progress: Progress, progress_bar, step_bar, tell_step, check_progress
    terminal: say, complain, note, say_json, say_table, cell, tolerant_output, drop_output

An InputError has the place of a mistake as data: `keys`, `file` and `line`. Its text is made from these, and no code
parses the text.
"""
