"""Materials: how surfaces reflect, by a reflectance model and its parameters. No formulas are here.

Other packages may use:

    material: Material, MAX_LOBES
    models: MODELS, the table of all models and their parameters; Parameter, Shading, SHADINGS, REFLECTED
    lobe: Lobe, peak, MAX_COEFFICIENT
    merl: Measured, read, directions and SHAPE, for measured materials in MERL's format
    convert: translated, a material in another model; normal_reflectance; WITHOUT_PI

A new model is a row in models.py, a file in shaders/brdf/, and its formula in float64 in ground_truth/reflectance.py.
"""
