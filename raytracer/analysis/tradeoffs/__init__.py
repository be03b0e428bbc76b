"""Time and error of settings, measured on a scene: `raytracer trade` and `raytracer tune`.

configurations.py and approximations.py list the configurations, targets.py draws the references of the measured errors,
measurement.py measures time and error, and pareto.py finds the Pareto front. data_files.py, page.py, plots.py and
strips.py present the results. tune.py searches for the best settings for an error or a time, and measures them with
trials.py.

Other packages may use:

    configurations: FULL, QUICK, MAIN, Extent, Plan, plan
    approximations: add_approximations
    measurement: Result, Tradeoffs, measure_tradeoffs
    data_files: as_csv, as_json
    summaries: shadow_differences, fit_slopes
    page: FILES, write_page, write_tables
    trials: Trial, Trials
    tune: Tuned, tune, list_candidates, candidates_for_error
"""
