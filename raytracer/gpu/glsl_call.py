"""Call any GLSL function of `shaders/` over NumPy arrays, and get arrays back.

    >>> from raytracer import glsl
    >>> glsl.call("isInside", [[0, 1], [2, 3]], 0.5)
    array([ True, False])

The function runs on the GPU with the code that renders, once for each element. GLSL types become NumPy types: float is
float32, int is int32, uint is uint32, bool is bool, vec3 is (..., 3) float32, and a struct is a structured dtype, see
`dtype()`. Functions with arguments of the type `real` (real.glsl) run in their float form.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Any

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from raytracer.compiler.glsl.preprocessor import ShaderError, Source, assemble, shaders_folder
from raytracer.core.files import read_packaged
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError
from raytracer.gpu.device import Device, shared_device
from raytracer.gpu.gl import release, set_uniforms, volume_texture

# The width of the data textures, in words of 32 bits. Every driver of OpenGL 3.3 supports 1024; llvmpipe 16384.
_WIDTH = 1024

_BASIC: dict[str, np.dtype[Any]] = {
    "float": np.dtype("f4"),
    "int": np.dtype("i4"),
    "uint": np.dtype("u4"),
    "bool": np.dtype("i4"),  # 0 or 1 in the textures; a result of the type bool becomes a NumPy bool
    **{f"vec{n}": np.dtype(("f4", n)) for n in (2, 3, 4)},
    **{f"ivec{n}": np.dtype(("i4", n)) for n in (2, 3, 4)},
    "real": np.dtype("f4"),
    **{f"real{n}": np.dtype(("f4", n)) for n in (2, 3, 4)},
}
_STRUCT = re.compile(r"\bstruct\s+(\w+)\s*\{(.*?)\}\s*;", re.DOTALL)
_MEMBER = re.compile(r"(\w+)\s+(\w+)\s*(?:\[\s*(\w+)\s*\])?\s*;")
_DEFINE = re.compile(r"^\s*#define\s+(\w+)\s+(\d+)\s*$", re.MULTILINE)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)

Defines = Mapping[str, int]


def call(
    function: str,
    *arguments: ArrayLike,
    defines: Defines | None = None,
    device: Device | None = None,
    generated: Mapping[str, str] | None = None,
    file: str | None = None,
    volumes: Mapping[str, NDArray[np.float32]] | None = None,
) -> Any:
    """Call `function` for each of N elements.

    Args:
        function: The name of a GLSL function.
        arguments: One for each `in` and `inout` parameter, in order: an array of N elements of the parameter's type, or
            one element that serves all N. If all arguments are single elements, N is 1.
        defines: Values of preprocessor constants such as MAX_HITS.
        device: The device that runs the function. Default: the process's own.
        generated: Generated texts that take the place of files, by file name.
        file: The file of the function, if no file of shaders/ has it.
        volumes: The values of each sampler3D, by its name (D, H, W, 3).

    Returns an array of N elements of the function's type. With `out` or `inout` parameters it returns a tuple: the
    function's result (unless void), then the values of these parameters in order.

    Raises ShaderError if shaders/ has no such function, InputError if `file` has none, TypeError for a wrong number of
    arguments, ValueError for an argument that does not fit its parameter.
    """
    device = device or shared_device()
    types = _Types(file or _defining_file(function), defines, generated)
    result, parameters = types.signature(function)
    inputs = [p for p in parameters if p.direction != "out"]
    if len(arguments) != len(inputs):
        names = ", ".join(f"{p.type} {p.name}" for p in inputs)
        raise TypeError(f"{function}({names}) takes {len(inputs)} arguments, got {len(arguments)}")

    columns = [_elements(value, types.dtype(p.type), p.name) for value, p in zip(arguments, inputs, strict=True)]
    lengths = {len(column) for column in columns} - {1}
    if len(lengths) > 1:
        raise ValueError(f"{function}: expected arguments of one length, or of length 1, got lengths {sorted(lengths)}")
    count = lengths.pop() if lengths else 1
    taken = np.dtype([(p.name, types.dtype(p.type)) for p in inputs])
    data = np.zeros(count, taken)
    for parameter, column in zip(inputs, columns, strict=True):
        data[parameter.name] = column

    results = [("return", result)] if result != "void" else []
    results += [(p.name, p.type) for p in parameters if p.direction != "in"]
    returned = np.dtype([(name, types.dtype(kind)) for name, kind in results])
    source = types.program(function, result, parameters, taken, returned)
    # One draw computes as many elements as fit into one texture of input and one of output.
    words = max(taken.itemsize, returned.itemsize) // 4
    step = _WIDTH * device.limits.target // words
    parts = [_run(device, source, data[i : i + step], returned, volumes or {}) for i in range(0, count, step)]
    answer = np.concatenate(parts) if parts else np.zeros(0, returned)
    values = [answer[name].astype(bool) if kind == "bool" else answer[name].copy() for name, kind in results]
    return values[0] if len(values) == 1 else tuple(values)


def dtype(struct: str, defines: Defines | None = None) -> np.dtype[Any]:
    """Return the NumPy dtype of a GLSL struct of `shaders/`, with the members' names. A bool member is int32."""
    return _Types(_defining_file(struct), defines).dtype(struct)


