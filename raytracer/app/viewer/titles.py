"""Text in the title of the window, and hints over its picture."""

from __future__ import annotations

from raytracer.app.viewer.events import State
from raytracer.formats.estimate import Estimate
from raytracer.scene.scene import used_models

HELP = "H: help"


def title(state: State, samples: int, milliseconds: float, estimate: Estimate | None = None) -> str:
    """The window's title: time of a frame, `samples` so far, the picture's error if known, models and shadows."""
    settings = state.settings
    lights = len(state.scene.lights)
    parts = (
        f"{state.scene.name} - {milliseconds:.0f} ms",
        f"{samples} of {settings.samples} sample{'s' * (settings.samples > 1)}",
        f"error {estimate.in_words}" if estimate else "",
        _drawn(state),
        f"light {state.light + 1} of {lights}" if lights > 1 else "",
        "H for help",
    )
    return ", ".join(filter(None, parts))


def compiling(state: State) -> str:
    """The title while the programs of the picture that `state` wants are compiled."""
    return f"compiling {_drawn(state)} ..."


def compiling_title(state: State) -> str:
    """The window's title while programs are compiled."""
    return f"{state.scene.name} - {compiling(state)}, H for help"


def _drawn(state: State) -> str:
    """The kind of picture."""
    settings = state.settings
    if state.show != "picture":
        return f"showing {state.show}"
    shading = settings.shading or " and ".join(used_models(state.scene))
    shadows = "no shadows" if settings.shadows == "off" else f"{settings.shadows} shadows"
    return f"{shading}, {shadows}"
