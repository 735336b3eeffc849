"""A figure that a notebook shows as it is."""

import io

from matplotlib.figure import Figure

from mrfit.report.svg import style

PICTURE_DOTS = 100
"""Dots per inch on a screen."""


class Picture(Figure):
    """A matplotlib figure that IPython shows without ``%matplotlib inline``."""

    def _repr_png_(self) -> bytes:
        written = io.BytesIO()
        with style():
            self.savefig(written, format="png", dpi=PICTURE_DOTS)
        return written.getvalue()
