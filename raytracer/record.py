"""Frozen structs of which copies with other values are made."""

from __future__ import annotations

from typing import Any, Self

import msgspec

from raytracer.checks import InputError


class Record(msgspec.Struct, frozen=True):
    """Frozen fields that are checked when the object is made."""

    def replace(self, **changes: Any) -> Self:
        """The same object with other values for some fields, which are checked as when it is made.

        `copy.replace` of Python 3.13 does the same. Raises InputError for a name that is no field.
        """
        for name in changes:
            if name not in self.__struct_fields__:
                raise unknown_field(name, type(self).__name__, self.__struct_fields__)
        return type(self)(**{name: getattr(self, name) for name in self.__struct_fields__} | changes)

    __replace__ = replace


def unknown_field(name: str, owner: str, fields: tuple[str, ...]) -> InputError:
    """The error for a name that is no field of `owner`."""
    from difflib import get_close_matches  # few sessions need it

    near = get_close_matches(name, fields, n=1) or [field for field in fields if name in field]
    hint = f"did you mean {near[0]}?" if near else f"known: {', '.join(fields)}"
    return InputError(f"{name}: expected a field of {owner} ({hint})")
