"""Materials: a reflectance model of `models.py` with values for its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NoReturn

from raytracer.core.record import public
from raytracer.core.shown import format_value
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
    three_numbers,
    within,
)
from raytracer.scene.materials.lobe import Lobe
from raytracer.scene.materials.models import MODELS, Parameter

if TYPE_CHECKING:
    from raytracer.scene.materials.merl import Measured

MAX_LOBES = 16


@public
class Material:
    """The reflectance of a surface: a reflectance model and its parameters.

        Material(kd=(0.64, 0.08, 0.08))
        Material("ggx", alpha=0.1, fresnel="conductor")

    Args:
        model: The reflectance model: "phong", "blinn", "lambert", "minnaert", "phong_normalized", "blinn_normalized",
            "strauss", "lafortune", "oren_nayar", "eon", "torrance_sparrow", "cook_torrance", "ggx", "beckmann",
            "split", "diffuse_microfacet", "he", "mirror" or "merl". docs/models.md has the parameters of each.
            Default: "phong".
        name: A label, which changes no picture.
        parameters: Parameters of the model, each with a default. For a colour (linear RGB), one number stands for three
            equal ones. The default of the ambient factor `ka` is 0.15/0.8 of `kd` in the models "phong" and "blinn",
            and 0 in all others.

    All parameters are attributes. A material is frozen, and equal to another one with equal model, name and values.
    Raises InputError for a parameter that the model does not have, and for a value out of its range.
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
                near = did_you_mean(key, known)
                raise InputError(f"the model {model} has no such parameter (known: {', '.join(known)}){near}", key)
        values = {
            key: _check(parameter, parameters[key]) if key in parameters else parameter.default
            for key, parameter in known.items()
        }
        values |= {key: p.default_among(values) for key, p in known.items() if p.diffuse and key not in parameters}
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
        """All parameters by name, also parameters with their default value."""
        return dict(self._values)

    def get(self, name: str, default: Any = None) -> Any:
        """Return a parameter's value, or `default` if the model has no parameter of this name."""
        if not isinstance(name, str):
            raise InputError(f"expected a string, got {format_value(name)}", "name")
        return self._values.get(name, default)

    def replace(self, **changes: Any) -> Material:
        """Return a copy with other parameters, another name or another model. `copy.replace` does the same.

        The copy leaves out parameters that it cannot have: parameters that a new model lacks, and parameters of a
        former choice, such as `f0` once `fresnel` is not "schlick". A `ka` with its default value follows a new `kd`
        or model.
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
        if self.has_default("ka"):
            kept.pop("ka", None)
        return Material(model, **{"name": self.name, **kept, **changes})

    __replace__ = replace

    def has_default(self, name: str) -> bool:
        """Return whether a parameter has the value that it would have if the caller had not set it.

        Raises InputError if the model has no parameter of this name.
        """
        check_choice(name, "name", MODELS[self.model].parameters)
        return self._values.get(name) == MODELS[self.model].parameters[name].default_among(self._values)

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
        parts = [f"model={self.model!r}"] if self.model != "phong" else []
        parts += [f"{key}={value!r}" for key, value in self._values.items() if not self.has_default(key)]
        parts += [f"name={self.name!r}"] if self.name else []
        return f"Material({', '.join(parts)})"

    def __reduce__(self) -> tuple[Any, ...]:
        return _make, (self.model, self.name, self._values)


def _make(model: str, name: str, values: dict[str, Any]) -> Material:
    return Material(model, name=name, **values)


def _check(parameter: Parameter, value: Any) -> Any:
    """Return `value` in the type of the parameter's kind. Raises InputError for a wrong type or range."""
    name, low, high = parameter.name, parameter.low, parameter.high
    match parameter.kind:
        case "number":
            return number(value, name, low, high, f"a number in [{low:g}, {high:g}]")
        case "whole":
            result = number(value, name, low, high, expected := f"a whole number in [{low:g}, {high:g}]")
            if result != int(result):
                raise InputError(f"expected {expected}, got {format_value(value)}", name)
            return int(result)
        case "color":
            return three_numbers(value, name, low, high)
        case "direction":
            return direction(value, name)
        case "choice":
            return check_choice(value, name, parameter.choices)
        case "lobes":
            with within("lobes"):
                return _lobes(value)
        case "measured":
            return _check_measured(value, name)


def _lobes(value: Any) -> tuple[Lobe, ...]:
    """Return the lobes, each with its own `cy`. A lobe may be a dictionary, as in a scene file."""
    expected = f"at most {MAX_LOBES} lobes {{ cx, cz, n }}"
    values = items(value, MAX_LOBES)
    if values is None or len(values) > MAX_LOBES:
        raise InputError(f"expected {expected}, got {format_value(value) if values is None else 'more'}")
    lobes: list[Lobe] = []
    for i, lobe in enumerate(values):
        with within(i):
            known = lobe if isinstance(lobe, Lobe) else _lobe(lobe)
            lobes.append(known if known.cy else known.replace(cy=known.cx))
    return tuple(lobes)


def _lobe(table: Any) -> Lobe:
    if not isinstance(table, dict) or not all(isinstance(key, str) for key in table):
        raise InputError(f"expected cx, cz, n, and if needed cy and scale, got {format_value(table)}")
    check_keys(table, Lobe.__struct_fields__)
    if {"cx", "cz", "n"} - set(table):
        raise InputError(f"expected cx, cz, n, and if needed cy and scale, got {format_value(table)}")
    return Lobe(**table)


def _check_measured(value: Any, name: str) -> Measured:
    from raytracer.scene.materials.merl import Measured, read

    if isinstance(value, Measured):
        return value
    with within(name):
        return read(check_path(value, ()))
