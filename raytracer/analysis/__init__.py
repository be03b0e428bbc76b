"""Measurements: differences of pictures, rounding, reflectance, cost against error.

Measurements return values and print nothing; app prints the values, or writes them. The package may import all other
packages except app.

    image_difference: metrics for the difference between two pictures (`rt.compare`)
    figures, difference_figure: the style of all plots, and the figure of `raytracer compare -o`
    pixel_doubt, rounding_bounds: bounds of the rounding errors of a picture, for each pixel
    face_bounds, wall_bounds, cone_bounds, torus_bounds, known_bounds: bounds of the rounding errors of faces' roots
    surface_bounds: those bounds for all surfaces of a scene
    numerics: errors of pictures at the ends of all value ranges (`raytracer extremes`)
    reflectance: properties of the reflectance models, and their expectations (`raytracer brdf`)
    tradeoffs: time and error of all settings (`raytracer trade` and `tune`)
    machine: describe_machine, for the head of a table

Other packages may use:

    image_difference: Comparison, METRICS, THRESHOLD, as_json, as_rows, clip, compare, measure_difference
    figures: SUFFIXES, require_matplotlib
    difference_figure: write_difference
    pixel_doubt: PixelDoubt, find_pixel_doubt
    rounding_bounds: UNIT
    and the names that numerics, reflectance and tradeoffs list
"""
