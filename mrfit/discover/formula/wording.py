"""A formula in SI: its text, the intervals of its coefficients, and the box of what was visited."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrfit.core.channels import CONTROL, MOTION, WARMTH, unit_factors, unit_of
from mrfit.core.specs import Array
from mrfit.discover.formula.factors import FACTOR_KINDS, Factor, Term
from mrfit.discover.formula.proposal import Proposal
from mrfit.discover.formula.rows import FormulaRows, Scale
from mrfit.discover.formula.standing import Formula
from mrfit.discover.policy import STANDARD
from mrfit.io.schemas.discovery import (
    EffectParameter,
    FormulaFactor,
    FormulaRange,
    FormulaReading,
    FormulaScale,
    FormulaTerm,
    ProposedFormula,
)


def channel_of(variable: str, made: str) -> str:
    """Return the channel of a variable beside an output; of the law's force the output itself."""
    place, speed, rate = MOTION[made]
    return {"x": place, "v": speed, "a": rate, "i": CONTROL, "T": WARMTH, "t": "time", "L": made}[variable]


def proposed(found: Proposal) -> ProposedFormula:
    """Return the entry of a search: the formula, or why none is proposed."""
    formula, rows, sure, errors = found.formula, found.rows, found.sure, found.held_out
    if found.why or formula is None or rows is None or sure is None:
        return ProposedFormula(reason=found.why)
    made = rows.setting.records[0].made
    shifts = 0.0 if found.shifts is None else STANDARD.formula_shift * found.shifts
    spread = np.hypot(np.hypot(STANDARD.formula_interval * sure.errors, STANDARD.accuracy * formula.theta), shifts)
    rests = of_the_law_at_rest(rows, formula)
    terms = [
        _coefficient(rows, t, k, (float(rest * theta), float(rest * half)), made)
        for k, (t, rest, theta, half) in enumerate(zip(formula.terms, rests, formula.theta, spread, strict=True))
    ]
    readings = tuple({text_of(rows, f): _reading(rows, f) for f in (formula, *found.alike)}.values())
    return ProposedFormula(
        text=readings[0].text,
        coefficients=tuple(terms),
        alike=tuple(r.text for r in readings[1:]),
        law=errors.law if errors else None,
        after=errors.after if errors else None,
        closed=errors.closed if errors else None,
        kept=formula.kept,
        clear=min(sure.clear(formula.theta), STANDARD.largest_score),
        left=1.0 / formula.cancelled,
        box=tuple(box_of(rows, formula)),
        readings=readings,
        scales=tuple(FormulaScale(symbol=n, origin=s.origin, size=s.size) for n, s in rows.scales.items()),
    )


def _reading(rows: FormulaRows, formula: Formula) -> FormulaReading:
    terms = tuple(
        FormulaTerm(
            factors=tuple(FormulaFactor(variable=f.variable, kind=f.kind, constants=f.constants) for f in t.factors),
            coefficient=float(theta),
        )
        for t, theta in zip(formula.terms, formula.theta, strict=True)
    )
    return FormulaReading(text=text_of(rows, formula), terms=terms)


def text_of(rows: FormulaRows, formula: Formula) -> str:
    """Return a formula in SI, without its intervals."""
    made, said = rows.setting.records[0].made, ""
    for term, theta in zip(formula.terms, of_the_law_at_rest(rows, formula) * formula.theta, strict=True):
        written = _written(rows, term, made)
        said += f" {written.scale * theta:+.4g}*{written.text}"
    return said.strip().removeprefix("+")


def of_the_law_at_rest(rows: FormulaRows, formula: Formula) -> Array:
    """Return the factors (K,) on coefficients where gains are written without the means that the search takes off.

    L' (1 + theta (g - m)) = L + theta/(1 - theta m) g L, with L = L' (1 - theta m) the law where the gain g is zero.
    """
    means = [rows.gauge(t) if any(f.variable == "L" for f in t.factors) else 0.0 for t in formula.terms]
    rest = max(1.0 - float(formula.theta @ np.array(means)), STANDARD.formula_least_scale)
    return np.array([1.0 / rest if any(f.variable == "L" for f in t.factors) else 1.0 for t in formula.terms])


