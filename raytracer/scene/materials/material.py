"""Material: a reflectance model from `models.py` and the values of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NoReturn

from raytracer.core.record import public
from raytracer.core.shown import shown
from raytracer.core.suggest import did_you_mean
from raytracer.core.validation import (
    InputError,
    check_choice,
    check_keys,
    check_path,
    check_text,
    direction,
    items,
    number,
    three,
    within,
)
from raytracer.scene.materials.lobe import Lobe
from raytracer.scene.materials.models import MODELS, Parameter

if TYPE_CHECKING:
    from raytracer.scene.materials.merl import Measured

MAX_LOBES = 16


@public
class Material:
    """The reflectance of a surface: a reflectance model and the values of its parameters.

        Material(kd=(0.64, 0.08, 0.08))
        Material("ggx", alpha=0.1, fresnel="conductor")

    `raytracer brdf list` and docs/models.md list the models, and the parameters of each with range, default and unit.
    Parameters are attributes: `material.kd`. A material is immutable. Two materials are equal if their model, name and
    parameters are equal.

    Args:
        model: the reflectance model: "phong", "blinn", "lambert", "minnaert", "phong_normalized", "blinn_normalized",
            "strauss", "lafortune", "oren_nayar", "eon", "torrance_sparrow", "cook_torrance", "ggx", "beckmann",
            "split", "diffuse_microfacet", "he", "mirror" or "merl". Default: "phong".
        name: a label, which does not change the picture. Default: "".
        parameters: parameters of the model, by name. An omitted parameter has the model's default. A colour is three
            numbers, linear RGB, or one number for all three.

    Raises:
        InputError: an unknown model, a parameter that the model lacks, or a value out of range.
    """

    __slots__ = ("_hash", "_values", "model", "name")

    model: str
    name: str
    _values: dict[str, Any]

    def __init__(self, model: str = "phong", *, name: str = "", **parameters: Any) -> None:
        model = check_choice(model, "model", MODELS)
        name = check_text(name, "name")
        known = MODELS[model].parameters
        for key in parameters:
            if key not in known:
                hint = did_you_mean(key, known)
                raise InputError(f"the model {model} has no such parameter (known: {', '.join(known)}){hint}", key)
        values = {
            key: _checked(parameter, parameters[key]) if key in parameters else parameter.default
            for key, parameter in known.items()
        }
        for key, parameter in known.items():
            if not parameter.when or values[parameter.when[0]] == parameter.when[1]:
                continue
            if key in parameters:
                condition = f'{parameter.when[0]} = "{parameter.when[1]}"'
                raise InputError(f"expected only with {condition}, got {values[parameter.when[0]]!r}", key)
            del values[key]
        if missing := [key for key, value in values.items() if value is None]:
            raise InputError(f"missing, the model {model} needs it", missing[0])
        for field, value in (("model", model), ("name", name), ("_values", values)):
            object.__setattr__(self, field, value)
        object.__setattr__(self, "_hash", hash((model, name, *values.values())))

    @property
    def parameters(self) -> Mapping[str, Any]:
        """All parameters of the model by name, including those with their default value."""
        return dict(self._values)

    def get(self, name: str, default: Any = None) -> Any:
        """Return the parameter `name`, or `default` if the model has no such parameter."""
        if not isinstance(name, str):
            raise InputError(f"expected a string, got {shown(name)}", "name")
        return self._values.get(name, default)

    def replace(self, **changes: Any) -> Material:
        """Return a copy with other parameters, another `name` or another `model`. `copy.replace` does the same.

        Parameters that the new model lacks are dropped. So are parameters that belong to a replaced choice only: `f0`,
        if `fresnel` changes from "schlick" to another value. Raises InputError.
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
    """Convert `value` to the type of the parameter. Raises InputError."""
    name, low, high = parameter.name, parameter.low, parameter.high
    match parameter.kind:
        case "number":
            return number(value, name, low, high, f"a number in [{low:g}, {high:g}]")
        case "whole":
            result = number(value, name, low, high, expected := f"a whole number in [{low:g}, {high:g}]")
            if result != int(result):
                raise InputError(f"expected {expected}, got {shown(value)}", name)
            return int(result)
        case "color":
            return three(value, name, low, high)
        case "direction":
            return direction(value, name)
        case "choice":
            return check_choice(value, name, parameter.choices)
        case "lobes":
            with within("lobes"):
                return _lobes(value)
        case "measured":
            return _measured(value, name)


def _lobes(value: Any) -> tuple[Lobe, ...]:
    """Return the lobes, with `cy` filled in. A lobe may also be a dict, as scene files have it. Raises InputError."""
    expected = f"at most {MAX_LOBES} lobes {{ cx, cz, n }}"
    values = items(value, MAX_LOBES)
    if values is None or len(values) > MAX_LOBES:
        raise InputError(f"expected {expected}, got {shown(value) if values is None else 'more'}")
    lobes: list[Lobe] = []
    for i, lobe in enumerate(values):
        with within(i):
            parsed = lobe if isinstance(lobe, Lobe) else _lobe(lobe)
            lobes.append(parsed if parsed.cy else parsed.replace(cy=parsed.cx))
    return tuple(lobes)


def _lobe(table: Any) -> Lobe:
    if not isinstance(table, dict) or not all(isinstance(key, str) for key in table):
        raise InputError(f"expected cx, cz, n, and if needed cy and scale, got {shown(table)}")
    check_keys(table, Lobe.__struct_fields__)
    if {"cx", "cz", "n"} - set(table):
        raise InputError(f"expected cx, cz, n, and if needed cy and scale, got {shown(table)}")
    return Lobe(**table)


def _measured(value: Any, name: str) -> Measured:
    from raytracer.scene.materials.merl import Measured, read

    if isinstance(value, Measured):
        return value
    with within(name):
        return read(check_path(value, ()))
