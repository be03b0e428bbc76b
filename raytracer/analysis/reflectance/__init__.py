"""The bench: what the reflectance models are, measured of the very GLSL that renders, and shown.

`quadrature.py` says where to look, `measure.py` what is found there, `expectations.py` what is to be found by theory,
and `closed_forms.py` which albedos; `verification.py` compares for all models at the ends of their ranges; `report.py`,
`plots.py` and `gallery.py` show.
All directions are in a frame whose normal N is +z; f is the reflectance in 1/sr.
"""
