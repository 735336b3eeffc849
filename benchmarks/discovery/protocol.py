"""Which cases the benchmark runs: strata of hidden effects, and what counts as right in each."""

from dataclasses import dataclass, replace
from zlib import crc32

from datasets.rig.case import Hidden
from datasets.rig.effects import EFFECTS, STRENGTHS, size
from datasets.rig.noise import KINDS
from datasets.rig.style import DAMPER_COLUMNS, Style

MODEL = {
    "coil": "boucwen-flux",
    "other-coil": "boucwen-flux",
    "damper": "tanh",
    "plain-damper": "regularised-bingham",
}
ABSORBED = {"force-offset": "every force model has an offset of its own"}
PAIRS = (
    ("eddy-current", "resistance-error"),
    ("eddy-current", "saturation"),
    ("resistance-heating", "saturation"),
    ("probe-skew", "resistance-error"),
    ("current-lag", "temperature"),
    ("current-lag", "velocity-hysteresis"),
    ("current-lag", "asymmetry"),
    ("delay", "inertia"),
    ("delay", "stribeck"),
    ("end-stop", "coulomb-friction"),
    ("end-stop", "temperature"),
    ("gas-spring", "asymmetry"),
    ("gas-spring", "inertia"),
    ("quadratic-drag", "temperature"),
    ("residual-magnetism", "inertia"),
)
# What these programmes cannot tell apart, or cannot show at all
UNTELLABLE = (
    ("one-frequency", "delay"),
    ("one-frequency", "velocity-hysteresis"),
    ("one-frequency", "inertia"),
    ("one-frequency", "temperature"),
    ("constant-current", "current-lag"),
    ("one-frequency", "resistance-error"),
    ("narrow-band", "eddy-current"),
    ("narrow-band", "probe-skew"),
)
TWINS = (("coil", "eddy-current"), ("coil", ""), ("damper", "current-lag"), ("damper", ""))
REWRITTEN = {
    "units": Style(other_units=True),
    "sign": Style(sign=-1.0),
    "names": Style(renamed=True),
    "rate": Style(stride=2),
    "format": Style(testsuite=True),
}


@dataclass(frozen=True, slots=True)
class Case:
    """One run of the benchmark.

    Attributes
    ----------
    name
        Unique; also the folder's name.
    stratum
        A key of ``STRATA``, or ``absorbed``.
    hidden
        What the bench builds in.
    strength
        Of its effects, one of ``STRENGTHS``, or empty.
    start_factor
        Start parameters are multiplied by this.
    twin
        Name of the case whose verdict this one must repeat.
    """

    name: str
    stratum: str
    hidden: Hidden
    strength: str = ""
    start_factor: float = 1.0
    twin: str = ""

    @property
    def model(self) -> str:
        """Base model to discover from."""
        return MODEL[self.hidden.bench]

    @property
    def inside(self) -> frozenset[str]:
        """The effects built in that have a canonical name."""
        natural = {"saturation"} if self.hidden.bench == "other-coil" else set()
        return frozenset(natural | {EFFECTS[e].canonical for e in self.hidden.effects if EFFECTS[e].canonical})


def case(stratum: str, strength: str, hidden: Hidden, repeat: int) -> Case:
    """Return a case with its name and its own seed, the same whatever other cases are run."""
    what = "+".join(hidden.effects) or f"{hidden.bench}-{hidden.style.noise}"
    name = "_".join(filter(None, (stratum, what, strength, "" if hidden.programme == "rich" else hidden.programme)))
    name = f"{name}_{repeat}"
    style = replace(hidden.style, integrator="integrator-offset" in hidden.effects)
    return Case(name, stratum, replace(hidden, seed=crc32(name.encode()), style=style), strength)


def _effects(names: tuple[str, ...], strength: str) -> Hidden:
    return Hidden(EFFECTS[names[0]].bench, effects={n: size(n, strength) for n in names})


