"""Default laws of current of models that err: ``python -m benchmarks.current_erring COUNT [FIRST]``.

Every planted damper has a hidden effect, or is fitted by a model of another family. Sines at two to five currents are
trained on; the default laws are judged at currents between them. Beside them stands the best of all candidates: the
law of the strength of every form and order, the other parameters' laws by role or as planted. It is known from the
held-out data themselves. Both are fitted about the optima of single currents, as the choice does it.
Seeds below 1000 are those the choice was made on.

``--rows FILE.jsonl`` gets a row for every seed; what it has already is not judged again. ``--old FILE.jsonl`` has those
of an older rule. ``--out FILE.md`` is the page.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import json  # noqa: E402
import sys  # noqa: E402
from collections.abc import Callable, Sequence  # noqa: E402
from dataclasses import dataclass, replace  # noqa: E402
from itertools import pairwise, product  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402

import mrfit.fit.stage as stage  # noqa: E402
from benchmarks.current_laws import currents_of, law_of, oracle  # noqa: E402
from mrfit.core.recording import Recording, Segment  # noqa: E402
from mrfit.core.specs import Array  # noqa: E402
from mrfit.fit.identify import FitGroup, build_group  # noqa: E402
from mrfit.fit.laws.by_level import CurrentLaw, Laws, LevelProblem, drawn_together, tests_about  # noqa: E402
from mrfit.fit.laws.choice import choose  # noqa: E402
from mrfit.fit.laws.laws_of_current import base_cube  # noqa: E402
from mrfit.io.dataset import Dataset  # noqa: E402
from mrfit.search.problem import LeastSquaresProblem  # noqa: E402
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
# Deviance by which a law fits worse than the best within chance (95 % of chi-squared of one degree of freedom)
ALIKE = 3.84
# Quotient of the target's 95th percentile; rows and seed of the oracle
BEYOND, ORACLE = 1.5, 500
# Numbers of trained currents
LEVELS = 2, 3, 4, 5
TITLE = """# Default laws of current of models that err

`python -m benchmarks.current_erring 300 20000 [--rows FILE.jsonl] [--old FILE.jsonl] [--out FILE.md]`

Every planted damper has a hidden effect, or is fitted by a model of another family. Sines at two to five currents are
trained on. Numbers are the error at currents between them over that of the best candidate law, which is known from the
held-out data themselves: the median and the 95th percentile, and the share of rows *beyond* 1.5. *old rule*: laws of
the roles, unless another is better by a third and by three standard errors.

*alike differ*: share of rows in which laws that the trained data do not tell apart (95 %) differ by more than 1.5 at
the currents between. *oracle*: the law that one takes who knows how often every family of laws is drawn, and sees the
strength at the trained currents, to the error of a fit there. A rule that knows the data alone can hardly do better.

At two currents a straight line, an exponential and a law that saturates go through the same two values, so that the
oracle itself is beyond 1.5 in more than a third of the rows, as the default is. There a test at a third current is
needed, and the fit says so.

