"""Checks of a user's values, vectors, files that are read with bounds and written whole, text for a terminal.

Nothing here imports NumPy when it is imported. May import: no other package.
"""
