"""Properties of the reflectance models, measured with the GLSL that renders, and compared with theory.

quadrature.py has the quadrature rules, and properties.py measures a material. expectations.py and closed_forms.py have
the theory, and verification.py compares measurement and theory for all models at the ends of their ranges. tables.py,
plots.py and gallery.py present the results. All directions are in a frame whose normal N is +z; f is the reflectance in
1/sr.

Other packages may use:

    properties: COMPLETE, MaterialProperties, measure_material, measure_facets, unit_direction
    verification: Verification, make_material, verify, verify_all
    expectations: EXPECTATIONS, NOT_RECIPROCAL, Expectation, find_expectation
    tried_parameters: Parameters, tried_parameters
    tables: print_checks, checks_json, print_models, models_json, models_markdown
    plots: plot_materials, plot_lecture
    gallery: write_gallery
"""
