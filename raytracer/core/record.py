"""Frozen structs of which copies with other values are made."""

from __future__ import annotations

from typing import Any, Self, TypeVar

import msgspec

import raytracer
from raytracer.core.shown import shortened
from raytracer.core.suggest import did_you_mean
from raytracer.core.validation import KeyNameError
from raytracer.formats.toml_tables import known

K = TypeVar("K", bound=type)


def made_public(kind: K) -> K:
    """Make a public class of this package an attribute of the package as soon as the class is defined.

    So `eval(repr(x), vars(raytracer))` finds it also where x was unpickled, which asks the package for no name.
    """
    if kind.__name__ in raytracer.__all__ and kind.__module__.startswith("raytracer."):
        setattr(raytracer, kind.__name__, kind)
    return kind


class Record(msgspec.Struct, frozen=True):
    """Frozen fields that are checked when the object is made."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        made_public(cls)

    def replace(self, **changes: Any) -> Self:
        """The same object with other values for some fields, which are checked as when it is made.

        `copy.replace` of Python 3.13 does the same. Raises InputError for a name that is no field.
        """
        for name in changes:
            if name not in self.__struct_fields__:
                raise _unknown_field(name, type(self).__name__, self.__struct_fields__)
        return msgspec.structs.replace(self, **changes)

    __replace__ = replace


def _unknown_field(name: str, owner: str, fields: tuple[str, ...]) -> KeyNameError:
    """The error for a name that is no field of `owner`."""
    hint = f"({known(fields)}){did_you_mean(name, fields)}"
    return KeyNameError(f"unknown field `{shortened(name)}` of {owner} {hint}", name)
