"""Names of conditions and fits as figures print them: the parts in which they differ, values apart from units."""

import re
from collections.abc import Sequence
from itertools import zip_longest

_VALUE = re.compile(r"(-?\d+(?:\.\d+)?(?:e-?\d+)?)([A-Za-zµ°Ω].*)")


def differing_parts(names: Sequence[str], separator: str) -> dict[str, str]:
    """Return each name without the parts that all names share: ``sine-5Hz-2A`` beside ``sine-5Hz-3A`` is ``2 A``.

    Parameters
    ----------
    names
        Names of conditions or fits, each once.
    separator
        ``-`` between parts of a condition, ``.`` between those of a fit.

    Returns
    -------
    dict of str
        Empty text for a name that is alone; the whole name of a condition where the numbers of parts differ.
    """
    # the sign of a negative value, or of an exponent, separates nothing
    split = {name: re.split(rf"(?<!-)(?<!\de){re.escape(separator)}", name) for name in names}
    if len(split) == 1:
        return dict.fromkeys(names, "")
    if len({len(parts) for parts in split.values()}) > 1 and separator == "-":
        return {name: name for name in names}
    kept = [k for k, column in enumerate(zip_longest(*split.values())) if len(set(column)) > 1]
    return {name: ", ".join(spaced(p[k]) for k in kept if k < len(p)) or name for name, p in split.items()}


def spaced(part: str) -> str:
    """Return a value with a space before its unit, at which no line breaks: ``0.25A`` is ``0.25 A``."""
    match = _VALUE.fullmatch(part)
    return f"{match[1]}\u00a0{match[2]}" if match else part
