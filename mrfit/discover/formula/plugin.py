"""A formula as the source of an effect: a plug-in that is fitted, reported and exported as any other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mrfit.core import registry
from mrfit.core.built_in import own_names
from mrfit.core.channels import unit_of
from mrfit.discover.formula.factors import FACTOR_KINDS, Factor, Term
from mrfit.discover.formula.rows import FormulaRows
from mrfit.discover.formula.standing import Formula
from mrfit.discover.formula.wording import box_of, channel_of, reach, text_of, variables_of
from mrfit.discover.policy import STANDARD
from mrfit.io.schemas.discovery import FormulaRange

NAME = "found-force"
# Names of the scaled variables in the source
SCALED = {"x": "place", "v": "speed", "a": "rate", "i": "level", "T": "warmth", "t": "age", "L": "law_force"}


@dataclass(frozen=True)
class FoundSpec:
    """Declaration of an effect that was found in the data, as its source has it.

    Attributes
    ----------
    name, title, equation
        As the effect has them.
    made, channels
        The output that it changes, and its inputs.
    forces
        Force of each term at full scale that was found, by the name of its strength.
    on_law
        Whether it takes the law's own force.
    steady
        Whether it is the same in every cycle.
    within
        Ranges of its inputs in which it was found.
    """

    name: str
    title: str
    equation: str
    made: str
    channels: list[str]
    forces: Mapping[str, float]
    on_law: bool
    steady: bool
    within: Sequence[FormulaRange] = ()

    def lines(self) -> list[str]:
        """Return the lines of its SPEC; every strength is zero in a device without it."""
        unit = unit_of(self.made)
        return [
            "SPEC = EffectSpec(",
            f'    name="{self.name}",',
            f'    title="{self.title}",',
            f'    equation="{self.equation}",',
            '    reference="found by mrfit discover --formulas",',
            f'    slot="{"output" if self.on_law else "add"}",',
            f'    outputs=("{self.made}",),',
            f"    inputs=({''.join(f'{c!r}, ' for c in self.channels)}),",
            "    params=(",
            *(f"        {_strength(name, force, unit)}," for name, force in self.forces.items()),
            "    ),",
            f"    neutral=({'0.0, ' * len(self.forces)}),",
            f"    aliases={_mistaken_for(self.channels, self.made)!r},",
            '    experiment="tests at amplitudes, speeds and currents between those that it was found on, and "',
            '    "beyond: it must keep its strength in all of them",',
            *([] if self.steady else ["    steady=False,"]),
            *(["    within=(", *map(_range, self.within), "    ),"] if self.within else []),
            ")",
        ]


def source(rows: FormulaRows, formula: Formula) -> str:
    """Return the source of an effect with a strength for each term; variables are held at the edge of the visited.

    A gain of the place is written without its mean over the stroke, which is the law's: a fit leaves it to the base.
    """
    made = rows.setting.records[0].made
    used = [v for v in variables_of(formula) if v != "L"]
    on_law = "L" in variables_of(formula)
    channels = [channel_of(v, made) for v in used]
    strengths = [f"f{k + 1}" for k in range(len(formula.terms))]
    inputs = [*(["L"] if on_law else []), *used]
    added = " + ".join(f"{f} * {_product(rows, t)}" for f, t in zip(strengths, formula.terms, strict=True))
    scaled = [_scaled(rows, v) for v in inputs]
    values = ", ".join(f'channels["{c}"]' for c in channels)
    signature, first = ("output, channels", "output, ") if on_law else ("channels", "")
    function = "shape" if on_law else "term"
    spec = FoundSpec(
        NAME,
        "Force found in the data",
        "F = F_base + " + " + ".join(f"{f}*g{k + 1}" for k, f in enumerate(strengths)),
        made,
        channels,
        dict(zip(strengths, formula.theta * rows.scales["L"].size, strict=True)),
        on_law,
        steady=not set(used) & set("tT"),
        within=box_of(rows, formula),
    )
    lines = [
        '"""Force found in the data; outside what was visited its variables are held at the edge.',
        "",
        "A gain of the place is less its mean, which is the base's.",
        "",
        f"    F = F_base {_signed(text_of(rows, formula))}",
        '"""',
        "",
        "import numpy as np",
        "",
        "from mrfit.core.specs import EffectSpec, Param",
        "from mrfit.kernels.theta import columns",
        "",
        *spec.lines(),
        "",
        "",
        f"def law({', '.join([*inputs, *strengths])}):",
        '    """Return the force of numbers or arrays that broadcast."""',
        *(f"    {line}" for line in scaled),
        f"    return {'L + ' if on_law else ''}{added}",
        "",
        "",
        f"def {function}({signature}, theta, dt):",
        f'    """Return the {"changed output" if on_law else "part that is added to the output"} (P, N)."""',
        f"    return law({first}{values}{', ' if values else ''}*columns(theta))",
        "",
    ]
    return "\n".join(lines)


def _range(own: FormulaRange) -> str:
    return f'        ("{own.channel}", {own.low:.6g}, {own.high:.6g}),'


def _signed(text: str) -> str:
    return text if text.startswith("-") else f"+{text}"


def number(value: float) -> str:
    """Return a number as a source has it."""
    text = repr(float(f"{value:.9g}"))
    return f"({text})" if value < 0.0 else text


def _scaled(rows: FormulaRows, variable: str) -> str:
    scale = rows.scales[variable]
    if variable == "L":
        return f"{SCALED['L']} = L / {number(scale.size)}"
    low, high = (number(end) for end in reach(rows, variable))
    inside = f"({variable} - {number(scale.origin)}) / {number(scale.size)}"
    return f"{SCALED[variable]} = np.clip({inside}, {low}, {high})"


def _product(rows: FormulaRows, term: Term) -> str:
    gauge = rows.gauge(term)
    return " * ".join(_expression(f, gauge if f is term.gain else 0.0) for f in term.factors)


def _expression(f: Factor, mean: float) -> str:
    text = FACTOR_KINDS[f.kind].expression.format(*(number(c) for c in f.constants), u=SCALED[f.variable])
    return f"({text} - {number(mean)})" if mean else f"({text})"


def _strength(name: str, force: float, unit: str) -> str:
    """Return the parameter of a term, ``f1``, as a source has it, of the force that was found."""
    bound = number(max(STANDARD.formula_bound * abs(force), STANDARD.formula_least_bound)).strip("()")
    text = f"force of term {name[1:]} at full scale, found {force:.6g}"
    return f'Param("{name}", "{unit}", -{bound}, {bound}, 0.0, text="{text}")'


def _mistaken_for(channels: list[str], made: str) -> tuple[str, ...]:
    """Return effects that add to the output what the same channels make: a formula may be mistaken for them."""
    specs = [registry.load("effect", n).SPEC for n in own_names("effect")]
    able = [s for s in specs if made in s.outputs]
    alike = [s.name for s in able if s.slot == "add" and set(s.inputs) <= set(channels)]
    return tuple(alike or [s.name for s in able])[: STANDARD.formula_told]
