"""Figures in a notebook."""

import io

import matplotlib.image

from mrfit.report.figures import canvas_of


def test_a_figure_is_shown_as_it_is() -> None:
    canvas = canvas_of(4.0, 3.0)
    canvas.subplots().plot([0.0, 1.0], [0.0, 1.0], color="#ff0000")
    written = canvas._repr_png_()  # type: ignore[attr-defined]
    assert written.startswith(b"\x89PNG")
    pixels = matplotlib.image.imread(io.BytesIO(written))
    assert pixels.shape[:2] == (300, 400)
    red = (pixels[..., 0] > 0.9) & (pixels[..., 1] < 0.1)
    assert red.sum() > 100
