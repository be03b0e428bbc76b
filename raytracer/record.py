"""Frozen structs of which copies with other values are made."""

from __future__ import annotations

from typing import Any, Self

import msgspec

from raytracer.checks import UnknownKeyError
from raytracer.shown import shortened
from raytracer.suggest import did_you_mean
from raytracer.toml_table import known


class Record(msgspec.Struct, frozen=True):
    """Frozen fields that are checked when the object is made."""

    def replace(self, **changes: Any) -> Self:
        """The same object with other values for some fields, which are checked as when it is made.

        `copy.replace` of Python 3.13 does the same. Raises InputError for a name that is no field.
        """
        for name in changes:
            if name not in self.__struct_fields__:
                raise _unknown_field(name, type(self).__name__, self.__struct_fields__)
        return type(self)(**{name: getattr(self, name) for name in self.__struct_fields__} | changes)

    __replace__ = replace


def _unknown_field(name: str, owner: str, fields: tuple[str, ...]) -> UnknownKeyError:
    """The error for a name that is no field of `owner`."""
    hint = f"({known(fields)}){did_you_mean(name, fields)}"
    return UnknownKeyError(f"unknown field `{shortened(name)}` of {owner} {hint}", name)
