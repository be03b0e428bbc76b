"""The package's public names, which do not depend on the modules that are imported or on their order."""

import inspect
import pickle
import pkgutil
import pydoc
import subprocess
import sys

import pytest

import raytracer as rt

from . import scenes

FUNCTIONS = ("compare", "load", "load_all", "load_settings", "published", "quality", "reference", "render")
SLOW = ("numpy", "moderngl", "glcontext", "glfw", "OpenGL", "PIL", "rich", "tomlkit")


def run(code: str, *arguments: str) -> None:
    """Run Python code in a process of its own."""
    subprocess.run([sys.executable, "-c", code, *arguments], cwd=scenes.CHECKOUT, check=True, timeout=300)


def modules() -> list[str]:
    names = [module.name for module in pkgutil.walk_packages(rt.__path__, "raytracer.")]
    assert len(names) > 70
    return names


IMPORT_ALL = f"""
import importlib, inspect, random, sys
import raytracer as rt
names = sys.argv[2:]
if sys.argv[1] == "backwards":
    names.reverse()
elif sys.argv[1] != "forwards":
    random.Random(int(sys.argv[1])).shuffle(names)
public = dir(rt)
for name in names:
    importlib.import_module(name)
    wrong = [f for f in {FUNCTIONS} if f in vars(rt) and not inspect.isfunction(vars(rt)[f])]
    assert not wrong and dir(rt) == public, (name, wrong)
for f in {FUNCTIONS}:
    assert inspect.isfunction(getattr(rt, f)), f
exec("from raytracer import *")
assert all(globals()[name] is getattr(rt, name) for name in rt.__all__) and dir(rt) == public
"""


@pytest.mark.parametrize("order", ["forwards", "backwards", "1", "2"])
def test_public_functions_and_dir_do_not_depend_on_the_order_of_imports(order: str) -> None:
    run(IMPORT_ALL, order, *modules())


@pytest.mark.parametrize(
    "first",
    [
        "analysis.image_difference",
        "app.commands.compare_cli",
        "ground_truth.ray_tracer",
        "ground_truth.picture",
        "rendering.renderer",
        "rendering.brdf",
    ],
)
def test_public_functions_do_not_depend_on_the_first_import(first: str) -> None:
    run(f"import raytracer.{first}\nassert all(callable(getattr(raytracer, f)) for f in {FUNCTIONS})")


def test_a_star_import_provides_the_public_functions() -> None:
    run(f"from raytracer import *\nimport inspect\nassert all(inspect.isfunction(globals()[f]) for f in {FUNCTIONS})")


def test_a_scene_is_made_and_printed_without_numpy_and_opengl() -> None:
    run(
        "import sys, raytracer as rt\n"
        "scene = rt.Scene([rt.Sphere((0, 0, 0), 1)], [], rt.Camera((0, 0, 5), (0, 0, 0)))\n"
        "assert eval(repr(scene), dict(vars(rt))) == scene.replace(name='scene') and dir(rt)\n"
        f"loaded = [name for name in {SLOW} if name in sys.modules]\n"
        "assert not loaded, loaded\n"
    )


MATERIAL = rt.Material("lafortune", lobes=[{"cx": 1, "cz": 1, "n": 3}])
BALL = rt.Sphere((0, 0, 0), 1, MATERIAL)
CAMERA = rt.Camera((0, 0, 5), (0, 0, 0))


@pytest.mark.parametrize(
    "value",
    [
        BALL,
        ~(BALL & rt.Plane((0, 1, 0), 0)),
        MATERIAL,
        CAMERA,
        rt.Settings(samples=4),
        rt.Scene([BALL, rt.Instances(BALL, [[0, 0, 0]])], [rt.PointLight((1, 2, 3))], CAMERA),
        rt.SceneFile(rt.Scene([BALL], [], CAMERA), (4, 3), rt.Settings()),
        rt.Comparison(0.5, 1.0, (0, 0), 6.0, None, 0.01, 0.0),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_repr_of_an_unpickled_value_evaluates_in_a_fresh_process(value: object) -> None:
    run(
        "import pickle, sys, raytracer as rt\n"
        "value = pickle.loads(bytes.fromhex(sys.argv[1]))\n"
        "assert eval(repr(value), vars(rt)) == value\n",
        pickle.dumps(value).hex(),
    )


def test_a_users_own_class_does_not_replace_a_public_class() -> None:
    sphere = rt.Sphere
    type("Sphere", (sphere,), {})
    assert rt.Sphere is sphere


@pytest.mark.parametrize(
    "call", ['rt.published("lafortune/clay")', "rt.compare([[[0, 0, 0]]], [[[1, 0, 0]]])"], ids=["published", "compare"]
)
def test_the_repr_of_a_returned_value_evaluates_in_a_fresh_process(call: str) -> None:
    run(f"import raytracer as rt\nvalue = {call}\nassert eval(repr(value), vars(rt)) == value")


def test_dir_lists_exactly_the_public_names() -> None:
    assert [name for name in dir(rt) if not name.startswith("_")] == sorted(rt.__all__)
    assert {"__version__", "__all__", "__doc__", "__file__"} <= set(dir(rt))
    assert all(getattr(rt, name).__doc__ for name in rt.__all__)


def test_public_functions_document_their_parameters() -> None:
    for name in FUNCTIONS:
        function = getattr(rt, name)
        for parameter in inspect.signature(function).parameters.values():
            assert parameter.annotation is not parameter.empty
            if name in ("reference", "compare"):
                assert f"{parameter.name}" in function.__doc__, f"{name}: {parameter.name}"


def test_public_classes_have_signatures_and_help() -> None:
    shown = {name: str(inspect.signature(getattr(rt, name))) for name in ("Camera", "Image", "Settings", "Sphere")}
    assert "radius: float, material: raytracer.Material" in shown["Sphere"]
    assert "depth: numpy.ndarray" in shown["Image"]
    assert "positions: Any, scales: Any = 1.0" in str(inspect.signature(rt.Instances))
    assert all(pydoc.render_doc(getattr(rt, name)) for name in rt.__all__)
