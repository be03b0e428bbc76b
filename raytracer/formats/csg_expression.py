"""Parser of the CSG expressions in scene files. The text is never evaluated as code.

    expression = name | "(" expression ")" | "~" expression | expression operator expression

The operators have Python's precedence, so that an expression means the same in a scene file and in a script: `~`
(complement) binds tightest, then `-` (difference), `&` (intersection) and `|` (union). The binary operators are
left-associative.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from typing import Any

from raytracer.core.shown import format_value
from raytracer.core.suggest import did_you_mean, known_names
from raytracer.core.validation import InputError, Key, Keys
from raytracer.scene.solids.solid import Complement, Difference, Intersection, Solid, Union

# The most characters of an expression: enough for as many primitives as one object may have.
MAX_CHARACTERS = 1_000_000
# The most parentheses and complements that are open at the same time.
MAX_NESTING = 200

_TOKEN = re.compile(r"\s*(?:(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<mark>[()~|&-]))", re.ASCII)
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)
_BINARY: dict[str, tuple[int, Callable[[Solid, Solid], Solid]]] = {
    "|": (1, Union),
    "&": (2, Intersection),
    "-": (3, Difference),
}


def is_name(text: str) -> bool:
    """Whether `text` can be the name of a shape or a part in an expression."""
    return _NAME.fullmatch(text) is not None


def list_names(text: str) -> set[str]:
    """Return all names in an expression. It may be wrong, and the names need not exist."""
    return set(_NAME.findall(text))


def check_text(value: Any, key: Key | Keys = ()) -> str:
    """Return `value` if it is a text. Raises InputError."""
    if not isinstance(value, str):
        raise InputError(f"expected a string, an expression over shapes and parts, got {format_value(value)}", key)
    return value


def parse(text: str, solids: Mapping[str, Solid], objects: Collection[str] = ()) -> Solid:
    """Parse an expression and return its solid.

    Args:
        text: the expression.
        solids: the shapes and parts that it may use, by name.
        objects: names of objects, which no expression can use, for a better error message. Default: none.

    Raises:
        InputError: a wrong expression, with the column, or an unknown name.
    """
    if len(text) > MAX_CHARACTERS:
        raise InputError(f"expected an expression of at most {MAX_CHARACTERS} characters, got {len(text)}")

    # Dijkstra's shunting-yard algorithm does not recurse, so no text can exhaust Python's stack.
    operands: list[Solid] = []
    operators: list[str] = []
    nesting = 0

    def reduce() -> None:
        operator = operators.pop()
        b = operands.pop()
        operands.append(Complement(b) if operator == "~" else _BINARY[operator][1](operands.pop(), b))

    operand_next = True  # True: a name, "(" or "~" must come next. False: an operator or ")".
    position = 0
    end = len(text.rstrip())
    while position < end:
        match = _TOKEN.match(text, position)
        if not match:
            position += len(text[position:]) - len(text[position:].lstrip())
            raise _error(text, position, "a name or one of ( ) ~ | & -")
        position = match.end()
        token = match["name"] or match["mark"]
        if (token in "(~" or match["name"] is not None) != operand_next:
            expected = 'a name, "(" or "~"' if operand_next else 'an operator or ")"'
            raise _error(text, match.start(match.lastgroup or 0), expected)
        if match["name"]:
            if token not in solids:
                hint = _hint(token, solids, objects)
                raise InputError(f'expected the name of a shape or a part, got "{_cut(token)}"{hint}')
            operands.append(solids[token])
            operand_next = False
        elif token in "(~":
            nesting += 1
            if nesting > MAX_NESTING:
                raise _error(text, position - 1, f"at most {MAX_NESTING} nested parentheses and complements")
            operators.append(token)
            continue
        elif token == ")":
            while operators and operators[-1] != "(":
                reduce()
            if not operators:
                raise _error(text, position - 1, 'a "(" before this ")"')
            operators.pop()
            nesting -= 1
        else:
            while operators and operators[-1] in _BINARY and _BINARY[operators[-1]][0] >= _BINARY[token][0]:
                reduce()
            operators.append(token)
            operand_next = True
        # Complements before an operand apply as soon as the operand is complete.
        while not operand_next and operators and operators[-1] == "~":
            reduce()
            nesting -= 1
    if operand_next:
        raise _error(text, end, 'a name, "(" or "~"')
    while operators:
        if operators[-1] == "(":
            raise _error(text, end, 'a ")"')
        reduce()
    return operands[0]


def _hint(name: str, solids: Mapping[str, Solid], objects: Collection[str]) -> str:
    if name in objects:
        return " (an object; only shapes and parts can be named)"
    return f" ({known_names(solids)}){did_you_mean(name, solids)}"


def _error(text: str, position: int, expected: str) -> InputError:
    got = repr(_cut(text[position:])) if position < len(text.rstrip()) else "the end"
    return InputError(f"column {position + 1}: expected {expected}, got {got}")


def _cut(text: str) -> str:
    return text if len(text) <= 20 else text[:20] + "..."
