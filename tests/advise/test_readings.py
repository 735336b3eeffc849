"""Readings of a formula are told apart by a test that moves what they differ in, and mirror images by none."""

import numpy as np

from mrfit.advise import stage
from mrfit.advise.choose import ScoredTest, Task, choose
from mrfit.advise.drives import RigBench
from mrfit.advise.readings import ReadingSet
from mrfit.advise.rig import motion_reach, rig_of
from mrfit.advise.specimen import Channels, Specimen
from mrfit.api.preparing import as_asked, prepared
from mrfit.core.progress import silent
from mrfit.discover.invariance.records import Record, thinned
from mrfit.io.schemas.discovery import FormulaFactor, FormulaReading, FormulaScale, FormulaTerm, ProposedFormula
from tests.advise.lab import MODEL, SPRING, one_frequency
from tests.advise.test_rivals import found

DT, FREQUENCY, SPAN = 2e-3, 2.0, 1000.0
RIG = rig_of({"seconds": 6, "stroke": "24 mm", "speed": 0.4, "acceleration": 20})
SCALES = {"x": 0.01, "v": 0.13, "a": 1.6, "i": 1.0, "T": 1.0, "t": 3.0, "L": SPAN}


def of_one_frequency(force: float) -> list[Record]:
    """Return four strokes at one frequency, where a spring of a force (N) and a mass are one."""
    rng, records, t, w = np.random.default_rng(1), [], np.arange(1500) * DT, 2.0 * np.pi * FREQUENCY
    for k, size in enumerate((0.004, 0.006, 0.008, 0.01)):
        x, v = size * np.sin(w * t), size * w * np.cos(w * t)
        channels = {"displacement": x, "velocity": v, "acceleration": -(w**2) * x, "time": t}
        made = 300.0 * np.tanh(v / 0.01) + 1500.0 * v + force * x / 0.01 + rng.normal(0.0, 2.0, len(t))
        records.append(thinned(f"c{k}", DT, channels, made, "force"))
    return records


def reading(text: str, variable: str, kind: str, size: float, *constants: float) -> FormulaReading:
    factor = FormulaFactor(variable=variable, kind=kind, constants=constants)
    return FormulaReading(text=text, terms=(FormulaTerm(factors=(factor,), coefficient=size),))


def readings(*own: FormulaReading) -> ReadingSet:
    scales = tuple(FormulaScale(symbol=n, origin=0.0, size=s) for n, s in SCALES.items())
    specimen = Specimen(Channels.of("force"), {}, 0.0, None)
    return ReadingSet.of(of_one_frequency(50.0), ProposedFormula(text="k*x", readings=own, scales=scales), specimen)


def best(own: ReadingSet, most: float = np.inf) -> tuple[ScoredTest, ...]:
    rigged = RigBench(RIG, motion_reach(RIG, 8, 1.0 / DT), None, DT)

    def judge(test):  # type: ignore[no-untyped-def]
        far = own.apart(test, most)
        return None if far is None else ScoredTest(test, far)

    return choose(Task(rigged, judge, lambda reached: reached >= 3.0, ("sine",)), 0, silent).tests


def test_a_spring_and_a_mass_of_one_frequency_are_told_apart_by_another() -> None:
    spring, mass = reading("k*x", "x", "line", 0.05), reading("m*a", "a", "line", -0.05)
    own = readings(spring, mass)
    assert 0.4 < own.noise < 2.2 and own.left()[0] < 3.0
    (test,) = best(own)
    assert test.amounts[0] > 100.0
    assert not 0.7 < test.test.numbers["frequency"] / FREQUENCY < 1.4
    assert best(own, most=100.0) == ()


def test_mirror_images_are_told_apart_by_no_test() -> None:
    above, below = reading("c*max(0,v)^2", "v", "above", 0.05, 2.0), reading("-c*max(0,-v)^2", "v", "below", 0.05, 2.0)
    (test,) = best(readings(above, below))
    assert test.amounts[0] < 3.0


def test_a_discovery_with_readings_is_advised_on_these() -> None:
    data = prepared(one_frequency({"gas-spring": SPRING}, np.random.default_rng(5)), as_asked({}), silent).dataset
    own = [reading("k*x", "x", "line", 0.05).model_dump(), reading("m*a", "a", "line", -0.05).model_dump()]
    scales = [{"symbol": n, "origin": 0.0, "size": s} for n, s in SCALES.items()]
    told = found("unexplained", MODEL, proposed={"text": "k*x", "readings": own, "scales": scales})
    made = stage.of_discovery(stage.bench_of(data, MODEL), told, RIG, 0)
    assert made.content.goal == "readings" and made.figure is None
    assert made.content.rivals == ("k*x", "m*a") and made.content.pairs[0].separable
    assert "puts k*x and m*a at least" in made.content.text[0] and made.content.companion
