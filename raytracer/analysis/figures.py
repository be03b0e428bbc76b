"""Figures by matplotlib: their file formats, their axes, and one colour and one marker for each sample sequence.

All plots of the project use the styles of this module, so that a sequence looks the same in each.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from raytracer.core.output import Writer, write_atomically
from raytracer.core.suggest import missing_extra
from raytracer.core.validation import InputError
from raytracer.scene.sequences import SampleSequence
from raytracer.version import __version__

# The formats of figure files, by suffix: pixels, and two vector formats.
SUFFIXES = (".png", ".svg", ".pdf")
# Dots per inch of a .png: a figure 9 inches wide has 1350 pixels, which fill most of a projector's 1920.
DOTS_PER_INCH = 150
# Text stays text in vector files: searchable, and editable for a slide. The salt makes files of equal plots equal.
_VECTOR_OPTIONS: Any = {"svg.fonttype": "none", "svg.hashsalt": "raytracer", "pdf.fonttype": 42}
# Decades of a logarithmic axis that has labels at 1, 2 and 5; longer axes have labels at powers of 10 only.
_LABELLED_DECADES = 3.0


class Style(NamedTuple):
    """The look of a series of points: a colour, a marker, and whether the marker is filled."""

    color: str
    marker: str
    filled: bool = True

    @property
    def options(self) -> dict[str, Any]:
        """Keyword arguments of matplotlib's `plot`."""
        edges = {"mfc": self.color, "mec": "white", "mew": 0.5} if self.filled else {"mfc": "none", "mew": 1.2}
        return {"color": self.color, "marker": self.marker, **edges}


# Colours of Okabe and Ito (2008), which colour-blind readers can tell apart; markers tell the series apart in print.
SEQUENCE_STYLES: dict[SampleSequence, Style] = {
    "sobol": Style("#0072b2", "o"),
    "r2": Style("#009e73", "s"),
    "random": Style("#d55e00", "X"),
    "grid": Style("#000000", "D"),
    "rotated": Style("#e69f00", "^"),
    "corners": Style("#cc79a7", "v"),
}
# Techniques other than a sequence with a fixed number of samples: stars and open grey markers.
TECHNIQUE_STYLES: dict[str, Style] = {
    "adaptive samples": Style("#56b4e9", "P"),
    "error limit": Style("#882255", "*"),
    "with error estimate": Style("#555555", "o", filled=False),
    "other resolution": Style("#555555", "D", filled=False),
    "other precision or evaluator": Style("#555555", "s", filled=False),
}
# Curves that belong to no sequence, such as angles of incidence: a colour, a marker and a line style for each.
CURVE_STYLES = (
    ("#0072b2", "o", "-"),
    ("#009e73", "s", "--"),
    ("#e69f00", "^", "-."),
    ("#cc79a7", "D", (0, (1, 1))),
)


def require_matplotlib() -> None:
    """Raise InputError if matplotlib is not installed."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError:
        raise InputError(missing_extra("plots need", "matplotlib", "plots")) from None


def new_figure(width: float, height: float, layout: Any = "constrained") -> Any:
    """Return an empty figure of this size in inches. It needs no display. Raises InputError without matplotlib."""
    require_matplotlib()
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout=layout)


def save_figure(figure: Any, path: Path, title: str, write: Writer = write_atomically) -> None:
    """Write a figure in the format of the path's suffix, whole or not at all. Files of equal figures are equal."""
    form = path.suffix.lower()[1:]
    with write(path) as file:
        _save(figure, file, form, printable(title))


def svg_text(figure: Any, title: str) -> str:
    """Return a figure as the text of an .svg file."""
    file = io.BytesIO()
    _save(figure, file, "svg", printable(title))
    return file.getvalue().decode()


def inline_svg(svg: str) -> str:
    """Return the text of an .svg file as an element of an HTML page, without names that several plots would share."""
    element = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    return re.sub(r'<g id="[^"]*"', "<g", element.replace(' xmlns="http://www.w3.org/2000/svg"', "", 1))


def _save(figure: Any, file: Any, form: str, title: str) -> None:
    from matplotlib import rc_context

    software = f"raytracer {__version__}"
    metadata = {
        "png": {"Title": title, "Software": software},
        "svg": {"Title": title, "Creator": software, "Date": None},
        "pdf": {"Title": title, "Creator": software, "CreationDate": None},
    }[form]
    with rc_context(_VECTOR_OPTIONS), warnings.catch_warnings():
        # A name may have letters that the font lacks: they are shown as boxes.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(file, format=form, dpi=figure.get_dpi(), metadata=metadata)


def printable(text: str) -> str:
    """Replace characters that no file format can show, such as control characters in a file's name."""
    return "".join(letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in text)


def set_text(artist: Any, text: str) -> None:
    """Set the text of a label to a user's text, in which `$` begins no formula."""
    artist.set_parse_math(False)
    artist.set_text(printable(text))


def label_samples(axis: Any, counts: Sequence[float]) -> None:
    """Make an axis logarithmic, with ticks at the numbers of samples that were taken and nowhere else."""
    from matplotlib.ticker import FixedLocator, NullLocator

    _set_scale(axis, base=2)
    axis.set_major_locator(FixedLocator(sorted({*counts})))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter("{x:g}")


def label_logarithm(axis: Any) -> None:
    """Make an axis logarithmic, with plain numbers such as 0.001 as labels."""
    from matplotlib.ticker import LogLocator, NullFormatter

    _set_scale(axis)
    low, high = axis.get_view_interval()
    is_short = low > 0.0 and math.log10(high / low) <= _LABELLED_DECADES
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if is_short else (1.0,), numticks=20))
    axis.set_major_formatter(lambda value, _: _plain_number(value))
    axis.set_minor_formatter(NullFormatter())


def _set_scale(axis: Any, **options: Any) -> None:
    """Make an axis logarithmic."""
    set_scale = axis.axes.set_xscale if axis is axis.axes.xaxis else axis.axes.set_yscale
    set_scale("log", **options)


def _plain_number(value: float) -> str:
    """Return a number without an exponent, unless it is very small or large."""
    return f"{value:f}".rstrip("0").rstrip(".") if 1e-6 <= value < 1e6 else f"{value:g}"


def plain_axes(axes: Any) -> None:
    """Give axes a light grid, and no frame at the top and on the right."""
    axes.grid(which="major", color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
