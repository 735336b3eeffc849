"""Numbers, units and names as text for people: HTML with Unicode, LaTeX with math, sorted as people sort them.

Numbers are first rounded to a plain text such as ``-1.23e-4`` and then dressed, so that page and tables show the same
digits.
"""

import math
import re

from mrfit.io.escapes import visible

SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
GREEK = "alpha beta gamma delta epsilon zeta eta theta kappa lambda mu nu xi rho sigma tau phi chi psi omega".split()
MISSING_NUMBER = "–"
# An error within this factor of the noise floor is the noise's
WITHIN_NOISE = 1.1

_LATEX = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    # at the beginning of a row they would belong to the line break before it
    "[": "{[}",
    "]": "{]}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": "$<$",
    ">": "$>$",
    "|": "$|$",
    "°": r"$^\circ$",
    "·": r"$\cdot$",
    "×": r"$\times$",
    "−": "$-$",
    "–": "--",
    "∞": r"$\infty$",
    "∮": r"$\oint$",
    "∫": r"$\int$",
    "√": r"$\surd$",
    "Ω": r"$\Omega$",
    "π": r"$\pi$",
    "µ": r"$\mu$",
    "²": "$^2$",
    "³": "$^3$",
    "±": r"$\pm$",
    "Δ": r"$\Delta$",
    "“": "``",
    "”": "''",
    "…": r"\dots{}",
    **dict(zip("αβγδεζηθκλμνξρστφχψω", (rf"$\{name}$" for name in GREEK), strict=True)),
}
# Whole numbers up to a million and fractions down to a thousandth are read more easily without a power of ten.
_PLAIN = range(-3, 6)


def significant(value: float | None, digits: int = 3) -> str:
    """Return a number rounded to significant digits as plain text (``0.0123``, ``-1.20e-7``); empty if not finite."""
    if value is None or not math.isfinite(value):
        return ""
    if value == 0:
        return "0"
    exponent = int(f"{value:.{digits - 1}e}".split("e")[1])
    return _fixed(value, exponent, digits)


def with_interval(value: float | None, low: float | None, high: float | None) -> tuple[str, str, str]:
    """Return value, low and high as plain text, to the digit at which half the interval shows two significant ones.

    Four significant digits where there is no interval, or one end of it alone, three each where the interval is wider
    than the value, and up to six where it is a point. An end that is open is empty.
    """
    if value is None or low is None or high is None or not math.isfinite(high - low) or not math.isfinite(value):
        ends = [significant(end, 4) if end is not None and math.isfinite(end) else "" for end in (low, high)]
        return significant(value, 4), ends[0], ends[1]
    half = (high - low) / 2.0
    if half <= 0.0:
        exact = f"{value:.6g}".replace("e-0", "e-").replace("e+0", "e")
        return exact, exact, exact
    if half >= abs(value):
        return significant(value), significant(low), significant(high)
    exponent = int(f"{value:.5e}".split("e")[1])
    digits = min(max(exponent - math.floor(math.log10(half)) + 2, 2), 8)
    return _fixed(value, exponent, digits), _fixed(low, exponent, digits), _fixed(high, exponent, digits)


def _fixed(value: float, exponent: int, digits: int) -> str:
    if exponent in _PLAIN:
        return f"{value:.{max(digits - 1 - exponent, 0)}f}"
    return f"{value / 10.0**exponent:.{digits - 1}f}e{exponent}"


def in_html(text: str) -> str:
    """Return a plain number for the page: true minus sign, power of ten in superscripts, a dash for none."""
    mantissa, _, exponent = text.partition("e")
    power = f"×10{exponent.translate(SUPERSCRIPTS)}" if exponent else ""
    return (mantissa.replace("-", "−") + power) or MISSING_NUMBER


def percent(share: float | None) -> str:
    """Return a share as percent with three significant digits, as in ``1.23 %``."""
    return f"{in_html(significant(None if share is None else 100.0 * share))} %"


def unit_html(unit: str) -> str:
    """Return a unit in pint's spelling as print has it (``m/s²``, ``N·s/m``, ``°C``); empty for a pure number."""
    if unit in ("", "1"):
        return ""
    text = re.sub(r"(?:\*\*|\^)\(?(-?\d+)\)?", lambda m: "" if m[1] == "1" else m[1].translate(SUPERSCRIPTS), unit)
    return text.replace("*", "·").replace("degC", "°C").replace("ohm", "Ω")


def unit_latex(unit: str) -> str:
    """Return a unit in pint's spelling for LaTeX text; empty for a pure number."""
    if unit in ("", "1"):
        return ""
    parts = re.split(r"((?:\*\*|\^)\(?-?[\d.]+\)?|\*|degC|ohm)", unit)
    return "".join(_unit_sign(part) if k % 2 else escape_latex(part) for k, part in enumerate(parts))


def _unit_sign(sign: str) -> str:
    """Return a power, a product, degrees Celsius or ohm for LaTeX."""
    known = {"*": r"\,", "degC": r"$^\circ$C", "ohm": r"$\Omega$", "^1": "", "**1": ""}.get(sign)
    return known if known is not None else f"$^{{{sign.lstrip('*^').strip('()')}}}$"


def escape_latex(text: str) -> str:
    """Return text with LaTeX's special characters and the commonest symbols written as commands."""
    return "".join(_LATEX.get(c, c) for c in visible(text))


def natural(text: str) -> list[tuple[int, float, str]]:
    """Return a sort key that puts ``5Hz`` before ``10Hz``."""
    parts = re.split(r"(\d+(?:\.\d+)?)", text.lower())
    return [(0, float(p), "") if k % 2 else (1, 0.0, p) for k, p in enumerate(parts) if p]
