"""Description of the machine of a measurement, for the head of a table."""

from __future__ import annotations

import os
import platform
import time
from importlib.metadata import version

import numpy as np

from raytracer.rendering.renderer import Renderer
from raytracer.version import __version__


def describe_machine(renderer: Renderer) -> dict[str, str]:
    """Return the driver, the processor, the versions and the date, on which measured times depend."""
    info = renderer.device.context.info
    return {
        "device": f"{info['GL_RENDERER']}, {info['GL_VERSION']}",
        "processor": f"{os.cpu_count()} cores, {platform.machine()}",
        "raytracer": __version__,
        "moderngl, NumPy, Python": f"{version('moderngl')}, {np.__version__}, {platform.python_version()}",
        "date": time.strftime("%Y-%m-%d"),
    }
