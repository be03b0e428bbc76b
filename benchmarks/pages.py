"""Parts of the pages that benchmarks write: the description of the machine, and tables between markers."""

import datetime
import os
import platform
import re
from importlib.metadata import version
from pathlib import Path

from benchmarks import povray
from raytracer.gpu.device import Device
from raytracer.version import __version__


def machine_lines(device: Device) -> str:
    """List the processor, the driver, all versions and the date in Markdown, because times depend on them."""
    info = device.context.info
    lines = {
        "processor": f"{_processor()}, {os.cpu_count()} cores, {platform.machine()}",
        "driver": f"{info['GL_RENDERER']}, {info['GL_VERSION']}",
        "raytracer": __version__,
        "moderngl, NumPy, Python": f"{version('moderngl')}, {version('numpy')}, {platform.python_version()}",
        "POV-Ray": povray.version() or "not installed: rows against it are left out",
        "date": datetime.date.today().isoformat(),
    }
    return "\n".join(f"- {key}: {value}" for key, value in lines.items())


def _processor() -> str:
    try:
        match = re.search(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        match = None
    return match[1] if match else platform.processor() or "unknown"


def fill(page: Path, name: str, text: str) -> None:
    """Replace the text between the markers of this name in an existing page."""
    markers = f"<!-- {name} -->", f"<!-- end of {name} -->"
    filled, count = re.subn(
        f"{markers[0]}.*?{markers[1]}",
        lambda _: f"{markers[0]}\n{text}\n{markers[1]}",
        page.read_text(),
        flags=re.DOTALL,
    )
    assert count == 1, f"{page}: expected one pair of markers for {name}, got {count}"
    page.write_text(filled)
