"""Default laws of current of models that err: ``python -m benchmarks.current_erring COUNT [FIRST] [--out FILE.md]``.

Every planted damper has a hidden effect, or is fitted by a model of another family. Sines at two to five currents are
trained on; the default joint fit is judged at currents between them. Beside it stands the best of all candidates: the
law of the strength of every form and order, the other parameters' laws by role or as planted. It is known from the
held-out data themselves. Both are fitted about the optima of single currents, as the choice does it.
Seeds below 1000 are those the choice was made on.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys  # noqa: E402
from collections.abc import Callable  # noqa: E402
from dataclasses import dataclass, replace  # noqa: E402
from itertools import product  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

import mrfit.fit.stage as stage  # noqa: E402
from mrfit.core.recording import Recording, Segment  # noqa: E402
from mrfit.core.specs import Array  # noqa: E402
from mrfit.fit.identify import Group, build_group  # noqa: E402
from mrfit.fit.laws.by_level import Law, Laws, Posing, drawn_together, tests_about  # noqa: E402
from mrfit.fit.laws.choice import choose  # noqa: E402
from mrfit.fit.laws.laws_of_current import base_cube  # noqa: E402
from mrfit.io.dataset import Dataset  # noqa: E402
from mrfit.search.problem import Posed  # noqa: E402
from mrfit.search.starts import level_fits  # noqa: E402
from mrfit.simulate.assembly import Assembly, assemble  # noqa: E402
from mrfit.simulate.current_dependence import FORMS, LOG, PLAIN, form_of, logarithmic, orders_of  # noqa: E402
from mrfit.simulate.current_dependence import count as count_of  # noqa: E402

SINES = ((0.5, 0.002), (1.0, 0.012), (2.0, 0.008), (4.0, 0.004), (0.5, 0.02))
PER_CYCLE, CYCLES = 200, 4
# Per model: strength, damping, a parameter of either sign and one of shape or stiffness, with the scale of each
MODELS: dict[str, tuple[tuple[str, float], ...]] = {
    "bingham": (("fy", 500.0), ("C_inf", 1000.0), ("f0", 100.0)),
    "tanh": (("fy", 500.0), ("c", 1000.0), ("k", 1e4), ("a1", 60.0)),
    "guo": (("fy", 500.0), ("C_inf", 1000.0), ("Omega", 2.0), ("C0", 60.0)),
    "hysteretic-biviscous": (("fy", 500.0), ("C_inf", 1000.0), ("vh", 0.006), ("C0", 2e4)),
    "regularised-bingham": (("fy", 500.0), ("C_inf", 1000.0), ("f0", 100.0), ("vy", 0.01)),
    "boucwen": (("alpha", 500.0), ("c", 1000.0), ("x0", 0.02), ("k", 1500.0)),
    "spencer": (("alpha", 500.0), ("C_inf", 2000.0), ("K0", 3e3), ("C0", 2e4)),
}
SHARES = (0.17, 0.17, 0.17, 0.17, 0.14, 0.14, 0.04)
Curve = Callable[[float], float]


def law_of(rng: np.random.Generator) -> tuple[str, Curve]:
    """Return the law of a strength over a share of the range of current, with its name."""
    low, rise, bend = rng.uniform(0.1, 0.4), rng.uniform(1.0, 2.2), rng.uniform(0.0, 1.0)
    laws: dict[str, Curve] = {
        "line": lambda u: low + rise * u,
        "parabola": lambda u: low + rise * (u + (0.25 + 0.25 * bend) * u * (1.0 - u)),
        "exponential": lambda u: low * float(np.exp((1.2 + 1.2 * bend) * u)),
        "saturation": lambda u: low + rise * (1.0 - float(np.exp(-u / (0.2 + 0.4 * bend)))),
        "tanh": lambda u: low + rise * float(np.tanh((1.2 + 1.8 * bend) * u)),
        "rational": lambda u: low + rise * u * (1.2 + 0.6 * bend) / (u + 0.2 + 0.6 * bend),
        "power": lambda u: low + rise * u ** (0.6 + bend),
    }
    name = str(rng.choice(list(laws)))
    return name, laws[name]


HIDDEN: dict[str, Callable[[dict[str, Array]], Array]] = {
    "mass": lambda c: c["acceleration"],
    "spring": lambda c: c["displacement"],
    "cubic spring": lambda c: c["displacement"] ** 3,
    "friction": lambda c: np.tanh(c["velocity"] / 1e-3),
    "drag": lambda c: c["velocity"] * np.abs(c["velocity"]),
}


@dataclass(frozen=True)
class Case:
    """Logs of a damper, the model that is fitted, and what was planted."""

    data: Dataset
    model: str
    planted: str
    levels: int
    varying: tuple[str, ...]


def case_of(seed: int) -> Case:
    """Return the logs that a seed plants."""
    rng = np.random.default_rng(seed)
    names = list(MODELS)
    model = str(rng.choice(names, p=SHARES))
    other = str(rng.choice([m for m in names if m not in (model, "spencer")]))
    truth, hidden = (model, str(rng.choice([*HIDDEN, "delay"]))) if rng.random() < 0.6 else (other, "")
    base, parameters = assemble(truth), MODELS[truth]
    name, strength = law_of(rng)
    damping, sign, turn, shape = rng.uniform(0.0, 1.5), *rng.uniform(-1.0, 1.0, 2), rng.uniform(0.3, 1.0)
    moves = [True, rng.random() < 0.75, rng.random() < 0.3, rng.random() < 0.3]
    laws: list[Curve] = [
        strength,
        lambda u: 1.0 + moves[1] * damping * u,
        lambda u: sign + moves[2] * turn * u,
        lambda u: 1.0 + moves[3] * shape * u,
    ]
    levels = int(rng.integers(2, 6))
    top = float(rng.choice([0.8, 1.0, 1.5, 2.0]))
    trained = np.linspace(0.0 if rng.random() < 0.8 else 0.2 * top, top, levels)
    if rng.random() < 0.4:
        trained[1:-1] += rng.uniform(-0.25, 0.25, levels - 2) * (trained[1] - trained[0])
    between = (trained[1:] + trained[:-1]) / 2.0 + rng.uniform(-0.15, 0.15, levels - 1) * np.diff(trained)
    sines = [SINES[k] for k in sorted(rng.choice(len(SINES), int(rng.integers(2, 5)), replace=False))]
    size, noise = np.exp(rng.uniform(np.log(0.01), np.log(0.12))), np.exp(rng.uniform(np.log(1e-3), np.log(6e-3)))
    logs = []
    for current in np.round([*trained, *between], 3):
        theta = dict(zip(base.spec.names, base.spec.start.tolist(), strict=True))
        theta |= {n: s * law(current / top) for (n, s), law in zip(parameters, laws, strict=False)}
        for hertz, amplitude in sines:
            channels, late = (_moved(hertz, amplitude, shift) for shift in (0.0, 0.004 * (hidden == "delay")))
            drive = np.stack([late[n] for n in base.spec.inputs])
            force = base.simulate(drive, np.array([[theta[n] for n in base.spec.names]]), 1.0 / (hertz * PER_CYCLE))[0]
            logs.append((float(current), hertz, amplitude, channels, force))
    greatest = max(float(np.ptp(log[-1])) for log in logs)
    extra = [HIDDEN[hidden](c) if hidden in HIDDEN else 0.0 * f for *_, c, f in logs]
    scale = 0.5 * size * greatest / max(max(float(np.abs(e).max()) for e in extra), 1e-300)
    recordings, segments = {}, []
    for (current, hertz, amplitude, channels, force), more in zip(logs, extra, strict=True):
        measured = force + scale * more + noise * greatest * rng.standard_normal(len(force))
        i, held = f"{hertz:g}Hz-{1e3 * amplitude:g}mm-{current:g}A", np.full(len(force), current)
        channels = {**channels, "force": measured, "current": held}
        recordings[i] = Recording(i, i, "0", "none", 1 / (hertz * PER_CYCLE), 0.0, channels, {}, {}, {})
        role = "train" if current in np.round(trained, 3) else "holdout"
        segments.append(
            Segment(
                i, i, i, PER_CYCLE, len(force), PER_CYCLE, "sine", "displacement", hertz, amplitude, 0.0, CYCLES,
                current, float("nan"), role,
            )
        )  # fmt: skip
    varying = tuple(n for (n, _), moving in zip(parameters, moves, strict=False) if moving and truth == model)
    return Case(Dataset(segments, recordings), model, f"{truth}{hidden and ' + '}{hidden}, {name}", levels, varying)


def _moved(hertz: float, amplitude: float, shift: float) -> dict[str, Array]:
    """Return the channels of a sine that is late by a shift in s."""
    rate = 2.0 * np.pi * hertz
    phase = 2.0 * np.pi * (np.arange((CYCLES + 1) * PER_CYCLE) + 0.25) / PER_CYCLE - rate * shift
    values = np.sin(phase), rate * np.cos(phase), -(rate**2) * np.sin(phase)
    return {n: amplitude * v for n, v in zip(("displacement", "velocity", "acceleration"), values, strict=True)}


def candidates(case: Case) -> list[str]:
    """Return laws as --current-order writes them: every form and order of the strength beside others of the rest."""
    spec = assemble(case.model).spec
    strength, *rest = (n for n, _ in MODELS[case.model])
    of_strength = [f"{form}{k}" for form, k in product(FORMS, range(1, min(case.levels - 1, 3) + 1))]
    roles = {p.name: p.role for p in spec.params}
    forces = [n for n in rest if roles[n] in ("viscous", "stiffness")]
    others = [["", ""], [forces[0], "plain1"], [",".join(forces), "plain1"], [",".join(case.varying[1:]), "1"]]
    found = []
    for law, (names, order) in product(of_strength, others):
        more = [f"{n}={order}" for n in names.split(",") if n]
        found.append(",".join([f"{strength}={law}", *more]))
    return list(dict.fromkeys(found))


def judged(case: Case) -> tuple[str, dict[str, float]]:
    """Return the laws that the default chooses, and the held-out error of these and of every candidate.

    Laws are fitted about the optima of single currents, as the choice does it, not by a joint fit.
    """
    base = assemble(case.model)
    cube, rng = base_cube(stage.Settings(case.model, per="all")), np.random.default_rng(0)
    group, held = (_group(case, base, role) for role in ("train", "holdout"))
    blocks, floors = group.search, np.array(group.training_floors)
    fits = level_fits(blocks, base, cube, np.ones(len(blocks)), rng)
    posed = []
    for fit in fits:
        own = [k for k, b in enumerate(blocks) if abs(b.segment.current - fit.current) < 1e-6]
        posed.append(Posing(Posed([blocks[k] for k in own], np.ones(len(own)), base, cube), floors[own]))
    tests = tests_about(base.spec, cube, drawn_together(cube, fits, posed, rng), posed)
    currents = np.array([b.segment.current for b in held.search])
    beside = [Posed([b], np.ones(1), base, cube) for b in held.search]

    def error(order: str) -> float:
        given, laws = dict(orders_of(base.spec, order)) if order else {}, []
        for p in (base.spec.params[k] for k in cube.free):
            one = given.get(p.name, 0)
            form = form_of(one) or (LOG if logarithmic(base.spec, p, one) else PLAIN)
            laws.append(Law(form, count_of(one) - 1))
        theta = Laws(tests, laws, np.arange(len(tests.places))).parameters(currents)
        squares = [float(np.mean(q.of_theta(t[None, :])[0] ** 2)) for q, t in zip(beside, theta, strict=True)]
        return float(np.sqrt(np.mean(squares)))

    dependence = choose(tests, fits, {}, (fits[0].current, fits[-1].current)).dependence
    chosen = ",".join(f"{n}={o}" for n, o in dependence.orders) if dependence else ""
    return chosen, {order: error(order) for order in [chosen, *candidates(case)]}


def _group(case: Case, base: Assembly, role: str) -> Group:
    """Return the blocks of the segments of a role."""
    segments = [replace(s, role="train") for s in case.data.segments if s.role == role]
    return build_group("all", segments, dict(case.data.recordings), base, split=False)


def main(count: int, first: int, out: Path | None) -> None:
    """Print a row for every seed, and the percentiles of the error over the best candidate's."""
    head = ["seed", "model", "planted", "currents", "chosen / best", "laws chosen", "best candidate"]
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    ratios, levels = [], []
    for seed in range(first, first + count):
        case = case_of(seed)
        laws, errors = judged(case)
        best = min(errors, key=lambda order: errors[order])
        ratios.append(errors[laws] / errors[best])
        levels.append(case.levels)
        cells = [str(seed), case.model, case.planted, str(case.levels), f"{ratios[-1]:.3g}", laws or "0", best]
        lines.append("| " + " | ".join(cells) + " |")
        print(lines[-1], f"{errors[laws]!r} {errors[best]!r}", flush=True)
    for name, own in (
        ("all", np.array(ratios)),
        *((f"{k} currents", np.array(ratios)[np.array(levels) == k]) for k in (2, 3, 4, 5)),
    ):
        if len(own):
            median, most = np.percentile(own, (50, 95))
            lines += [
                "",
                f"{name}, {len(own)} rows: median {median:.3g}, 95th percentile {most:.3g}, worst {own.max():.3g}",
            ]
            print(lines[-1])
    if out:
        title = "# Dependence on current of models that err: held-out error over the best candidate's\n\n"
        out.write_text(title + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    words = sys.argv[1:]
    target = Path(words[words.index("--out") + 1]) if "--out" in words else None
    numbers = [int(w) for w in words if w.isdecimal()]
    main(numbers[0] if numbers else 300, numbers[1] if len(numbers) > 1 else 5000, target)
