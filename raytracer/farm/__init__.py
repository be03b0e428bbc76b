"""Many pictures: frames of a movie, values of a sweep, and bands of a large picture, here or on a farm of workers.

May import: all packages except app. Other packages may use

    band_rows: check_rows, default_rows, rows_of_farm, rows_of_large
    bands: BandJob, BandedPicture, draw_band, write_bands
    tasks: Done, Failed, Run, run_here, MAX_WORKERS
    frame_jobs: FrameJob, DrawnFrame, draw_frame (one picture, in any process)
    frame_store: FrameStore (the files of frames, and which are current)
    frames: FrameResult, make_frames (all frames of a movie)
    cluster: open_cluster, Cluster
    roster: FarmError
    scheduler_address: check_address
    sweep_points: Point, list_points, label_names, point_text, varied_paths (the values of a sweep)
    swept_scenes: SweepSource (the scenes of a sweep)
    sweep_pictures: sweep (as rt.sweep)
    sweep_run: Sweep, SweepOutcome, Reference (all pictures of a sweep)
    sweep_sheet: SweepSheet (the contact sheet)
    sweep_table: SweepRow, read_measurements, write_rows (sweep.csv)
"""
