"""Values of wrong types in the Python API are refused by the argument's name; all real numbers are accepted."""

import decimal
import fractions
import io
import itertools
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.core.shown import format_value
from raytracer.formats.image_files import load_picture

api: Any = rt  # for calls with wrong types
CAMERA = rt.Camera((0, 1, 5), (0, 0, 0))
BALL = rt.Sphere((0, 0, 0), 1)
FLOOR = rt.Plane((0, 1, 0), 0)
SCENE = rt.Scene([BALL], [], CAMERA)
NEST: list[Any] = []
for _ in range(3000):
    NEST = [NEST]
LOOP: list[Any] = []
LOOP.append(LOOP)


class Hostile:
    """An object that raises an exception on any access."""

    def __float__(self) -> float:
        raise RuntimeError("boom")

    __iter__ = __repr__ = __index__ = __fspath__ = __array__ = __len__ = __float__  # pyright: ignore

    def __getattr__(self, name: str) -> Any:
        raise SystemError("boom")


class NotANumber(float):
    """A float that converts to NaN."""

    def __float__(self) -> float:
        return float("nan")


class Odd(float):
    """A number whose comparisons and text are unreliable."""

    def __lt__(self, other: object) -> bool:
        return False

    def __repr__(self) -> str:
        raise RuntimeError("boom")


# Values that are wrong for any argument, unless it is a collection, and wrong as an item of a collection.
WRONG: dict[str, Any] = {
    "None": None,
    "object": object(),
    "type": int,
    "hostile": Hostile(),
    "text": "x",
    "number as text": "1",
    "surrogate": "\ud800",
    "null": "a\0b",
    "bytes": b"123",
    "bytearray": bytearray(b"123"),
    "memoryview": memoryview(b"123"),
    "True": True,
    "NumPy's True": np.bool_(True),
    "complex": 1j,
    "NumPy's complex": np.complex64(1),
    "nan": float("nan"),
    "inf": float("inf"),
    "Decimal nan": decimal.Decimal("nan"),
    "Decimal snan": decimal.Decimal("sNaN"),
    "huge": 10**5000,
    "huge fraction": fractions.Fraction(10**5000, 3),
    "longdouble": np.longdouble(1e300) ** 2,
    "float that converts to NaN": NotANumber(0.5),
    "date": np.datetime64("2020"),
    "masked": np.ma.masked,
    "structured": np.zeros((), "f4, f4"),
    "dict": {},
    "dict of 3": {1: 1, 2: 2, 3: 3},
    "set": {1, 2, 3},
    "nested": NEST,
    "looped": LOOP,
    "texts": ["1", "2", "3"],
    "bools": [True, False, True],
    "endless": itertools.count(),
    "(2, 2)": np.ones((2, 2)),
    "(1,)": np.array([0.5]),
    "array of objects": np.array([None, None, None]),
    "array of texts": np.array(["1", "2", "3"]),
}


def wrong_values_except(*names: str) -> dict[str, Any]:
    return {name: value for name, value in WRONG.items() if name not in names}


NAMES = wrong_values_except("text", "number as text")  # both are valid names
SETTINGS = wrong_values_except("None")
GREY = np.full((3, 4, 3), 0.5, np.float32)
IMAGE = rt.Image(GREY)
PICTURES: dict[str, Any] = WRONG | {
    "ragged": [[[1, 2, 3]], [[1, 2, 3], [1, 2, 3]]],
    "ragged pixels": [[[1, 2, 3], [1, 2]]],
    "bool array": np.ones((3, 4, 3), np.bool_),
    "complex array": np.ones((3, 4, 3), np.complex64),
    "array of dates": np.zeros((3, 4, 3), "datetime64[s]"),
    "flat": np.ones((3, 4)),
    "empty": np.ones((3, 0, 3)),
    "masked array": np.ma.masked_less(GREY, 1.0),
}

ODD_DEVICES = wrong_values_except("None", "text", "number as text", "surrogate", "null")