def box_of(rows: FormulaRows, formula: Formula) -> list[FormulaRange]:
    """Return the ranges that were visited of a formula's variables, in SI."""
    made, found = rows.setting.records[0].made, []
    for name in variables_of(formula):
        if name != "L":
            scale, ends = rows.scales[name], reach(rows, name)
            low, high = (scale.origin + scale.size * end for end in ends)
            channel = channel_of(name, made)
            found.append(FormulaRange(symbol=name, channel=channel, unit=unit_of(channel) or "s", low=low, high=high))
    return found


def variables_of(formula: Formula) -> list[str]:
    """Return the variables of a formula, in the order of the grammar."""
    used = {f.variable for t in formula.terms for f in t.factors}
    return [v for v in "xvaiTtL" if v in used]


def reach(rows: FormulaRows, variable: str) -> tuple[float, float]:
    """Return the least and the greatest scaled value of a variable in the records."""
    own = [r.measured(s[variable]) for r, s in zip(rows.setting.records, rows.samples, strict=True)]
    return min(float(u.min()) for u in own), max(float(u.max()) for u in own)


@dataclass(frozen=True)
class SiTerm:
    """A term in SI: its text, the unit of its coefficient, and what that is over the scaled one."""

    text: str
    unit: str
    scale: float


def _written(rows: FormulaRows, term: Term, made: str) -> SiTerm:
    scale, powers, texts = rows.scales["L"].size, _powers_of(unit_of(made)), []
    for f in term.factors:
        own = rows.scales[f.variable]
        power = _power(f)
        factor = own.size**power * _inverse(f)
        for base, own_power in _powers_of(unit_of(channel_of(f.variable, made)) or "s").items():
            powers[base] = powers.get(base, 0.0) - power * own_power
        texts.append(_factor(f, own, term.mean_is_lawful(f)))
        scale /= factor
    return SiTerm("*".join(texts), _unit_of(powers), scale)


def _powers_of(unit: str) -> dict[str, float]:
    """Return the power of each unit in a product of units, as ``m/s^2``."""
    found: dict[str, float] = {}
    for sign, name, power in unit_factors(unit):
        found[name] = found.get(name, 0.0) + float(power or 1) * (-1.0 if sign == "/" else 1.0)
    return found


def _unit_of(powers: Mapping[str, float]) -> str:
    """Return a product of powers of units."""

    def product(sign: float) -> list[str]:
        own = {n: round(sign * p, 3) for n, p in powers.items() if sign * p > STANDARD.formula_small}
        return [n if p == 1.0 else f"{n}^{p:g}" for n, p in own.items()]

    return "/".join(["*".join(product(1.0)) or "1", *product(-1.0)])


def _power(f: Factor) -> float:
    power = FACTOR_KINDS[f.kind].power
    return f.constants[0] if power == "first" else power


def _inverse(f: Factor) -> float:
    return float(np.prod(f.constants)) if FACTOR_KINDS[f.kind].inverse else 1.0


def _factor(f: Factor, scale: Scale, varying: bool) -> str:
    kind, size = FACTOR_KINDS[f.kind], scale.size
    constants = [c * size if k in kind.places else c for k, c in enumerate(f.constants)]
    if kind.inverse:
        constants[0] = size / f.constants[0]
    text = (varying and kind.varying) or kind.text
    origin = scale.origin if abs(scale.origin) > STANDARD.formula_small * size else 0.0
    if any(shift in text for shift in ("{u}-{0}", "{0}-{u}")):
        # one place, not the origin and a place from there
        constants[0], origin = constants[0] + origin, 0.0
    variable = f"({f.variable}{-origin:+.4g})" if origin else f.variable
    return text.format(*(f"{c:.4g}" for c in constants), u=variable).replace("--", "+")


def _coefficient(rows: FormulaRows, term: Term, at: int, value: tuple[float, float], made: str) -> EffectParameter:
    """Return the coefficient of a term in SI with its interval, of its scaled value and half interval."""
    written = _written(rows, term, made)
    theta, half = written.scale * value[0], abs(written.scale) * value[1]
    name = f"f{at + 1}: {written.text}"
    return EffectParameter(name=name, unit=written.unit, value=theta, low=theta - half, high=theta + half)
