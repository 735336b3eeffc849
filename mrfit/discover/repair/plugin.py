"""The terms that a law lacks as the source of an effect: fitted, reported and exported as any other."""

from collections.abc import Sequence

from mrfit.core.channels import CONTROL, MOTION
from mrfit.core.specs import Array
from mrfit.discover.formula.plugin import FoundSpec, number
from mrfit.discover.invariance.nuisance import Scales
from mrfit.discover.repair.terms import LawTerm

REPAIR_NAME = "lacking-force"
NEXT = {
    "none": "0.0",
    "lag": "lag_step(state[{k}], {before}, {now}, {reach}, dt)",
    "travel": "state[{k}] + math.expm1(-abs(way) / {reach}) * (state[{k}] - math.copysign(1.0, way))",
    "stop": "max(-1.0, min(1.0, state[{k}] + way / {reach}))",
    "wear": "state[{k}] + abs(way) / {reach}",
}
"""Memory of a term at the end of a step over a way."""


def source(terms: Sequence[LawTerm], theta: Array, scales: Scales, made: str) -> str:
    """Return the source of an effect with a strength for each term, theta over the range of the output ``made``."""
    on_law = any("{L}" in t.operator.expression for t in terms)
    channels = [MOTION[made][1], *([CONTROL] if any(t.level for t in terms) else [])]
    names = [f"f{k + 1}" for k in range(len(terms))]
    text = " + ".join(f"{f}*{t.text(scales)}" for f, t in zip(names, terms, strict=True))
    first = ["output", *channels] if on_law else channels
    ends = {end: _scaled(first, end, scales) for end in ("before", "now")}
    rows = [_next(k, t, scales, ends) for k, t in enumerate(terms)]
    values = [
        f"z{k}" if t.operator.memory == "lag" else t.expression(**ends["now"], z=f"z{k}") for k, t in enumerate(terms)
    ]
    begun = [t.expression(**ends["now"]) if t.operator.memory == "lag" else "0.0" for t in terms]
    made_by = "rows_of" if on_law else "response_of"
    given = ", ".join(f'channels["{c}"]' for c in channels)
    returned = f"now[0] + {_sum(names, values)}" if on_law else _sum(names, values)
    function = (
        ["def shape(output, channels, theta, dt):", '    """Return the changed output (P, N)."""']
        + [f"    return _stepped(output, theta, dt, {given})"]
        if on_law
        else ["def term(channels, theta, dt):", '    """Return the part that is added to the output (P, N)."""']
        + [f"    return _stepped(np.stack([{given}]), theta, dt)"]
    )
    spec = FoundSpec(
        REPAIR_NAME,
        "Terms that the law lacks",
        f"F = F_base + {text}",
        made,
        channels,
        dict(zip(names, theta * scales.span, strict=True)),
        on_law,
        steady=all(t.operator.memory != "wear" for t in terms),
    )
    return "\n".join(
        [
            '"""Terms that the law lacks, found in the data.',
            "",
            f"    F = F_base + {text}",
            '"""',
            "",
            "import math",
            "",
            *([] if on_law else ["import numpy as np", ""]),
            "from mrfit.core.specs import EffectSpec, Param",
            f"from mrfit.kernels.elements import {made_by}",
            *(["from mrfit.kernels.filters import lag_step"] if any(t.operator.memory == "lag" for t in terms) else []),
            "",
            *spec.lines(),
            "",
            "",
            "def rest(now, theta):",
            '    """Return the memories of a device that has stood still."""',
            f"    return ({''.join(f'{b}, ' for b in begun)})",
            "",
            "",
            "def step(state, before, now, theta, dt):",
            '    """Return the force at the end of a step, and the memories."""',
            f"    ({''.join(f'{f}, ' for f in names)}) = theta[1]",
            *_way(terms, first.index(channels[0])),
            *rows,
            f"    return {returned}, ({''.join(f'z{k}, ' for k in range(len(terms)))})",
            "",
            "",
            f"_stepped = {made_by}(SPEC, rest, step)",
            "",
            "",
            *function,
            "",
        ]
    )


def _scaled(inputs: Sequence[str], end: str, scales: Scales) -> dict[str, str]:
    """Return the scaled variables at an end of a step by their letters."""
    sizes = {"output": ("L", scales.span), CONTROL: ("i", scales.control)}
    letters = [(*sizes.get(name, ("v", scales.speed)), k) for k, name in enumerate(inputs)]
    return {"i": "0.0"} | {letter: f"({end}[{k}] / {number(size)})" for letter, size, k in letters}


def _way(terms: Sequence[LawTerm], at: int) -> list[str]:
    moves = any(t.operator.memory in ("travel", "stop", "wear") for t in terms)
    return [f"    way = 0.5 * (before[{at}] + now[{at}]) * dt"] if moves else []


def _next(k: int, term: LawTerm, scales: Scales, ends: dict[str, dict[str, str]]) -> str:
    lags = term.operator.memory == "lag"
    both = {end: term.expression(**names) if lags else "" for end, names in ends.items()}
    return f"    z{k} = {NEXT[term.operator.memory].format(k=k, reach=number(term.reach(scales)), **both)}"


def _sum(names: Sequence[str], values: Sequence[str]) -> str:
    return " + ".join(f"{n} * {v}" for n, v in zip(names, values, strict=True))
