"""Texts of a figure that cover each other or a curve, from the boxes of the renderer."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

TOUCHING = 0.5
"""Pixels by which boxes may share an edge."""


def collisions(figure: Figure) -> list[str]:
    """Return a line for each pair of texts that overlap, and for each text that lies on a curve or is cut off."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    boxes = [(one.get_text(), one.get_window_extent(renderer)) for one in shown_texts(figure)]
    page = Bbox.from_extents(-TOUCHING, -TOUCHING, figure.bbox.x1 + TOUCHING, figure.bbox.y1 + TOUCHING)
    found = [
        f"'{words}' is cut off" for words, box in boxes if not (page.contains(*box.min) and page.contains(*box.max))
    ]
    for number, (words, box) in enumerate(boxes):
        found += [f"'{words}' on '{other}'" for other, beside in boxes[number + 1 :] if shared(box, beside)]
        found += [f"'{words}' on a curve" for axes in figure.axes if crosses(axes, box)]
    return found


def shown_texts(figure: Figure) -> list[Text]:
    """Return the texts that are drawn: those of ticks within the axes' limits, and all others that are not empty."""
    ticks: set[Text] = set()
    drawn: list[Text] = []
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            ticks |= {one for one in axis.findobj(Text) if one is not axis.label}
            drawn += tick_labels(axis)
    others = [one for one in figure.findobj(Text) if one not in ticks and one.get_visible()]
    return [one for one in {*others, *drawn} if one.get_text().strip()]


def tick_labels(axis: Axis) -> list[Text]:
    low, high = sorted(axis.get_view_interval())
    edge = 1e-6 * (high - low)
    pairs = zip(axis.get_majorticklocs(), axis.get_majorticklabels(), strict=False)
    return [label for place, label in pairs if low - edge <= place <= high + edge]


def shared(first: Bbox, second: Bbox) -> bool:
    both = Bbox.intersection(first, second)
    return both is not None and min(both.width, both.height) > TOUCHING


def crosses(axes: Axes, box: Bbox) -> bool:
    inside = Bbox.intersection(box, axes.bbox)
    if inside is None or min(inside.width, inside.height) <= TOUCHING:
        return False
    for line in axes.lines:
        points = line.get_transform().transform(np.column_stack(line.get_data(orig=False)))
        dense = points
        if line.get_linestyle() != "None" and len(points) > 1:
            steps = np.linspace(0.0, 1.0, 50)[:, None, None]
            dense = (points[:-1] + steps * np.diff(points, axis=0)).reshape(-1, 2)
        within = (dense > inside.min) & (dense < inside.max)
        if bool(np.any(np.all(within, axis=1))):
            return True
    return False
