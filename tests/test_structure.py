"""The structure of the package: the allowed content of its files. `lint-imports` checks the directions of imports."""

import ast
import re
from collections.abc import Iterator
from inspect import isfunction
from pathlib import Path

import raytracer as rt

ROOT, TESTS = Path(rt.__file__).parent, Path(__file__).parent
LONGEST = 340  # lines of a file

# Functions whose values are kept as long as the process runs, with the reason why the values stay right and few.
CACHED = {
    ("compiler/glsl/preprocessor.py", "_file_pieces"): "files of the package, which are read again after a change",
    ("farm/remote.py", "own_code"): "files of the package as this process imported them",
    ("formats/material_library.py", "_library"): "files of the package, which has a few hundred materials",
    ("gpu/glsl_call.py", "_definitions"): "files of the package: the file of a function never changes",
    ("analysis/reflectance/properties.py", "_known_rule"): "depends on numbers alone, and keeps at most 64 values",
    ("scene/solids/polyhedron.py", "_faces"): "depends on points alone, and keeps the faces of at most 64 polyhedra",
}
# Variables of modules that are set again, or collect values, while the process runs, with the reason.
VARIABLES = {
    ("gpu/context.py", "_loaders"): "the open windows of GLFW, which is terminated with the last of them",
    ("gpu/device.py", "_shared"): "the devices that rt.render() and glsl.call() share",
    ("gpu/turns.py", "_process"): "the thread of this process that draws, set again after a fork",
    ("rendering/renderer.py", "_shared"): "the renderer of each shared device, with the one scene that was drawn last",
    ("ground_truth/workers.py", "_worker"): "the state of a process that does nothing else",
}
COLLECTIONS = ("OrderedDict", "WeakKeyDictionary", "WeakSet", "WeakValueDictionary", "defaultdict", "deque")
COLLECTIONS += ("dict", "list", "set")


def parse_modules(folder: Path) -> dict[str, ast.Module]:
    """Return the modules in a folder and below, by their paths in it."""
    return {path.relative_to(folder).as_posix(): ast.parse(path.read_text()) for path in sorted(folder.rglob("*.py"))}


MODULES = parse_modules(ROOT)


def imports(module: ast.Module) -> set[str]:
    """Return the names of all modules that a module imports anywhere, also for types only, and of their members."""
    names: set[str] = set()
    for node in ast.walk(module):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def test_the_root_has_only_the_public_names_and_the_command() -> None:
    assert {name for name in MODULES if "/" not in name} <= {"__init__.py", "__main__.py", "version.py"}


def test_no_file_has_more_lines_than_the_limit() -> None:
    lines = {name: len((ROOT / name).read_text().splitlines()) for name in MODULES}
    assert not {name: count for name, count in lines.items() if count > LONGEST}


def test_the_init_file_of_a_package_has_a_docstring_and_nothing_else() -> None:
    packages = {name: module for name, module in MODULES.items() if name.endswith("/__init__.py")}
    assert len(packages) >= 9
    assert not [name for name, module in packages.items() if not ast.get_docstring(module) or len(module.body) > 1]


def test_only_the_package_gpu_calls_opengl() -> None:
    users = {name.partition("/")[0] for name, module in MODULES.items() if {"moderngl", "glcontext"} & imports(module)}
    assert users == {"gpu"}


def test_no_module_or_package_has_the_name_of_a_public_function() -> None:
    functions = {name for name in rt.__all__ if isfunction(getattr(rt, name))}
    assert "render" in functions
    assert not [name for name in MODULES if functions & {*Path(name).with_suffix("").parts}]


def cached(module: ast.Module) -> Iterator[str]:
    """Yield the functions of a module whose values functools caches."""
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef):
            decorators = [ast.unparse(item).partition("(")[0].rpartition(".")[2] for item in node.decorator_list]
            if {"cache", "lru_cache"} & {*decorators}:
                yield node.name


def variables(module: ast.Module) -> Iterator[str]:
    """Yield the variables of a module that a function sets again, or that start as an empty collection."""
    for node in ast.walk(module):
        if isinstance(node, ast.Global):
            yield from node.names
    for node in module.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value and is_empty_collection(node.value):
            yield ast.unparse(node.targets[0] if isinstance(node, ast.Assign) else node.target)


def is_empty_collection(value: ast.expr) -> bool:
    match value:
        case ast.Dict(keys=[]) | ast.List(elts=[]):
            return True
        case ast.Call(func=function, args=[]):
            return ast.unparse(function).rpartition(".")[2] in COLLECTIONS
    return False


def test_only_the_listed_functions_and_variables_keep_values_in_a_module() -> None:
    assert {(name, function) for name, module in MODULES.items() for function in cached(module)} == {*CACHED}
    assert {(name, variable) for name, module in MODULES.items() for variable in variables(module)} == {*VARIABLES}


def test_the_folders_of_tests_are_those_of_packages_and_no_test_imports_a_test() -> None:
    tests = parse_modules(TESTS)
    assert {name.partition("/")[0] for name in tests if "/" in name} <= {name.partition("/")[0] for name in MODULES}
    assert not {name for name, module in tests.items() if any(".test_" in item for item in imports(module))}


def test_a_package_lists_the_names_that_other_packages_import() -> None:
    lists = {name: ast.get_docstring(module) or "" for name, module in MODULES.items() if name.endswith("__init__.py")}
    lists["scene/solids/__init__.py"] += "\n" + "\n".join(imports(MODULES["scene/solids/primitives.py"]))
    missing: set[str] = set()
    for name, module in MODULES.items():
        own = name.partition("/")[0]
        for node in ast.walk(module):
            if "/" not in name or not isinstance(node, ast.ImportFrom) or not node.module:
                continue
            root, *folders = node.module.split(".")
            if root != "raytracer" or not folders or folders[0] in (own, "version"):
                continue
            pages = ["/".join(folders[:end]) for end in range(1, len(folders) + 1)]
            words = re.findall(r"\w+", " ".join(lists.get(f"{page}/__init__.py", "") for page in pages))
            missing |= {f"{node.module}: {alias.name}" for alias in node.names if alias.name not in words}
    assert not missing
