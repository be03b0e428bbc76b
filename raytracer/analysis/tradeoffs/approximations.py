"""Shading approximations, each compared with its exact form, on the same scene with replaced materials.

Both pictures have the same samples, so that they differ only by the approximation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import msgspec

from raytracer.analysis.tradeoffs.configurations import MAIN, Configuration, Extent, Plan, Target
from raytracer.core.validation import InputError
from raytracer.rendering.renderer import Renderer
from raytracer.scene.instances import Instances
from raytracer.scene.materials.convert import convert_material, normal_reflectance
from raytracer.scene.materials.material import Material
from raytracer.scene.scene import Scene
from raytracer.scene.solids.flattening import with_leaves
from raytracer.scene.solids.solid import Solid

Change = Callable[[Material], Material]

# The standard deviation of the slopes of the rough surface on which diffuse models are compared, in degrees.
SIGMA = 30.0
# The index of refraction of glass.
_IOR = 1.5


class _Series(NamedTuple):
    """A knob with its exact form and approximations: each a label, and a function that replaces a material."""

    knob: str
    exact: tuple[str, Change]
    others: tuple[tuple[str, Change], ...]


def add_approximations(plan: Plan, scene: Scene, extent: Extent, renderer: Renderer) -> None:
    """Add the approximations of the extent to `plan`. `renderer` draws the table of a measured material."""
    settings = msgspec.structs.replace(plan.targets[MAIN].settings, samples=extent.shading_samples, shading=None)
    for series in _series(extent, renderer):
        name = f"{series.knob}: {series.exact[0]}"
        try:
            exact = replace_materials(scene, series.exact[1])
            others = [(label, replace_materials(scene, change)) for label, change in series.others]
        except InputError as error:
            plan.left_out.append((series.knob, str(error)))
            continue
        plan.targets[name] = Target(name, exact, settings, same_samples=True)
        for label, changed in ((series.exact[0], exact), *others):
            plan.configurations.append(Configuration((series.knob,), label, name, settings, scene=changed))


def replace_materials(scene: Scene, change: Change) -> Scene:
    """Return `scene` with each material replaced by `change`."""
    new = {material: change(material) for material in scene.materials}

    def changed(solid: Solid) -> Solid:
        return with_leaves(solid, lambda leaf: leaf.with_material(new[leaf.material]))

    objects = [o.replace(solid=changed(o.solid)) if isinstance(o, Instances) else changed(o) for o in scene.objects]
    return msgspec.structs.replace(scene, objects=objects, materials=tuple(dict.fromkeys(new.values())))


def _series(extent: Extent, renderer: Renderer) -> Iterator[_Series]:
    yield _Series(
        "highlight",
        ("Phong, h", lambda m: convert_material(m, "phong")),
        (("Blinn, 4 h", lambda m: convert_material(convert_material(m, "phong"), "blinn")),),
    )
    glass = Material("ggx", fresnel="dielectric", ior=_IOR)
    yield _Series(
        "Fresnel factor of glass",
        ("exact", lambda _: glass),
        (("Schlick", lambda _: Material("ggx", f0=((_IOR - 1.0) / (_IOR + 1.0)) ** 2)),),
    )
    gold = Material("ggx", fresnel="conductor")
    schlick = Material("ggx", f0=normal_reflectance(gold))
    yield _Series("Fresnel factor of gold", ("exact", lambda _: gold), (("Schlick", lambda _: schlick),))
    yield _rough_diffuse_series(extent)
    yield _Series(
        "quadrature nodes",
        (f"{extent.most_nodes} nodes", _convert_to("diffuse_microfacet", nodes=extent.most_nodes)),
        tuple((f"{n} nodes", _convert_to("diffuse_microfacet", nodes=n)) for n in extent.nodes),
    )
    yield _Series(
        "He's terms",
        (f"{extent.most_terms} terms", lambda _: Material("he", terms=extent.most_terms)),
        tuple((f"{n} terms", _replace_by("he", terms=n)) for n in extent.terms),
    )
    if extent.tables:
        yield _measured_table_series(renderer)


def _convert_to(model: str, **parameters: Any) -> Change:
    """Return a function that converts a material to a model, and sets some parameters."""
    return lambda material: convert_material(material, model).replace(**parameters)


def _replace_by(model: str, **parameters: Any) -> Change:
    return lambda _: Material(model, **parameters)


def _rough_diffuse_series(extent: Extent) -> _Series:
    """Return the series of rough diffuse surfaces whose slopes have the same standard deviation.

    Oren and Nayar's `sigma` is the standard deviation of an angle, in each direction. Beckmann's alpha is sqrt(2) times
    the standard deviation of a slope. EON's roughness is the ratio B / A of the terms in Oren and Nayar's short form,
    as in Fujii's model.
    """
    sigma = math.radians(SIGMA)
    alpha = min(1.0, math.sqrt(2.0) * math.tan(sigma))
    a = 1.0 - 0.5 * sigma**2 / (sigma**2 + 0.33)
    b = 0.45 * sigma**2 / (sigma**2 + 0.09)
    return _Series(
        "rough diffuse",
        (
            f"integral (xxiii), {extent.most_nodes} nodes",
            lambda m: convert_material(m, "diffuse_microfacet").replace(
                alpha=alpha, distribution="beckmann", nodes=extent.most_nodes
            ),
        ),
        (
            ("Oren-Nayar, full", lambda m: convert_material(m, "oren_nayar").replace(sigma=SIGMA)),
            ("Oren-Nayar, short", lambda m: convert_material(m, "oren_nayar").replace(sigma=SIGMA, form="short")),
            ("EON", _convert_to("eon", roughness=min(1.0, b / a))),
            ("Lambert", lambda m: convert_material(m, "lambert")),
        ),
    )


def _measured_table_series(renderer: Renderer) -> _Series:
    """Return the series of GGX and its own table in MERL's format, with steps of 1 degree or less."""
    from raytracer.rendering import brdf

    ggx = Material("ggx")
    table = Material("merl", file=brdf.bake(ggx, device=renderer.device))
    return _Series("MERL table", ("GGX", lambda _: ggx), (("its table", lambda _: table),))
