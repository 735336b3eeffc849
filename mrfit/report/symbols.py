"""Symbols of parameters as LaTeX: as their SPEC says, else as their name spells them."""

import re
from collections import Counter
from contextlib import suppress

from mrfit.core import registry
from mrfit.core.specs import Param
from mrfit.errors import MrfitError
from mrfit.io.schemas.fit import Fit
from mrfit.report.numbers import GREEK, escape_latex
from mrfit.simulate.current_dependence import base_name

CAPITALS = "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega".split()
LETTER = rf"{'|'.join([*GREEK, *CAPITALS])}|[A-Za-z]"


def typeset(name: str) -> str:
    r"""Return a name as LaTeX math without dollar signs, as ``C_\infty`` and ``g_\mathrm{yield}``.

    A letter, or a Greek one by name, with an index of digits, one letter, ``inf`` or a word; empty for other names.
    """
    match = re.fullmatch(rf"({LETTER})(?:_([A-Za-z0-9]+)|([A-Za-z]?[0-9]*|inf|off))?", name)
    if not match:
        return ""
    letter, index = match[1], match[2] or match[3] or ""
    if len(letter) > 1:
        letter = rf"\{letter}"
    if not index:
        return letter
    if index == "inf":
        return rf"{letter}_\infty"
    return f"{letter}_{{{index}}}" if index.isdigit() or len(index) == 1 else rf"{letter}_\mathrm{{{index}}}"


def symbols_of(fit: Fit) -> dict[str, str]:
    """Return the symbols of a fit's parameters as LaTeX text, by name; those of a current at its levels are one.

    Where an effect has a symbol that another parameter has too, its name stands above it.
    """
    names = [q.name for result in fit.results[:1] for q in result.parameters]
    plain = list(dict.fromkeys(base_name(name) for name in names))
    known = _from_specs(fit.model)
    maths = {name: known.get(name) or typeset(name.rpartition(".")[2]) for name in plain}
    shared = Counter(maths.values())
    for name, math in maths.items():
        effect = name.rpartition(".")[0]
        if effect and shared[math] > 1:
            maths[name] = rf"{math}^\mathrm{{{effect.replace('-', '~')}}}"
    return {name: _text(base_name(name), maths[base_name(name)]) for name in [*names, *plain]}


def derived_symbol(name: str, symbols: dict[str, str]) -> str:
    r"""Return a derived quantity's symbol: ``$f_y^{(2)}$`` for the coefficient of i² of a parameter, else its name."""
    match = re.fullmatch(r"(.+?)(\(.*\))?\.i(\d)", name)
    symbol = symbols.get(match[1], "") if match else ""
    if not match or not symbol.startswith("$"):
        return escape_latex(name)
    place = escape_latex(f" {match[2]}") if match[2] else ""
    return rf"${symbol.strip('$')}^{{({match[3]})}}${place}"


def _text(name: str, math: str) -> str:
    return f"${math}$" if math else escape_latex(name)


def _from_specs(model: str) -> dict[str, str]:
    """Return the symbols that the SPECs of a base model and its effects say, by parameter."""
    found: dict[str, str] = {}
    base, effects = registry.elements(model)
    for part in (base, *effects):
        params: tuple[Param, ...] = ()
        with suppress(MrfitError):  # of a plug-in that is not loaded the names spell symbols as well
            params = (registry.load("effect", part) if part in effects else registry.load("model", part)).SPEC.params
        prefix = f"{part}." if part in effects else ""
        found |= {f"{prefix}{p.name}": p.symbol for p in params if p.symbol}
    return found
