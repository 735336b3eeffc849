"""What is drawn of a suspect is its force and what the measurement leaves without it: a planted mass by closed form."""

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrfit.discover.evidence.bench import build_bench, effects_for
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.selection.questions import EffectScreening, Fit, Join
from mrfit.discover.writing.contributions import contributions
from mrfit.fit.select import load_recordings
from mrfit.io.schemas.discovery import Suspect
from mrfit.search.cube import cube_of
from mrfit.simulate.assembly import assemble
from tests.discover.studies import LAW, NOISE, workspace

MASS = 6.0


def suspect(name: str, **more: str) -> Suspect:
    return Suspect(name=name, parameters=(), holdout_nrmse_after=0.1, **more)


@pytest.fixture(scope="module")
def gathering(tmp_path_factory: pytest.TempPathFactory) -> Any:
    made = workspace(Path(tmp_path_factory.mktemp("mass")), mass=MASS, tests=((1.0, 0.01), (4.0, 0.01)))
    segments = made.read_segments()
    bench = build_bench(segments, load_recordings(made, segments), assemble("tanh"), effects_for("force"))

    def refit_of(fit: Fit) -> Refit:
        assembly = assemble("+".join(["tanh", *fit.effects]))
        cube = cube_of(assembly.spec, {}, {}, {})
        planted = {**LAW, "a2": 0.0, "f0": 0.0, "inertia.m": MASS}
        theta = np.array([[planted.get(p.name, p.start) for p in cube.params]])
        return Refit(fit.effects, assembly, cube, cube.to_points(theta)[0], [], [], lambda: pytest.fail("not asked"))

    asked: list[Join] = []

    def refits(wanted: list[Join]) -> Iterator[Fit]:
        asked.extend(wanted)
        return (Fit(9, one.effects, 1.0, 1.0) for one in wanted)

    return SimpleNamespace(fitter=SimpleNamespace(bench=bench), refit_of=refit_of, refits=refits, asked=asked)


def test_the_force_of_a_planted_mass_is_what_the_measurement_leaves_without_it(gathering: Any) -> None:
    base = Fit(0, (), 9.0, 9.0)
    proven = Fit(1, ("inertia",), 5.0, 5.0)
    chosen = Selection(base, base, proven, EffectScreening(base), taken_back=True)
    columns = contributions(gathering, chosen, [suspect("inertia")])
    assert set(columns) == {"with inertia", "without inertia"} and not gathering.asked
    force = columns["with inertia"] - columns["without inertia"]
    bench = gathering.fitter.bench
    stretches = [*bench.of_role("train"), *bench.of_role("holdout")]
    accelerations = []
    for s in stretches:
        omega = 2.0 * np.pi * s.segment.frequency
        accelerations.append(-(omega**2) * s.channel("displacement"))
    planted = MASS * np.concatenate(accelerations)
    assert len(force) == sum(s.segment.samples for s in stretches)
    assert force == pytest.approx(planted, abs=0.02 * np.max(np.abs(planted)))
    # a fit that has it leaves noise, and one without it the force and the noise
    assert np.std(columns["with inertia"]) == pytest.approx(NOISE, rel=0.2)
    assert np.std(-columns["without inertia"] - force) == pytest.approx(NOISE, rel=0.2)


def test_an_effect_that_could_stand_instead_is_shown_in_the_fit_it_stands_in(gathering: Any) -> None:
    base, final = Fit(0, (), 9.0, 9.0), Fit(1, ("inertia",), 5.0, 5.0)
    chosen = Selection(base, final, final, EffectScreening(base), ambiguous=(("inertia", "delay"),))
    columns = contributions(gathering, chosen, [suspect("inertia"), suspect("delay")])
    assert [q.effects for q in gathering.asked] == [("delay",)]
    assert set(columns) == {"with inertia", "without inertia", "with delay", "without delay"}
    # no delay was planted, and at its start it is neutral
    assert columns["with delay"] == pytest.approx(columns["without delay"])