def struct_dtype(struct: str, file: str, generated: Mapping[str, str]) -> np.dtype[Any]:
    """Return the NumPy dtype of a struct in a generated `file`. `generated` holds the generated texts by file name."""
    return _Types(file, None, generated).dtype(struct)


@cache
def _definitions() -> dict[str, list[str]]:
    """Find the files that define each function and struct of `shaders/`, by its name."""
    files: dict[str, list[str]] = {}
    folder = shaders_folder()
    for path in sorted(folder.rglob("*.glsl")):
        text = _COMMENT.sub("", read_packaged(path))
        for name in re.findall(r"^\w+\s+(\w+)\s*\([^()]*\)\s*\{|^struct\s+(\w+)", text, re.MULTILINE):
            file = path.relative_to(folder).as_posix()
            files.setdefault(name[0] or name[1], []).append(file)
    return files


def _defining_file(name: str) -> str:
    files = _definitions().get(name, [])
    if len(files) != 1:
        places = f", but in {' and '.join(files)}" if files else ""
        raise ShaderError(f"no function or struct {name} in exactly one file of {shaders_folder()}{places}")
    return files[0]


class _Parameter:
    """A parameter of a GLSL function: its direction (in, out or inout), type and name."""

    def __init__(self, text: str) -> None:
        *direction, self.type, self.name = text.split()
        self.direction = direction[0] if direction else "in"


