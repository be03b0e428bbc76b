"""Record: the base class of immutable values, with a method that returns a changed copy."""

from __future__ import annotations

from typing import Any, ForwardRef, Self, TypeVar

import msgspec

from raytracer.core.shown import shorten
from raytracer.core.suggest import did_you_mean, known_names
from raytracer.core.validation import KeyNameError

K = TypeVar("K", bound=type)


def public(kind: K) -> K:
    """Class decorator that sets the class's `__module__` to the package: `raytracer.Sphere`.

    A pickle then does not depend on the submodule that defines the class. Unpickling imports the class as an attribute
    of the package, and then `eval(repr(x), vars(raytracer))` finds it, too. Names in the annotations still refer to
    the defining module, as `inspect.signature` and `help` require.
    """
    module = kind.__module__
    kind.__annotations__ = {
        name: ForwardRef(hint, module=module, is_class=True) if isinstance(hint, str) else hint
        for name, hint in kind.__annotations__.items()
    }
    kind.__module__ = module.partition(".")[0]
    return kind


class Record(msgspec.Struct, frozen=True):
    """An immutable object. Its fields are checked when the object is created."""

    def replace(self, **changes: Any) -> Self:
        """Return a copy with other values for some fields. The new values are checked as in the constructor.

        Python 3.13 offers the same as `copy.replace`. Raises InputError for a wrong value and for an unknown field.
        """
        for name in changes:
            if name not in self.__struct_fields__:
                raise _unknown_field(name, type(self).__name__, self.__struct_fields__)
        return msgspec.structs.replace(self, **changes)

    __replace__ = replace


def _unknown_field(name: str, owner: str, fields: tuple[str, ...]) -> KeyNameError:
    """Return the error for a `name` that is not among the `fields` of the class `owner`."""
    hint = f"({known_names(fields)}){did_you_mean(name, fields)}"
    return KeyNameError(f"unknown field `{shorten(name)}` of {owner} {hint}", name)
