"""General tools, independent of ray tracing: input checks, vectors, files, progress bars, Ctrl-C, terminal output.

The package imports no other package of the project. It imports NumPy only in functions that make arrays, so that
building a scene and reporting a wrong value need no NumPy. Other packages may use:

    validation: InputError, KeyNameError, locate_errors, within; Vec3, Key, Keys; MAX_COLOR, MAX_EXPONENT, MAX_LENGTH,
        MAX_SIDE, MIN_RADIUS; checks that return the checked value: number, integer, vector, three_numbers, point,
        color, direction, items, check_choice, check_flag, check_keys, check_path, check_size, check_text; is_number,
        set_fields
    suggest: did_you_mean, did_you_mean_file, known_names, install_command, missing_extra (remedies in error messages)
    shown: format_value, format_keys, escape_unprintable, shorten (values as text in an error message)
    record: Record (base class of frozen structs with `replace`), public
    vectors: add, sub, dot, cross, scale_by, divide_by
    arrays: number_array, float_array
    files: open_regular, read_bounded (files of the user); find_data_folder, read_packaged (files that are installed
        with the package)
    output: check_output, check_folder, check_place, make_folder, write_atomically, replace_atomically, write_new,
        write_numbered, Writer
    npz: read_arrays, read_shape
    memory: check_memory, physical_memory, picture_bytes
    collector: pause_collector
    interrupts: run_guarded, defer_interrupts, STATUS
    progress: Progress, progress_bar, step_bar, announce_step, check_progress
    terminal: print_lines, print_error, print_note, print_json, print_table, table_cell, tolerant_output, drop_output

An InputError carries the location of the wrong value as data: `keys`, `file` and `line`. Its message is built from
them, and no code parses the message.
"""