PLACES: dict[str, tuple[str, Callable[[Any], Any], dict[str, Any]]] = {
    "Sphere.center": ("center", lambda v: api.Sphere(v, 1), WRONG),
    "Sphere.center[0]": ("center", lambda v: api.Sphere((v, 0, 0), 1), WRONG),
    "Sphere.radius": ("radius", lambda v: api.Sphere((0, 0, 0), v), WRONG),
    "Sphere.material": ("material", lambda v: api.Sphere((0, 0, 0), 1, v), WRONG),
    "Plane.normal": ("normal", lambda v: api.Plane(v, 0), WRONG),
    "Plane.offset": ("offset", lambda v: api.Plane((0, 1, 0), v), WRONG),
    "Solid |": ("b", lambda v: BALL | v, WRONG),
    "Complement": ("a", api.Complement, WRONG),
    "PointLight.position": ("position", api.PointLight, WRONG),
    "PointLight.color": ("color", lambda v: api.PointLight((0, 0, 0), v), WRONG),
    "PointLight.radius": ("radius", lambda v: api.PointLight((0, 0, 0), radius=v), WRONG),
    "PointLight.falloff": ("falloff", lambda v: api.PointLight((0, 0, 0), falloff=v), WRONG),
    "Camera.look_at": ("look_at", lambda v: api.Camera((0, 0, 0), v), WRONG),
    "Camera.up": ("up", lambda v: api.Camera((0, 1, 5), (0, 0, 0), v), WRONG),
    "Camera.projection": ("projection", lambda v: api.Camera((0, 1, 5), (0, 0, 0), projection=v), WRONG),
    "Camera.height": (
        "height",
        lambda v: api.Camera((0, 1, 5), (0, 0, 0), projection="orthographic", height=v),
        WRONG,
    ),
    "Camera.framing.scene": ("scene", api.Camera.framing, WRONG),
    "Camera.framing.direction": ("direction", lambda v: api.Camera.framing(BALL, v), WRONG),
    "Camera.framing.aspect": ("aspect", lambda v: api.Camera.framing(BALL, aspect=v), WRONG),
    "Camera.vertical_fov": ("vertical_fov", lambda v: api.Camera((0, 1, 5), (0, 0, 0), vertical_fov=v), WRONG),
    "Material.model": ("model", api.Material, WRONG),
    "Material.name": ("name", lambda v: api.Material(name=v), NAMES),
    "Material.kd": ("kd", lambda v: api.Material(kd=v), WRONG),
    "Material.h": ("h", lambda v: api.Material(h=v), WRONG),
    "Material.fresnel": ("fresnel", lambda v: api.Material("ggx", fresnel=v), WRONG),
    "Material.nodes": ("nodes", lambda v: api.Material("diffuse_microfacet", nodes=v), WRONG),
    "Material.tangent": ("tangent", lambda v: api.Material("lafortune", tangent=v), WRONG),
    "Material.file": ("file", lambda v: api.Material("merl", file=v), WRONG),
    "Material.lobes": ("lobes", lambda v: api.Material("lafortune", lobes=v), WRONG),
    "Material.lobes[0]": ("lobes", lambda v: api.Material("lafortune", lobes=[v]), WRONG),
    "Material.lobes[0].n": (
        "lobes",
        lambda v: api.Material("lafortune", lobes=[{"cx": 1, "cz": 1, "n": v}]),
        WRONG,
    ),
    **{
        f"Lobe.{name}": (name, lambda v, name=name: api.Lobe(**{"cx": 1, "cz": 1, "n": 1, name: v}), SETTINGS)
        for name in rt.Lobe.__struct_fields__
    },
    "Solid.from_postfix": ("items", api.Solid.from_postfix, WRONG),
    "Solid.from_postfix[0]": ("items", lambda v: api.Solid.from_postfix([v]), WRONG),
    "Instances.solid": ("solid", lambda v: api.Instances(v, [[0, 0, 0]]), WRONG),
    "Instances.positions": ("positions", lambda v: api.Instances(BALL, v), WRONG),
    "Instances.positions[0]": ("positions", lambda v: api.Instances(BALL, [v]), WRONG),
    "Instances.positions[0][0]": ("positions", lambda v: api.Instances(BALL, [[v, 0, 0]]), WRONG),
    "Instances.scales": ("scales", lambda v: api.Instances(BALL, [[0, 0, 0]], v), wrong_values_except("(1,)")),
    "Instances.rotations": ("rotations", lambda v: api.Instances(BALL, [[0, 0, 0]], 1, v), SETTINGS),
    "Instances.rotations[0]": ("rotations", lambda v: api.Instances(BALL, [[0, 0, 0]], 1, [v]), WRONG),
    "Instances.rotations[0][0]": ("rotations", lambda v: api.Instances(BALL, [[0, 0, 0]], 1, [[v, 0, 0, 1]]), WRONG),
    "Instances.scales[0]": ("scales", lambda v: api.Instances(BALL, [[0, 0, 0]], [v]), WRONG),
    "Scene.objects": ("objects", lambda v: api.Scene(v, [], CAMERA), WRONG),
    "Scene.objects[0]": ("objects", lambda v: api.Scene([v], [], CAMERA), WRONG),
    "Scene.lights": ("lights", lambda v: api.Scene([BALL], v, CAMERA), WRONG),
    "Scene.camera": ("camera", lambda v: api.Scene([BALL], [], v), wrong_values_except("None")),
    "Scene.ambient": ("ambient", lambda v: api.Scene([BALL], [], CAMERA, ambient=v), WRONG),
    "Scene.materials": ("materials", lambda v: api.Scene([BALL], [], CAMERA, materials=v), WRONG),
    "Scene.name": ("name", lambda v: api.Scene([BALL], [], CAMERA, name=v), NAMES),
    **{
        f"Settings.{name}": (name, lambda v, name=name: api.Settings(**{name: v}), SETTINGS)
        for name in rt.Settings.__struct_fields__
    },
    "load": ("path", api.load, wrong_values_except("text", "number as text")),
    "load_settings": ("path", api.load_settings, wrong_values_except("text", "number as text")),
    "quality": ("quality", api.quality, WRONG),
    "render.scene": ("scene", lambda v: api.render(v, (8, 8)), WRONG),
    "render.size": ("size", lambda v: api.render(SCENE, v), WRONG),
    "render.size[0]": ("size", lambda v: api.render(SCENE, (v, 8)), WRONG),
    "render.backend": ("backend", lambda v: api.render(SCENE, (8, 8), backend=v), SETTINGS),
    "render.device": ("device", lambda v: api.render(SCENE, (8, 8), device=v), ODD_DEVICES),
    "render.geometry": (
        "geometry",
        lambda v: api.render(SCENE, (8, 8), geometry=v),
        wrong_values_except("True", "NumPy's True"),
    ),
    "render.transparent": (
        "transparent",
        lambda v: api.render(SCENE, (8, 8), transparent=v),
        wrong_values_except("True", "NumPy's True"),
    ),
    "render.progress": ("progress", lambda v: api.render(SCENE, (8, 8), progress=v), SETTINGS),
    "render.settings": ("settings", lambda v: api.render(SCENE, (8, 8), v), SETTINGS),
    "reference.scene": ("scene", lambda v: api.reference(v, (8, 8)), WRONG),
    "reference.size": ("size", lambda v: api.reference(SCENE, v), WRONG),
    "reference.settings": ("settings", lambda v: api.reference(SCENE, (8, 8), v), SETTINGS),
    "reference.transparent": (
        "transparent",
        lambda v: api.reference(SCENE, (8, 8), transparent=v),
        wrong_values_except("True", "NumPy's True"),
    ),
    "reference.cache": (
        "cache",
        lambda v: api.reference(SCENE, (8, 8), cache=v),
        wrong_values_except("True", "NumPy's True"),
    ),
    **{
        f"reference.{name}": (name, lambda v, name=name: api.reference(SCENE, (8, 8), **{name: v}), SETTINGS)
        for name in ("shading", "shadows", "bounces", "workers", "progress")
    },
    **{
        f"reference.{name}": (name, lambda v, name=name: api.reference(SCENE, (8, 8), **{name: v}), WRONG)
        for name in ("samples", "tolerance")
    },
    "compare.a": (
        "a",
        lambda v: api.compare(v, GREY),
        {name: value for name, value in PICTURES.items() if not isinstance(value, str)},
    ),
    "compare.a[0]": ("a", lambda v: api.compare([v], GREY), PICTURES),
    "compare.b[0][0]": ("b", lambda v: api.compare(GREY, [[v]]), PICTURES),
    "compare.b[0][0][0]": ("b", lambda v: api.compare(GREY, [[[v, 0, 0]]]), PICTURES),
    "compare.threshold": ("threshold", lambda v: api.compare(GREY, GREY, threshold=v), WRONG),
    "compare.flip": ("flip", lambda v: api.compare(GREY, GREY, flip=v), SETTINGS),
    "load_all": ("path", api.load_all, wrong_values_except("text", "number as text")),
    "load_picture": ("path", load_picture, wrong_values_except("text", "number as text")),
    "Scene.replace": ("camera", lambda v: SCENE.replace(camera=v), wrong_values_except("None")),
    "Settings.replace": ("samples", lambda v: rt.Settings().replace(samples=v), WRONG),
    "Material.replace": ("kd", lambda v: rt.Material().replace(kd=v), WRONG),
    "Image": ("radiance", api.Image, PICTURES),
    **{
        f"Image.{name}": (name, lambda v, name=name: IMAGE.replace(**{name: v}), wrong_values_except("None", "dict"))
        for name in ("depth", "normal", "material", "samples", "error", "estimate", "metadata", "alpha", "camera")
    },
    "Image.save": (
        "path",
        rt.Image(np.zeros((2, 2, 3), np.float32)).save,
        wrong_values_except("text", "number as text"),
    ),
    "Image.write.bits": ("bits", lambda v: IMAGE.write(io.BytesIO(), ".png", v), SETTINGS),
    "brdf.evaluate.material": ("material", lambda v: api.brdf.evaluate(v, (0, 0, 1), (0, 0, 1)), WRONG),
    "brdf.evaluate.wi": ("wi", lambda v: api.brdf.evaluate(rt.Material(), v, (0, 0, 1)), WRONG),
    "brdf.evaluate.wo[0]": ("wo", lambda v: api.brdf.evaluate(rt.Material(), (0, 0, 1), [[0, 0, v]]), WRONG),
    "brdf.bake": ("material", api.brdf.bake, WRONG),
    "brdf.call": (
        "function",
        lambda v: api.brdf.call(v, rt.Material()),
        {**WRONG, "pattern": "\x1b[31m(", "no name": ""},
    ),
    "Solid.from_postfix[1]": (
        "items",
        lambda v: api.Solid.from_postfix([BALL, v]),
        WRONG | {"time": np.timedelta64(0, "s")},
    ),
    "Sphere.power": ("point", BALL.power, WRONG),
    "Sphere.touches": ("point", BALL.touches, WRONG),
    "Plane.depth": ("point", FLOOR.depth, WRONG),
    "Plane.touches": ("point", FLOOR.touches, WRONG),
    "PointLight.is_bulb": ("sphere", api.PointLight((0, 0, 0)).is_bulb, WRONG | {"another": FLOOR}),
    "Settings.cast": ("light", api.Settings().cast, WRONG),
    "Settings.shaded": ("material", api.Settings().shaded, WRONG),
    "Material.get": ("name", api.Material().get, wrong_values_except("text", "number as text", "surrogate", "null")),
    "Image.write_png": ("file", lambda v: IMAGE.write_png(v), wrong_values_except("hostile")),
}