class _Types:
    """The structs and signatures in the text of one file and its includes."""

    def __init__(self, file: str, defines: Defines | None, generated: Mapping[str, str] | None = None) -> None:
        self._file, self._defines, self._generated = file, defines, dict(generated or {})
        self._text = _COMMENT.sub("", assemble(file, defines, generated).text)
        self._constants = {**{k: int(v) for k, v in _DEFINE.findall(self._text)}, **(defines or {})}
        self._structs = {name: _MEMBER.findall(body) for name, body in _STRUCT.findall(self._text)}

    def signature(self, function: str) -> tuple[str, list[_Parameter]]:
        """Return the type and the parameters of a function. Raises InputError if the file has none of that name."""
        match = re.search(rf"^(\w+)\s+{re.escape(function)}\s*\(([^()]*)\)\s*\{{", self._text, re.MULTILINE)
        if not match:
            raise InputError(f"expected a function of {self._file}, got {format_value(function)}", "function")
        return match[1], [_Parameter(text) for text in match[2].split(",") if text.strip()]

    def dtype(self, name: str) -> np.dtype[Any]:
        """Return the NumPy dtype of a GLSL type."""
        if name in _BASIC:
            return _BASIC[name]
        members = []
        for kind, member, size in self._structs[name]:
            inner = self.dtype(kind)
            members.append((member, np.dtype((inner, self._size(size))) if size else inner))
        return np.dtype(members)

    def _size(self, size: str) -> int:
        return int(size) if size.isdigit() else self._constants[size]

    def program(
        self,
        function: str,
        result: str,
        parameters: list[_Parameter],
        taken: np.dtype[Any],
        returned: np.dtype[Any],
    ) -> Source:
        """Return a fragment shader whose fragment i computes word i of the results of all elements, one after the
        other."""
        body = [f"    {p.type} {p.name};" for p in parameters]
        offset = 0
        for p in parameters:
            if p.direction != "out":
                offset = self._words(p.type, p.name, offset, body, "    {lvalue} = {read}(in_word({k}));")
        arguments = ", ".join(p.name for p in parameters)
        body.append(f"    {f'{result} result = ' if result != 'void' else ''}{function}({arguments});")
        outputs = [(result, "result")] if result != "void" else []
        outputs += [(p.type, p.name) for p in parameters if p.direction != "in"]
        offset = 0
        for kind, name in outputs:
            offset = self._words(kind, name, offset, body, "    words[{k}] = {write}({lvalue});")
        words_in, words_out = taken.itemsize // 4, returned.itemsize // 4
        text = [
            f'#include "{self._file}"',
            "uniform isampler2D data;",
            "out int word;",
            f"int element = (int(gl_FragCoord.y) * {_WIDTH} + int(gl_FragCoord.x)) / {words_out};",
            "int in_word(int k) {",
            f"    int i = element * {words_in} + k;",
            f"    return texelFetch(data, ivec2(i % {_WIDTH}, i / {_WIDTH}), 0).x;",
            "}",
            "void main() {",
            f"    int words[{words_out}];",
            *body,
            f"    word = words[(int(gl_FragCoord.y) * {_WIDTH} + int(gl_FragCoord.x)) % {words_out}];",
            "}",
        ]
        return assemble("call", self._defines, self._generated | {"call": "\n".join(text)})

    def _words(self, kind: str, lvalue: str, offset: int, lines: list[str], form: str) -> int:
        """Append a line by the pattern `form` for each word of a value of the type `kind`, and return the next
        offset."""
        if kind in self._structs:
            for member_kind, member, size in self._structs[kind]:
                places = [f"[{i}]" for i in range(self._size(size))] if size else [""]
                for place in places:
                    offset = self._words(member_kind, f"{lvalue}.{member}{place}", offset, lines, form)
            return offset
        real = kind.startswith(("float", "vec", "real"))
        for component in range(_BASIC[kind].itemsize // 4):
            lines.append(
                form.format(
                    lvalue=f"{lvalue}[{component}]" if kind[-1].isdigit() else lvalue,
                    read="intBitsToFloat" if real else kind if kind in ("bool", "uint") else "",
                    write="floatBitsToInt" if real else "int",
                    k=offset + component,
                )
            )
        return offset + _BASIC[kind].itemsize // 4


def _elements(value: ArrayLike, kind: np.dtype[Any], name: str) -> NDArray[Any]:
    """Convert `value` to an array of one or N elements of a type."""
    base, shape = kind.subdtype or (kind, ())
    array = np.asarray(value, base)
    if array.ndim == len(shape):
        array = array[None]
    if array.ndim != len(shape) + 1 or array.shape[1:] != shape:
        raise ValueError(f"{name}: expected an array of shape (N, {', '.join(map(str, shape))}), got {array.shape}")
    return array


def _run(
    device: Device,
    source: Source,
    data: NDArray[Any],
    returned: np.dtype[Any],
    volumes: Mapping[str, NDArray[np.float32]],
) -> NDArray[Any]:
    """Run the program for the elements of `data`, and return their results."""
    context = device.context
    words = np.ascontiguousarray(data).view(np.int32).ravel() if data.dtype.itemsize else np.zeros(0, np.int32)
    padded = np.zeros((max(1, -(-len(words) // _WIDTH)), _WIDTH), np.int32)
    padded.ravel()[: len(words)] = words
    total = len(data) * (returned.itemsize // 4)
    with device.turn():
        program = device.program(source)
        texture = context.texture((_WIDTH, len(padded)), 1, padded.tobytes(), dtype="i4")
        target = context.texture((_WIDTH, -(-total // _WIDTH)), 1, dtype="i4")
        framebuffer = context.framebuffer([target])
        array = context.vertex_array(program, [])
        framebuffer.use()
        texture.use(0)
        set_uniforms(program, data=0)
        textures = [volume_texture(context, values) for values in volumes.values()]
        for unit, (name, volume) in enumerate(zip(volumes, textures, strict=True), start=1):
            volume.use(unit)
            set_uniforms(program, **{name: unit})
        array.render(moderngl.TRIANGLES, 3)
        answer = np.frombuffer(framebuffer.read(components=1, dtype="i4"), np.int32)[:total]
        release(context, array, framebuffer, target, texture, *textures)
    return answer.view(returned)
