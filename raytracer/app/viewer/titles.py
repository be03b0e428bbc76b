"""Texts of the window's title, and the hint over its first picture."""

from __future__ import annotations

from raytracer.app.viewer.events import State
from raytracer.formats.estimate import Estimate
from raytracer.scene.scene import used_models

HELP = "H: help"


def title(state: State, samples: int, milliseconds: float, estimate: Estimate | None = None) -> str:
    """Return the window's title: time per frame, `samples` drawn, estimated error if any, models and shadows."""
    settings = state.settings
    lights = len(state.scene.lights)
    parts = (
        f"{state.scene.name} - {milliseconds:.0f} ms",
        f"{samples} of {settings.samples} sample{'s' * (settings.samples > 1)}",
        f"error {estimate.in_words}" if estimate else "",
        _describe_picture(state),
        f"light {state.light + 1} of {lights}" if lights > 1 else "",
        "H for help",
    )
    return ", ".join(filter(None, parts))


def compiling_notice(state: State) -> str:
    """Return the notice while the programs for the picture of `state` are compiled."""
    return f"compiling {_describe_picture(state)} ..."


def compiling_title(state: State) -> str:
    """Return the window's title while programs are compiled."""
    return f"{state.scene.name} - {compiling_notice(state)}, H for help"


def _describe_picture(state: State) -> str:
    """Describe the picture: its models and shadows, or the normals, depth or materials shown."""
    settings = state.settings
    if state.show != "picture":
        return f"showing {state.show}"
    shading = settings.shading or " and ".join(used_models(state.scene))
    shadows = "no shadows" if settings.shadows == "off" else f"{settings.shadows} shadows"
    return f"{shading}, {shadows}"
