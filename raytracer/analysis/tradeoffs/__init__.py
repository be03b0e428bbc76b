"""What each knob costs and what error it leaves, measured on a scene: `raytracer trade` and `raytracer tune`.

`configurations.py` and `approximations.py` say what is tried and against what, `targets.py` makes what it is compared
with, `measure.py` measures in turns, `pareto.py` finds what is worth its time; `report.py`, `page.py`, `plots.py` and
`strips.py` show it. `tune.py` searches for the cheapest settings that meet a target.
"""