@pytest.mark.parametrize("place", PLACES)
def test_the_error_of_a_wrong_type_names_the_argument(place: str) -> None:
    argument, call, values = PLACES[place]
    for name, value in values.items():
        with pytest.raises(rt.InputError) as error:
            call(value)
        assert error.value.keys[:1] == (argument,), name
        message = str(error.value)
        assert message.startswith(argument) and message.isprintable() and len(message) < 400, name


def test_the_reason_of_an_error_does_not_repeat_its_keys_or_its_file() -> None:
    sources = sorted(Path(rt.__file__).parent.rglob("*.py"))
    written = re.compile(r"""InputError\(\s*f?["'](?!column |\{_COLUMNS)(?:[\w.\[\]-]|\{[^{}"]*\})+: """)
    assert [(path.name, match[0]) for path in sources for match in written.finditer(path.read_text())] == []


@pytest.mark.parametrize("value", [*WRONG.values(), ""], ids=[*WRONG, "empty"])
def test_an_unknown_name_of_a_published_material_is_refused(value: Any) -> None:
    with pytest.raises(rt.InputError, match=r"^name: expected a published material as") as error:
        api.published(value)
    assert error.value.keys == ("name",)


HALVES = [
    0.5,
    fractions.Fraction(1, 2),
    decimal.Decimal("0.5"),
    *(kind(0.5) for kind in (np.float16, np.float32, np.float64, np.longdouble)),
    np.array(0.5),
    np.array(0.5, np.float32),
    np.ma.array(0.5),
    np.array(fractions.Fraction(1, 2), object),
    Odd(0.5),
]
FOURS = [4, np.int8(4), np.uint64(4), np.array(4), np.array(4, object)]


