"""The package `core` imports no other package, and imports NumPy only inside functions that make arrays."""

import pkgutil
import subprocess
import sys

from raytracer import core
from tests import scenes

MODULES = [module.name for module in pkgutil.iter_modules(core.__path__, "raytracer.core.")]
SCRIPT = "import importlib, sys\nfor name in sys.argv[1:]: importlib.import_module(name)\nprint(*sys.modules)"


def test_core_imports_no_other_package_and_no_numpy() -> None:
    command = [sys.executable, "-c", SCRIPT, *MODULES]
    done = subprocess.run(command, cwd=scenes.CHECKOUT, capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert {*MODULES} <= loaded and not loaded & {"numpy", "moderngl", "rich", "PIL"}
    assert {name for name in loaded if name.split(".")[0] == "raytracer"} == {"raytracer", "raytracer.core", *MODULES}