def null(repeats: int) -> list[Case]:
    """Nothing is hidden; three kinds of noise, and start parameters 30 % off."""
    cases = []
    for bench in ("coil", "damper", "plain-damper"):
        for kind in KINDS:
            for k in range(repeats):
                plain = case("null", "", Hidden(bench, style=Style(noise=kind)), k)
                cases.append(replace(plain, start_factor=(1.0, 1.3, 0.7)[k % 3]))
        for k in range(repeats if bench == "coil" else 0):
            integrated = case("null", "", Hidden(bench, style=Style()), 1000 + k)
            cases.append(replace(integrated, hidden=replace(integrated.hidden, style=Style(integrator=True))))
    return cases


def singles(repeats: int) -> list[Case]:
    """Each effect of the library alone, at three strengths, on tests that can show it."""
    return [
        case("absorbed" if name in ABSORBED else "single", strength, _effects((name,), strength), k)
        for name, effect in EFFECTS.items()
        if effect.canonical
        for strength in STRENGTHS
        for k in range(repeats)
    ]


def pairs(repeats: int) -> list[Case]:
    """Two effects at once, both strong enough to be seen."""
    return [
        case("pair", strength, _effects(names, strength), k)
        for names in PAIRS
        for strength in ("visible", "strong")
        for k in range(repeats)
    ]


def untellable(repeats: int) -> list[Case]:
    """Effects on tests that cannot tell them from another, or cannot show them."""
    return [
        case("untellable", "strong", replace(_effects((name,), "strong"), programme=programme), k)
        for programme, name in UNTELLABLE
        for k in range(repeats)
    ]


def outside(repeats: int) -> list[Case]:
    """Effects that no entry of the library describes."""
    return [
        case("outside", strength, _effects((name,), strength), k)
        for name, effect in EFFECTS.items()
        if not effect.canonical
        for strength in ("visible", "strong")
        for k in range(repeats)
    ]


def other_law(repeats: int) -> list[Case]:
    """A coil that saturates and whose hysteresis is no Bouc-Wen law, plain and with an effect."""
    return [
        case("other-law", "strong" if e else "", Hidden("other-coil", effects={n: size(n, "strong") for n in e}), k)
        for e in ((), ("eddy-current",), ("resistance-error",))
        for k in range(repeats)
    ]


def little(repeats: int) -> list[Case]:
    """One log, or two that differ in level only."""
    return [
        case("little", "visible", replace(_effects((name,), "visible"), programme=programme), k)
        for name in ("eddy-current", "saturation", "delay", "inertia")
        for programme in ("one-log", "two-logs")
        for k in range(repeats)
    ]


def missing(repeats: int) -> list[Case]:
    """The channel an effect needs was not recorded."""
    style = Style(columns=tuple(c for c in DAMPER_COLUMNS if c != "Temperature"))
    hidden = replace(_effects(("temperature",), "strong"), style=style)
    return [case("missing", "strong", hidden, k) for k in range(repeats)]


def metamorphic(repeats: int) -> list[Case]:
    """The same test written down in other units, signs, names or at another rate: the verdict must not change."""
    cases = []
    for bench, name in TWINS:
        for k in range(repeats):
            hidden = _effects((name,), "strong") if name else Hidden(bench)
            original = case("metamorphic", "strong" if name else "", hidden, k)
            cases.append(original)
            cases += [
                replace(
                    original,
                    name=f"{original.name}_{how}",
                    hidden=replace(original.hidden, style=style),
                    twin=original.name,
                )
                for how, style in REWRITTEN.items()
                if bench == "damper" or not style.testsuite
            ]
    return cases


STRATA = {
    "null": (null, 8),
    "single": (singles, 3),
    "pair": (pairs, 2),
    "untellable": (untellable, 3),
    "outside": (outside, 3),
    "other-law": (other_law, 3),
    "little": (little, 1),
    "missing": (missing, 3),
    "metamorphic": (metamorphic, 1),
}


def full(scale: float = 1.0) -> list[Case]:
    """Return the whole protocol; ``scale`` multiplies the repeats."""
    return [c for make, repeats in STRATA.values() for c in make(max(1, round(scale * repeats)))]


SMOKE = (
    "null_damper-white_0",
    "single_current-lag_strong_0",
    "single_eddy-current_strong_0",
    "little_delay_visible_one-log_0",
)


def smoke() -> list[Case]:
    """Return four cases that take a few minutes at most: nothing, one effect on either bench, too little data."""
    known = {c.name: c for c in full()}
    return [known[name] for name in SMOKE]
