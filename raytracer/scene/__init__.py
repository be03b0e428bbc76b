"""The description of a picture: solids, lights, a camera, materials, settings, sample sequences; frozen values.

May import: core.
"""