"""


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
    low = 0.0 if rng.random() < 0.8 else 0.2
    trained, between = (top * u for u in currents_of(levels, low, rng))
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


def judged(seed: int) -> dict[str, Any]:
    """Return the row of a seed: the laws that the default chooses and the best candidate, each with its held-out error.

    ``alike`` is the greatest held-out error over the least among laws that the trained data do not tell apart.
    Laws are fitted about the optima of single currents, as the choice does it, not by a joint fit.
    """
    case = case_of(seed)
    base = assemble(case.model)
    cube, rng = base_cube(stage.Settings(case.model, per="all")), np.random.default_rng(0)
    group, held = (_group(case, base, role) for role in ("train", "holdout"))
    blocks, floors = group.search, np.array(group.training_floors)
    fits = level_fits(blocks, base, cube, np.ones(len(blocks)), rng)
    posed = []
    for fit in fits:
        own = [k for k, b in enumerate(blocks) if abs(b.segment.current - fit.current) < 1e-6]
        posed.append(
            LevelProblem(LeastSquaresProblem([blocks[k] for k in own], np.ones(len(own)), base, cube), floors[own])
        )
    tests = tests_about(base.spec, cube, drawn_together(cube, fits, posed, rng), posed)
    currents = np.array([b.segment.current for b in held.search])
    beside = [LeastSquaresProblem([b], np.ones(1), base, cube) for b in held.search]

    def errors(order: str) -> tuple[float, float]:
        """Return the RMS error held out, and the deviance under the trained conditions."""
        given, laws = dict(orders_of(base.spec, order)) if order else {}, []
        for p in (base.spec.params[k] for k in cube.free):
            one = given.get(p.name, 0)
            form = form_of(one) or (LOG if logarithmic(base.spec, p, one) else PLAIN)
            laws.append(CurrentLaw(form, count_of(one) - 1))
        fitted = Laws(tests, [laws], np.arange(len(tests.places)))
        theta, known = fitted.parameters(currents)[0], fitted.parameters(tests.currents[tests.places])[0]
        squares = [float(np.mean(q.of_theta(t[None, :])[0] ** 2)) for q, t in zip(beside, theta, strict=True)]
        deviances = [float(tests.deviance(k, t[None, :])[0]) for k, t in enumerate(known)]
        return float(np.sqrt(np.mean(squares))), sum(deviances)

    dependence = choose(tests, fits, {}, (fits[0].current, fits[-1].current)).dependence
    chosen = ",".join(f"{n}={o}" for n, o in dependence.orders) if dependence else ""
    found = {order: errors(order) for order in [chosen, *candidates(case)]}
    best, least = min(found, key=lambda order: found[order][0]), min(deviance for _, deviance in found.values())
    alike = [error for error, deviance in found.values() if deviance <= least + ALIKE]
    return {
        "seed": seed,
        "model": case.model,
        "planted": case.planted,
        "currents": case.levels,
        "laws": chosen,
        "error": found[chosen][0],
        "best": best,
        "least": found[best][0],
        "alike": max(alike) / min(alike),
    }


def _group(case: Case, base: Assembly, role: str) -> FitGroup:
    """Return the blocks of the segments of a role."""
    segments = [replace(s, role="train") for s in case.data.segments if s.role == role]
    return build_group("all", segments, dict(case.data.recordings), base, split=False)


def read(path: Path | None) -> dict[int, dict[str, Any]]:
    """Return the rows of a file by seed."""
    lines = path.read_text(encoding="utf-8").splitlines() if path and path.exists() else []
    return {row["seed"]: row for row in map(json.loads, lines)}


def page(rows: Sequence[dict[str, Any]], old: dict[int, dict[str, Any]]) -> str:
    """Return the tables: percentiles by number of currents, and a line for every seed."""
    heads = "rows", "old rule", "beyond", "default", "beyond", "alike differ", "oracle", "beyond"
    lines = [f"| currents | {' | '.join(heads)} |", "|" + " --- |" * (1 + len(heads))]
    for name, levels in {**{str(k): [k] for k in LEVELS}, "3 to 5": LEVELS[1:], "all": LEVELS}.items():
        own = [r for r in rows if r["currents"] in levels]
        known = oracle(levels[0], ORACLE, ORACLE) if len(levels) == 1 else np.array([])
        if own:
            before = np.array([old[r["seed"]]["error"] / r["least"] for r in own if r["seed"] in old])
            now = np.array([r["error"] / r["least"] for r in own])
            differ = f"{np.mean([r['alike'] > BEYOND for r in own]):.0%}"
            cells = [str(len(own)), *_told(before), *_told(now), differ, *_told(known)]
            lines.append(f"| {name} | {' | '.join(cells)} |")
    numbers = "old / best", "default / best", "alike"
    heads = "seed", "model", "planted", "currents", *numbers, "laws chosen", "best candidate"
    lines += ["", f"| {' | '.join(heads)} |", "|" + " --- |" * len(heads)]
    for r in rows:
        first = f"{old[r['seed']]['error'] / r['least']:.3g}" if r["seed"] in old else ""
        numbers = first, f"{r['error'] / r['least']:.3g}", f"{r['alike']:.3g}"
        cells = str(r["seed"]), r["model"], r["planted"], str(r["currents"]), *numbers, r["laws"] or "0", r["best"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _told(quotients: Array) -> tuple[str, str]:
    """Return median and 95th percentile, and the share beyond the target."""
    if not len(quotients):
        return "", ""
    median, most = np.percentile(quotients, (50, 95))
    return f"{median:.3f}, {most:.2f}", f"{np.mean(quotients > BEYOND):.0%}"


def main(words: Sequence[str]) -> None:
    """Judge the seeds that the file of rows lacks, and write the page."""
    named = {name: Path(path) for name, path in pairwise(words) if name in ("--rows", "--old", "--out")}
    numbers = [int(w) for w in words if w.isdecimal()]
    count, first = (*numbers, *(300, 5000)[len(numbers) :])
    target = named.get("--rows")
    rows = read(target)
    for seed in (s for s in range(first, first + count) if s not in rows):
        rows[seed] = judged(seed)
        if target:
            with target.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(rows[seed]) + "\n")
        print(seed, f"{rows[seed]['error'] / rows[seed]['least']:.3g}", rows[seed]["laws"], flush=True)
    text = page([rows[s] for s in range(first, first + count)], read(named.get("--old")))
    if "--out" in named:
        named["--out"].write_text(TITLE + text, encoding="utf-8")
    else:
        print(text)


if __name__ == "__main__":
    main(sys.argv[1:])
