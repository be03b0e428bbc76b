"""Numerics at the extremes: how wrong pictures are where numbers get large, small or nearly equal.

`raytracer extremes` measures all rows of the ledger and writes them; the tests measure a shorter form. The rows are in
views.py, rays.py, solids.py and light.py; fuzz.py draws random scenes over all ranges together. pixel_errors.py
compares pictures with the float64 ray tracer's, and allows for the doubt that `analysis/pixel_doubt.py` computes.

Other packages may use:

    ledger: ROWS, measure_ledger
    ledger_page: HEADING, summary, as_csv, as_markdown, number_text
    findings: Finding, LedgerRow, worst
    fuzz: random_scene, measure_random_scenes
    pixel_errors: MATTE, measure_pixel_errors
    scene_transforms: enlarge_scene, move_scene
"""
