"""Files: scene files, instance files, arrays (`.npz`), pictures (`.png`), and `Image`.

May import: core, scene.
"""
