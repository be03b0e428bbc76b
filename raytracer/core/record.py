"""Frozen structs of which copies with other values are made."""

from __future__ import annotations

from typing import Any, ForwardRef, Self, TypeVar

import msgspec

from raytracer.core.shown import shortened
from raytracer.core.suggest import did_you_mean, known
from raytracer.core.validation import KeyNameError

K = TypeVar("K", bound=type)


def public(kind: K) -> K:
    """Name the package itself as the module of a class that is an attribute of the package: `raytracer.Sphere`.

    So a pickle does not depend on where the class is defined. Unpickling asks the package for the class, and then
    `eval(repr(x), vars(raytracer))` finds the class, too. The names in the annotations stay those of the class's own
    module, where `inspect.signature` and `help` look for them.
    """
    module = kind.__module__
    kind.__annotations__ = {
        name: ForwardRef(hint, module=module, is_class=True) if isinstance(hint, str) else hint
        for name, hint in kind.__annotations__.items()
    }
    kind.__module__ = module.partition(".")[0]
    return kind


class Record(msgspec.Struct, frozen=True):
    """Frozen fields that are checked when the object is made."""

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
