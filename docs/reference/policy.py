"""The table of a discovery's thresholds, of the fields of its policy and the comments before them."""

import inspect
import re

from docs.reference.markdown import plain, table
from mrfit.discover.policy import STANDARD, Policy


def page() -> str:
    """Return the table; thresholds of one comment share its meaning."""
    rows, meaning = [], []
    fresh = True
    for line in inspect.getsource(Policy).split("\n"):
        if comment := re.match(r"    # (?!---)(.*)", line):
            meaning = [comment[1]] if fresh else [*meaning, comment[1]]
            fresh = False
        elif field := re.match(r"    (\w+): \w+ = ", line):
            rows.append([f"`{field[1]}`", f"{getattr(STANDARD, field[1]):g}", plain(" ".join(meaning))])
            fresh = True
    return table(("threshold", "value", "meaning"), rows) + "\n"
