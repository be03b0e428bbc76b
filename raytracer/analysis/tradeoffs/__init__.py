"""The cost of each knob and the error that it leaves, measured on a scene: `raytracer trade` and `raytracer tune`.

configurations.py and approximations.py list what is tried, targets.py draws the references that errors are measured
against, measurement.py measures in turns, pareto.py finds the configurations that are worth their time; data_files.py,
page.py, plots.py and strips.py show it. tune.py searches for the cheapest settings that meet an error or a time, by
the trials of trials.py.

Other packages may use:

    configurations: FULL, QUICK, MAIN, Extent, Plan, plan
    approximations: add_approximations
    measurement: Result, Tradeoffs, measure_tradeoffs
    data_files: as_csv, as_json
    summaries: shadow_differences, slopes
    page: FILES, write_page, write_tables
    plots: check_matplotlib
    trials: Trial, Trials
    tune: Tuned, tune, grid, asked
"""
