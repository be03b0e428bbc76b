"""Measurements: differences of pictures, rounding, reflectance, cost against error.

May import: all packages but app.
"""
