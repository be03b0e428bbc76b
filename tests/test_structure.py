"""The structure of the package: what a file may hold, and where. The directions of imports are `lint-imports`'s."""

import ast
import re
from collections.abc import Iterator
from inspect import isfunction
from pathlib import Path

import raytracer as rt

ROOT, TESTS = Path(rt.__file__).parent, Path(__file__).parent
LONGEST = 340  # lines of a file

# The functions whose values are kept for as long as the process runs, and why these values stay right and few.
CACHED = {
    ("compiler/glsl/preprocessor.py", "_file_pieces"): "of files of the package, read anew where a file was changed",
    ("formats/material_library.py", "_library"): "of files of the package, which has a few hundred materials",
    ("gpu/glsl_call.py", "_definitions"): "of files of the package: a function's file never changes",
    ("analysis/reflectance/properties.py", "_known_rule"): "of numbers alone, and at most 64",
}
# The names of modules that are bound anew, or collect what comes, while the process runs, and why.
VARIABLES = {
    ("gpu/context.py", "_loaders"): "the open windows of GLFW, which ends with the last of them",
    ("gpu/device.py", "_shared"): "the devices that rt.render() and glsl.call() share",
    ("gpu/turns.py", "_process"): "which thread of this process draws, anew after a fork",
    ("rendering/renderer.py", "_shared"): "the renderer of each shared device, with the one scene that was drawn last",
    ("ground_truth/workers.py", "_worker"): "in a process that does nothing else",
}
COLLECTIONS = ("OrderedDict", "WeakKeyDictionary", "WeakSet", "WeakValueDictionary", "defaultdict", "deque")
COLLECTIONS += ("dict", "list", "set")


def parsed(folder: Path) -> dict[str, ast.Module]:
    """The modules in a folder and below, by their paths in it."""
    return {path.relative_to(folder).as_posix(): ast.parse(path.read_text()) for path in sorted(folder.rglob("*.py"))}


MODULES = parsed(ROOT)


def imports(module: ast.Module) -> set[str]:
    """The names of all modules that are imported anywhere in a module, also for types only, and of what is in them."""
    names: set[str] = set()
    for node in ast.walk(module):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def test_the_root_holds_the_public_names_and_the_command_only() -> None:
    assert {name for name in MODULES if "/" not in name} <= {"__init__.py", "__main__.py", "version.py"}


def test_no_file_is_long() -> None:
    lines = {name: len((ROOT / name).read_text().splitlines()) for name in MODULES}
    assert not {name: count for name, count in lines.items() if count > LONGEST}


def test_a_package_says_what_it_is_for_and_holds_nothing_else() -> None:
    packages = {name: module for name, module in MODULES.items() if name.endswith("/__init__.py")}
    assert len(packages) >= 9
    assert not [name for name, module in packages.items() if not ast.get_docstring(module) or len(module.body) > 1]


def test_opengl_is_called_in_gpu_alone() -> None:
    users = {name.partition("/")[0] for name, module in MODULES.items() if {"moderngl", "glcontext"} & imports(module)}
    assert users == {"gpu"}


def test_no_module_or_package_has_the_name_of_a_public_function() -> None:
    functions = {name for name in rt.__all__ if isfunction(getattr(rt, name))}
    assert "render" in functions
    assert not [name for name in MODULES if functions & {*Path(name).with_suffix("").parts}]


def cached(module: ast.Module) -> Iterator[str]:
    """The functions of a module whose values functools keeps."""
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef):
            decorators = [ast.unparse(each).partition("(")[0].rpartition(".")[2] for each in node.decorator_list]
            if {"cache", "lru_cache"} & {*decorators}:
                yield node.name


def variables(module: ast.Module) -> Iterator[str]:
    """The names of a module that a function binds anew, or that begin as an empty collection."""
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


def test_only_objects_keep_what_was_made_but_for_a_few_names_with_reasons() -> None:
    assert {(name, function) for name, module in MODULES.items() for function in cached(module)} == {*CACHED}
    assert {(name, variable) for name, module in MODULES.items() for variable in variables(module)} == {*VARIABLES}


def test_tests_stand_where_the_packages_do_and_import_no_test() -> None:
    tests = parsed(TESTS)
    assert {name.partition("/")[0] for name in tests if "/" in name} <= {name.partition("/")[0] for name in MODULES}
    assert not {name for name, module in tests.items() if any(".test_" in each for each in imports(module))}


def test_a_package_lists_the_names_that_other_packages_import() -> None:
    lists = {name: ast.get_docstring(module) or "" for name, module in MODULES.items() if name.endswith("__init__.py")}
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
