"""The text of shaders, as a compiler sees it."""

import re

from raytracer.compiler.glsl.preprocessor import Source


def code(source: Source) -> str:
    """Return the text without comments, and without the parts that its `#if` lines exclude."""
    defined: dict[str, str] = {}
    kept: list[str] = []
    taken: list[bool] = []  # whether the condition of each #if around the line holds

    def holds(condition: str) -> bool:
        condition = re.sub(r"defined\((\w+)\)", lambda m: str(m[1] in defined), condition)
        condition = re.sub(r"\b[A-Z]\w*_?\w*\b", lambda m: defined.get(m[0], m[0]), condition)
        condition = condition.replace("&&", " and ").replace("||", " or ").replace("!True", "False")
        return bool(eval(condition.replace("!False", "True"), {}))

    for line in re.sub(r"//.*", "", source.text).splitlines():
        word, _, rest = line.strip().partition(" ")
        if word in ("#if", "#ifdef", "#ifndef"):
            taken.append(holds(rest) if word == "#if" else (rest.strip() in defined) == (word == "#ifdef"))
        elif word == "#else":
            taken[-1] = not taken[-1]
        elif word == "#endif":
            taken.pop()
        elif all(taken) and word == "#define":
            name, _, value = rest.partition(" ")
            defined[name] = value
        elif all(taken) and word != "#line":
            kept.append(line)
    assert not taken
    return "\n".join(kept)
