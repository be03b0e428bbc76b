"""Numerics at the extremes: errors of pictures if numbers are very large, very small or nearly equal.

`raytracer extremes` measures all rows of the ledger and writes them; the tests measure a shorter form. The rows are in
views.py, rays.py, solids.py and light.py; those on solids of all kinds in bodies.py, coincidence.py, random_solids.py
and solid_shadows.py, with the solids of specimens.py. fuzz.py makes random scenes with values from all ranges at once.
wall_rays.py, wall_truth.py and walls.py measure curved walls, and are no rows yet.
pixel_errors.py compares pictures with pictures of the float64 ray tracer, within the bounds of
`analysis/pixel_doubt.py`.

Other packages may use:

    ledger: ROWS, measure_ledger
    ledger_page: HEADING, summary, as_csv, as_markdown, number_text
    findings: Finding, LedgerRow, worst_findings
    fuzz: random_scene, measure_random_scenes
    pixel_errors: MATTE, measure_pixel_errors
    random_solids: random_solids, measure_random_solids
    scene_transforms: enlarge_scene, move_scene
"""
