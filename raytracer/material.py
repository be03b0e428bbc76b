"""How a surface reflects: a model of `models.py` and its parameters.

Part of `scene.py`, which says what holds for all of it.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any, NoReturn

from raytracer.checks import MAX_COLOR, MAX_EXPONENT, InputError, Vec3, direction, number, shown
from raytracer.models import MODELS, Lobe, Parameter

if TYPE_CHECKING:
    from raytracer.merl import Measured

MAX_LOBES = 16


class Material:
    """How a surface reflects: `model`, a name of `models.MODELS`, and parameters that this model has.

        Material(kd=(0.64, 0.08, 0.08))
        Material("ggx", alpha=0.1, fresnel="conductor")

    A parameter that is not given has the model's default; all are attributes. Where three numbers are a colour
    (linear RGB), one number stands for three that are equal. `name` is only a label. Raises InputError for a
    parameter that the model does not have, or a value out of its range. Frozen; equal if all is equal.
    """

    __slots__ = ("_hash", "_values", "model", "name")

    model: str
    name: str
    _values: dict[str, Any]

    def __init__(self, model: str = "phong", *, name: str = "", **parameters: Any) -> None:
        if not isinstance(model, str) or model not in MODELS:
            raise InputError(f"model: expected one of {', '.join(MODELS)}, got {shown(model)}")
        if not isinstance(name, str):
            raise InputError(f"name: expected a string, got {shown(name)}")
        known = MODELS[model].parameters
        for key in parameters:
            if key not in known:
                raise InputError(f"{key}: the model {model} has no such parameter (known: {', '.join(known)})")
        values = {
            key: _checked(parameter, parameters[key]) if key in parameters else parameter.default
            for key, parameter in known.items()
        }
        for key, parameter in known.items():
            if not parameter.when or values[parameter.when[0]] == parameter.when[1]:
                continue
            if key in parameters:
                condition = f'{parameter.when[0]} = "{parameter.when[1]}"'
                raise InputError(f"{key}: expected only with {condition}, got {values[parameter.when[0]]!r}")
            del values[key]
        if missing := [key for key, value in values.items() if value is None]:
            raise InputError(f"{missing[0]}: missing, the model {model} needs it")
        for field, value in (("model", model), ("name", name), ("_values", values)):
            object.__setattr__(self, field, value)
        object.__setattr__(self, "_hash", hash((model, name, *values.values())))

    @property
    def parameters(self) -> Mapping[str, Any]:
        """All its parameters by name, also those that have their default."""
        return dict(self._values)

    def get(self, name: str, default: Any = None) -> Any:
        """A parameter, or `default` if the model has none of that name."""
        return self._values.get(name, default)

    def replace(self, **changes: Any) -> Material:
        """The same material with other parameters, another name or another model. `copy.replace` does the same.

        With another choice goes what only the choice before had: f0, where `fresnel` is "schlick" no more. With
        another model goes what the new one does not have.
        """
        model = changes.pop("model", self.model)
        new = MODELS.get(model) if isinstance(model, str) else None
        known = new.parameters if new else {}
        chosen = {key: parameter.default for key, parameter in known.items()} | self._values | changes
        kept = {
            key: value
            for key, value in self._values.items()
            if key in known and (not (when := known[key].when) or chosen[when[0]] == when[1])
        }
        return Material(model, **{"name": self.name, **kept, **changes})

    __replace__ = replace

    def __getattr__(self, name: str) -> Any:
        if name != "_values" and name in self._values:
            return self._values[name]
        raise AttributeError(f"a material of the model {self.model} has no {name}")

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"a Material is frozen: use replace({name}=...)")

    __delattr__ = __setattr__  # pyright: ignore[reportAssignmentType]

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        return isinstance(other, Material) and (self.model, self.name, self._values) == (
            other.model,
            other.name,
            other._values,
        )

    def __hash__(self) -> int:
        return self._hash

    def __repr__(self) -> str:
        known = MODELS[self.model].parameters
        parts = [f"model={self.model!r}"] if self.model != "phong" else []
        parts += [f"{key}={value!r}" for key, value in self._values.items() if value != known[key].default]
        parts += [f"name={self.name!r}"] if self.name else []
        return f"Material({', '.join(parts)})"

    def __reduce__(self) -> tuple[Any, ...]:
        return _made, (self.model, self.name, self._values)


def _made(model: str, name: str, values: dict[str, Any]) -> Material:
    return Material(model, name=name, **values)


def _checked(parameter: Parameter, value: Any) -> Any:
    """`value` as the parameter holds it. Raises InputError."""
    name, low, high = parameter.name, parameter.low, parameter.high
    match parameter.kind:
        case "number":
            return number(value, name, low, high, f"a number in [{low:g}, {high:g}]")
        case "whole":
            result = number(value, name, low, high, expected := f"a whole number in [{low:g}, {high:g}]")
            if result != int(result):
                raise InputError(f"{name}: expected {expected}, got {shown(value)}")
            return int(result)
        case "color":
            return _three(value, name, low, high)
        case "direction":
            return direction(value, name)
        case "choice":
            if not isinstance(value, str) or value not in parameter.choices:
                raise InputError(f"{name}: expected one of {', '.join(parameter.choices)}, got {shown(value)}")
            return value
        case "lobes":
            return _lobes(value)
        case "measured":
            return _measured(value, name)


def _three(value: Any, name: str, low: float, high: float) -> Vec3:
    expected = f"3 numbers, or one for all, in [{low:g}, {high:g}]"
    try:
        r, g, b = (value,) * 3 if isinstance(value, Real) else value
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected {expected}, got {shown(value)}") from None
    r, g, b = (number(part, name, low, high, expected) for part in (r, g, b))
    return (r, g, b)


# Cosines of a lobe times its coefficients; above, its power would not stay finite with any exponent worth having.
MAX_COEFFICIENT = 1e3


def _lobes(value: Any) -> tuple[Lobe, ...]:
    """The lobes with three numbers for each of their parts. Each part may be given as a table, as in a file."""
    expected = f"at most {MAX_LOBES} lobes {{ cx, cz, n }}"
    if isinstance(value, str | Mapping) or not hasattr(value, "__iter__"):
        raise InputError(f"lobes: expected {expected}, got {shown(value)}")
    lobes = []
    for i, given in enumerate(value):
        key = f"lobes[{i}]"
        if not isinstance(given, Lobe):
            if (
                not isinstance(given, Mapping)
                or {"cx", "cz", "n"} - set(given)
                or set(given) - set(Lobe.__struct_fields__)
            ):
                raise InputError(f"{key}: expected cx, cz, n, and if needed cy and scale, got {shown(given)}")
            given = Lobe(**given)
        c = (-MAX_COEFFICIENT, MAX_COEFFICIENT)
        lobe = Lobe(
            cx=_three(given.cx, f"{key}.cx", *c),
            cy=_three(given.cx if given.cy is None else given.cy, f"{key}.cy", *c),
            cz=_three(given.cz, f"{key}.cz", *c),
            n=_three(given.n, f"{key}.n", 0.0, MAX_EXPONENT),
            scale=_three(given.scale, f"{key}.scale", 0.0, MAX_COLOR),
        )
        for parts in zip(lobe.cx, lobe.cy, lobe.cz, lobe.n, lobe.scale, strict=True):
            if peak(*parts) > MAX_COLOR:
                raise InputError(f"{key}: expected scale max(|cx|, |cy|, |cz|)^n of at most {MAX_COLOR:g}")
        lobes.append(lobe)
    if len(lobes) > MAX_LOBES:
        raise InputError(f"lobes: expected {expected}, got {len(lobes)}")
    return tuple(lobes)


def peak(cx: float, cy: float, cz: float, n: float, scale: float) -> float:
    """The scale of a lobe whose coefficients are divided by the largest of them: inf if it overflows."""
    try:
        return scale * max(abs(cx), abs(cy), abs(cz)) ** n
    except OverflowError:
        return float("inf")


def _measured(value: Any, name: str) -> Measured:
    from raytracer.merl import Measured, read

    if isinstance(value, Measured):
        return value
    if not isinstance(value, str | os.PathLike):
        raise InputError(f"{name}: expected the name of a .binary file, or a Measured, got {shown(value)}")
    try:
        return read(value)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