@pytest.mark.parametrize("half", HALVES, ids=lambda v: type(v).__name__)
def test_real_numbers_of_all_types_become_floats(half: Any) -> None:
    sphere = rt.Sphere((half, 0, 0), half)
    material = rt.Material(kd=half, ks=(half, 1, 1))
    settings = rt.Settings(max_error=half)
    for value in (*sphere.center, sphere.radius, *material.kd, *material.ks, settings.max_error):
        assert type(value) is float
    assert repr(sphere) == "Sphere(center=(0.5, 0.0, 0.0), radius=0.5)"
    assert settings == rt.Settings(max_error=0.5) and repr(settings) == repr(rt.Settings(max_error=0.5))
    assert material == rt.Material(kd=0.5, ks=(0.5, 1, 1))
    assert rt.Instances(BALL, [[half, 0, 0]], half) == rt.Instances(BALL, [[0.5, 0, 0]], 0.5)


@pytest.mark.parametrize("four", FOURS, ids=lambda v: type(v).__name__)
def test_whole_numbers_of_all_types_become_ints(four: Any) -> None:
    settings = rt.Settings(samples=four, bounces=four, sequence="grid")
    assert type(settings.samples) is int and type(settings.bounces) is int
    assert repr(settings) == repr(rt.Settings(samples=4, bounces=4, sequence="grid"))
    precision = api.Settings(precision=four * 16).precision
    assert type(precision) is int and precision == 64


