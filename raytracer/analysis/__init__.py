"""Measurements: differences of pictures, rounding, reflectance, cost against error.

Each measurement is a value that is computed without printing; app prints values, or writes them. The package may import
all others but app.

    image_difference: metrics of how far two pictures are apart (`rt.compare`)
    figures, difference_figure: the style of all plots, and the figure of `raytracer compare -o`
    pixel_doubt, rounding_bounds: how far rounding may move a picture's numbers, for each pixel
    numerics: how wrong pictures are where numbers get extreme (`raytracer extremes`)
    reflectance: properties of the reflectance models, and their expectations (`raytracer brdf`)
    tradeoffs: cost against error of all settings (`raytracer trade` and `tune`)
    machine: describe_machine, for the head of a table

Other packages may use:

    image_difference: Comparison, METRICS, THRESHOLD, as_json, as_rows, compare, measure_difference
    pixel_doubt: PixelDoubt, find_pixel_doubt
    rounding_bounds: UNIT
    and the names that numerics, reflectance and tradeoffs list
"""
