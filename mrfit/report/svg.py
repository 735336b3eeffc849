"""matplotlib figures as small SVG files that are the same bytes every time, and as parts of a page."""

import io
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from mrfit.io.escapes import visible_in_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure

    Canvas = Figure
else:
    # annotations name them, and importing matplotlib takes long
    Axes = Canvas = Any

SVG_STYLE: dict[Any, Any] = {
    "svg.hashsalt": "mrfit",
    # Text stays text: it can be searched, read aloud and restyled, and files are a third of the size
    "svg.fonttype": "none",
    "font.family": ["sans-serif"],
    "font.size": 9.0,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#64748b",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": False,
    "grid.color": "#e2e8f0",
    "grid.linewidth": 0.6,
    "xtick.color": "#334155",
    "ytick.color": "#334155",
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "path.simplify_threshold": 0.05,
    # A condition's name may hold a dollar sign
    "text.parse_math": False,
}


THEME = {
    "#8a99a8": "measured",
    "#c2410c": "simulated",
    "#94a3b8": "quiet",
    "#1d4ed8": "held",
    "#0f766e": "teal",
    "#a16207": "ochre",
    "#7e22ce": "violet",
    "#475569": "slate",
    "#64748b": "axis",
    "#334155": "dark",
    "#e2e8f0": "grid",
    "#cbd5e1": "rule",
    "#fde68a": "band",
    "#ffffff": "paper",
}
"""Colours of figures -> the variable of a page's style that takes their place, so that they turn dark with it."""


def import_matplotlib() -> None:
    """Import matplotlib whatever MPLBACKEND says: figures are made without windows, and a wrong name would end it."""
    chosen = os.environ.pop("MPLBACKEND", None)
    try:
        import matplotlib  # noqa: F401
    finally:
        if chosen is not None:
            os.environ["MPLBACKEND"] = chosen


@contextmanager
def style() -> Iterator[None]:
    """Draw under mrfit's own style, whatever the user's matplotlibrc says, and put that back afterwards."""
    import_matplotlib()
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(SVG_STYLE)
        yield


def to_svg(figure: "Figure", title: str) -> str:
    """Return a figure drawn under ``style`` as an SVG document: no date, fixed ids, coordinates to 0.01 point.

    Parameters
    ----------
    figure
        The figure.
    title
        Title in the file's metadata.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    FigureCanvasSVG(figure)
    layout = figure.get_layout_engine()
    if layout is not None:
        # savefig would draw everything once more for it
        layout.execute(figure)
        figure.set_layout_engine(None)
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Title": title, "Creator": "mrfit", "Date": None})
    shorter = re.sub(r' d="([^"]*)"', lambda m: f' d="{_rounded(m[1])}"', text.getvalue())
    return "\n".join(line.rstrip() for line in visible_in_page(shorter).splitlines()) + "\n"


def _rounded(path: str) -> str:
    return re.sub(r"-?\d+\.\d+", lambda m: f"{float(m[0]):.2f}".rstrip("0").rstrip("."), path)


def inline(svg: str, prefix: str, alt: str) -> str:
    """Return an SVG document as an element of a page: ids made unique by a prefix, the page's colours, a spoken title.

    Parameters
    ----------
    svg
        Text of an SVG document.
    prefix
        Letters and digits, unique on the page.
    alt
        What the figure shows, free of markup.
    """
    body = svg[svg.index("<svg") :]
    body = re.sub(r"\s*<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r"\s*<title>.*?</title>", "", body, count=1, flags=re.DOTALL)
    body = re.sub(r' xmlns(?::xlink)?="[^"]*"', "", body)
    body = re.sub(r'\bid="([^"]+)"', rf'id="{prefix}-\1"', body)
    body = re.sub(r'href="#([^"]+)"', rf'href="#{prefix}-\1"', body)
    body = re.sub(r"url\(#([^)]+)\)", rf"url(#{prefix}-\1)", body)
    body = re.sub(r' style="([^"]*)"', _themed, body)
    return re.sub(r"<svg ", f'<svg role="img" aria-label="{_attribute(alt)}" ', body, count=1)


def _themed(style: re.Match[str]) -> str:
    """Return a style with the page's variables for its colours."""
    text = re.sub("#[0-9a-f]{6}", lambda m: f"var(--{THEME[m[0]]})" if m[0] in THEME else m[0], style[1])
    return f' style="{text}"'


def _attribute(text: str) -> str:
    return text.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