@pytest.mark.parametrize("vector", [np.array([1, 2, 3]), np.array([1, 2, 3], np.float32), range(1, 4), iter([1, 2, 3])])
def test_ordered_collections_of_3_numbers_are_vectors(vector: Any) -> None:
    assert rt.Sphere(vector, 1).center == (1.0, 2.0, 3.0)


@pytest.mark.gl
@pytest.mark.parametrize("size", [[8, 6], np.array([8, 6]), (np.int64(8), np.uint8(6))])
def test_a_size_may_be_a_list_an_array_or_a_tuple_of_numpy_numbers(size: Any) -> None:
    image = rt.render(SCENE, size, samples=np.int64(1), geometry=np.bool_(True))  # pyright: ignore[reportArgumentType]
    assert image.radiance.shape == (6, 8, 3)


def test_shown_returns_a_short_printable_text_for_any_value() -> None:
    shared: Any = BALL
    for _ in range(200):  # a tree of 2^200 leaves, whose repr would never end
        shared = rt.Union(shared, shared)
    values = [*WRONG.values(), shared, Odd(1), -(10**5000), [10**5000], {1: NEST}, "\x1b[2J\n" * 10**6, b"\0" * 10**6]
    limit = sys.get_int_max_str_digits()
    try:
        sys.set_int_max_str_digits(640)
        for value in values:
            text = format_value(value)
            assert text.isprintable() and 0 < len(text) <= 60
    finally:
        sys.set_int_max_str_digits(limit)
    assert format_value(-(10**5000)) == "a number of about 5000 digits"
    assert format_value([1, 2.5, "a", None, True, (1,)]) == "[1, 2.5, 'a', None, True, (1,)]"
    assert format_value(Hostile()) == "a Hostile" and format_value(np.zeros((2, 3))) == "an array of shape (2, 3)"
