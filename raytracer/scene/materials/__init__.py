"""Materials: reflectance models, their parameters, and conversion between models. The formulas are in shaders/brdf/.

Other packages may use:

    material: Material, MAX_LOBES
    models: MODELS, the table of all models and their parameters; Parameter, Shading, SHADINGS, REFLECTED,
        AMBIENT_SHARE
    lobe: Lobe, peak, MAX_COEFFICIENT
    merl: Measured, read, directions and SHAPE, for measured materials in MERL's format
    convert: convert_material (to another model); normal_reflectance; WITHOUT_PI

To add a model, add a row in models.py, a file in shaders/brdf/, and the formula in float64 in
ground_truth/reflectance.py.
"""
