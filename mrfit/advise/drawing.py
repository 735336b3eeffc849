"""The rivals' predicted loops on a test, and how far they are apart, as one figure."""

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mrfit.advise.drives import Test
from mrfit.advise.separation import RivalSet
from mrfit.advise.specimen import rows_of
from mrfit.core.channels import symbol_of, unit_of
from mrfit.core.specs import Array
from mrfit.report.figures import LOOPS, PALETTE, axis_label, canvas_of
from mrfit.report.paper import DASHES
from mrfit.report.svg import Axes, style, to_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOPS_WIDTH, HEIGHT, PNG_DOTS = 10.0, 4.6, 120
LOOP_POINTS = 3000


@dataclass(frozen=True)
class Loops:
    """The figure as SVG and as PNG."""

    svg: str
    png: bytes


@dataclass(frozen=True)
class _DrawnCurve:
    name: str
    across: Array
    output: Array


def loops(contest: RivalSet, test: Test, text: str) -> Loops:
    """Return the figure of the rivals' outputs on a test: loops, and differences from the first over time."""
    output = contest.standings[0].assembly.spec.output
    curves, across = _curves(contest, test, LOOPS.get(output, ("",))[0])
    with style():
        canvas = canvas_of(LOOPS_WIDTH, HEIGHT)
        loop, apart = canvas.subplots(1, 2)
        _draw(loop, curves)
        loop.set(xlabel=_label(across), ylabel=_label(output), title="predicted loops")
        _draw_apart(apart, curves, test.time, contest.noise)
        apart.set(xlabel=axis_label("t", "s", "Time"), ylabel=_label(output, f"difference of {output}"))
        apart.set_title(f"beside {curves[0].name}")
        canvas.legend(*loop.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        canvas.suptitle(text)
        return Loops(*_saved(canvas, text))


def _saved(canvas: "Figure", text: str) -> tuple[str, bytes]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(canvas)
    image = io.BytesIO()
    canvas.savefig(image, format="png", dpi=PNG_DOTS, metadata={"Software": None})
    return to_svg(canvas, text), image.getvalue()


def _label(name: str, what: str = "") -> str:
    return axis_label(symbol_of(name), unit_of(name), what or name)


def _curves(contest: RivalSet, test: Test, wanted: str) -> tuple[list[_DrawnCurve], str]:
    channels = contest.specimen.driven(test)
    across = wanted if wanted in channels else contest.specimen.channels.motion
    curves = []
    for standing, drawn in zip(contest.standings, contest.draws, strict=True):
        point = _typical(drawn, standing.point) if standing.rival.hidden else standing.point
        theta = standing.cube.to_theta(point[None, :])
        output = standing.assembly.simulate(rows_of(channels, standing.assembly), theta, test.dt)[0]
        curves.append(_DrawnCurve(standing.rival.name, channels[across], output))
    return curves, across


def _typical(drawn: Array, point: Array) -> Array:
    """Return the draw whose distance from a point is in the middle: at the point a hidden effect is absent."""
    far = np.linalg.norm(drawn - point, axis=1)
    typical: Array = drawn[np.argsort(far)[len(far) // 2]]
    return typical


def _draw(axes: "Axes", curves: list[_DrawnCurve]) -> None:
    for k, curve in enumerate(curves):
        _plotted(axes, curve.across, curve.output, k, curve.name)


def _plotted(axes: "Axes", across: Array, up: Array, number: int, name: str | None = None) -> None:
    """Draw a curve; more rivals than colours differ in dashes."""
    every, (again, colour) = max(1, len(up) // LOOP_POINTS), divmod(number, len(PALETTE))
    dashes: Any = DASHES[again % len(DASHES)]
    axes.plot(across[::every], up[::every], color=PALETTE[colour], ls=dashes, label=name)


def _draw_apart(axes: "Axes", curves: list[_DrawnCurve], time: Array, noise: float) -> None:
    axes.axhspan(-noise, noise, color="#94a3b8", alpha=0.3, linewidth=0.0)
    for k, curve in enumerate(curves[1:], start=1):
        _plotted(axes, time, curve.output - curves[0].output, k)
