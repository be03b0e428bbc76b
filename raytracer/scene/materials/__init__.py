"""Reflectance models and materials: the table of models, published and measured materials, conversions."""
