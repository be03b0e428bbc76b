"""CSG expressions of scene files: text in, solid out. Parsed, never evaluated as code.

    expression = name | "(" expression ")" | "~" expression | expression operator expression

The operators bind as in Python, so that a scene file and a script mean the same:
`~` (complement) before `-` (difference) before `&` (intersection) before `|` (union), each of
the last three from left to right.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping

from raytracer.core.suggest import did_you_mean, known
from raytracer.core.validation import InputError
from raytracer.scene.solids import Complement, Difference, Intersection, Solid, Union

# A person's or a program's expression: enough for every primitive that one object may have.
MAX_CHARACTERS = 1_000_000
# Open parentheses and complements at any one place.
MAX_NESTING = 200

_TOKEN = re.compile(r"\s*(?:(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<mark>[()~|&-]))", re.ASCII)
_BINARY: dict[str, tuple[int, Callable[[Solid, Solid], Solid]]] = {
    "|": (1, Union),
    "&": (2, Intersection),
    "-": (3, Difference),
}


def is_name(text: str) -> bool:
    """Whether an expression can name a shape `text`."""
    match = _TOKEN.fullmatch(text)
    return match is not None and match["name"] == text


def parse(text: str, shapes: Mapping[str, Solid], objects: Collection[str] = ()) -> Solid:
    """The solid that `text` describes, with names looked up in `shapes`; `objects` are names that it must not use.

    Raises InputError, with the column, for anything but an expression over known names.
    """
    if len(text) > MAX_CHARACTERS:
        raise InputError(f"expected an expression of at most {MAX_CHARACTERS} characters, got {len(text)}")

    # Dijkstra's shunting yard: no recursion, so no text can exhaust the stack.
    solids: list[Solid] = []
    operators: list[str] = []
    nesting = 0

    def reduce() -> None:
        operator = operators.pop()
        b = solids.pop()
        solids.append(Complement(b) if operator == "~" else _BINARY[operator][1](solids.pop(), b))

    operand_next = True  # whether a name, "(" or "~" must come next, or else an operator or ")"
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
            if token not in shapes:
                raise InputError(f'expected the name of a shape, got "{_cut(token)}"{_hint(token, shapes, objects)}')
            solids.append(shapes[token])
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
        # A complement belongs to the operand just finished.
        while not operand_next and operators and operators[-1] == "~":
            reduce()
            nesting -= 1
    if operand_next:
        raise _error(text, end, 'a name, "(" or "~"')
    while operators:
        if operators[-1] == "(":
            raise _error(text, end, 'a ")"')
        reduce()
    return solids[0]


def _hint(name: str, shapes: Mapping[str, Solid], objects: Collection[str]) -> str:
    if name in objects:
        return " (an object; only shapes can be named)"
    return f" ({known(shapes)}){did_you_mean(name, shapes)}"


def _error(text: str, position: int, expected: str) -> InputError:
    got = repr(_cut(text[position:])) if position < len(text.rstrip()) else "the end"
    return InputError(f"column {position + 1}: expected {expected}, got {got}")


def _cut(text: str) -> str:
    return text if len(text) <= 20 else text[:20] + "..."
