"""What discovery works on: channels that are there or can be had, noise floors, no bend of a drifting level."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.recording import Finding, Recording
from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Bench, build_bench, effects_for, with_residual_floors
from mrfit.errors import DataError
from mrfit.search.parts import parts_of
from mrfit.search.problem import differences
from mrfit.signal.noise_floor import NoiseFloor
from mrfit.simulate.assembly import assemble
from tests.discover.test_rules import segment

DT, COUNT = 1e-3, 1000
TIME = np.arange(COUNT) * DT
X, V = 0.01 * np.sin(10 * np.pi * TIME), 0.1 * np.pi * np.cos(10 * np.pi * TIME)


def bench(noise: float = 1.0, offsets: tuple[float, ...] = (0.0,), **channels: Array) -> Bench:
    rng, recordings, segments = np.random.default_rng(3), {}, []
    for k, offset in enumerate(offsets):
        force = 800.0 * V + offset + noise * rng.standard_normal(COUNT)
        own = channels or {"displacement": X, "velocity": V}
        recordings[str(k)] = Recording(str(k), "r.csv", "r", "none", DT, 0.0, {**own, "force": force}, {})
        role = "holdout" if k else "train"
        segments.append(replace(segment(role, str(k), COUNT), recording=str(k)))
    base = assemble("regularised-bingham")
    return build_bench(segments, recordings, base, [registry.load("effect", "temperature").SPEC])


def test_the_noise_floor_is_that_of_the_cycles() -> None:
    found = bench(noise=2.0)
    assert found.stretches[0].repeats
    assert found.stretches[0].floor == pytest.approx(2.0, rel=0.1)


def test_a_channel_that_is_not_to_be_had_is_lacking_and_says_why() -> None:
    found = bench()
    assert "temperature" in found.lacking and "temperature" not in found.channels
    assert found.stretches[0].channel("temperature") is None
    assert {"displacement", "velocity", "time"} <= found.channels


def test_a_stroke_that_was_not_recorded_is_the_integral_of_the_velocity_about_its_middle() -> None:
    found = bench(velocity=V).stretches[0].channel("displacement")
    assert found is not None
    assert found == pytest.approx(X, abs=2e-4)


def test_a_velocity_that_was_not_recorded_is_no_reason_to_stop_but_both_missing_are() -> None:
    velocity = bench(displacement=X).stretches[0].channel("velocity")
    assert velocity == pytest.approx(V, abs=1e-3)
    with pytest.raises(DataError, match="velocity"):
        bench(current=np.ones(COUNT))


def test_errors_are_multiples_of_the_floor() -> None:
    found, assembly = bench(noise=2.0, offsets=(0.0, 0.0)), assemble("regularised-bingham")
    theta = np.array([[p.start for p in assembly.spec.params]])
    for role in ("train", "holdout"):
        (error,), (stretch,) = found.errors(assembly, theta, role), found.of_role(role)
        simulated = assembly.simulate(stretch.block_for(assembly).drive, theta, DT)[0]
        assert error[0] * stretch.floor == pytest.approx(simulated[-COUNT:] - stretch.measured, abs=1e-9)


def test_known_floors_stay_and_the_most_noise_is_that_of_unknown_ones() -> None:
    found = bench(offsets=(0.0, 0.0))
    assert found.most_noise("holdout") == 1.0
    known = {"0": None, "1": None}
    assert with_residual_floors(found, [np.ones(COUNT)] * 2, known, "force") == found  # type: ignore[arg-type]
    train, holdout = found.stretches
    unknown = replace(holdout, noise=NoiseFloor(float("nan"), "not known", holdout.floor, 3.0 * holdout.floor))
    assert replace(found, stretches=(train, unknown)).most_noise("holdout") == pytest.approx(3.0)


@pytest.mark.parametrize(("value", "in_line"), [(1.25, True), (1.35, False), (float("nan"), False)])
def test_a_guessed_floor_is_in_line_up_to_thirteen_tenths_of_the_measured_ones(value: float, in_line: bool) -> None:
    found = bench(offsets=(0.0, 0.0))
    train, holdout = found.stretches
    value *= train.floor
    other = replace(holdout, noise=NoiseFloor(value, "other records", 0.0, 3.0 * train.floor))
    assert not replace(found, stretches=(train, other)).noise_is_measured("holdout")
    assert replace(found, stretches=(train, other)).noise_is_told("holdout") == in_line
    guessed = replace(train, noise=replace(train.noise, method="regression"))
    assert not replace(found, stretches=(guessed, other)).noise_is_told("holdout")


def test_a_floor_that_was_measured_needs_no_other_in_line_with_it() -> None:
    found = bench(offsets=(0.0, 0.0))
    train, holdout = found.stretches
    noisy = replace(holdout, noise=replace(holdout.noise, value=3.0 * train.floor))
    assert replace(found, stretches=(train, train, noisy)).noise_is_told("holdout")


def test_only_effects_on_the_output_that_may_be_proposed_are_in_the_library() -> None:
    flux, force = ({e.name for e in effects_for(output)} for output in ("flux", "force"))
    assert "eddy-current" in flux and "eddy-current" not in force
    assert "inertia" in force and not {"force-filter", "current-filter"} & force


@pytest.mark.parametrize("start", [200, 600])
def test_what_counts_from_the_beginning_of_a_recording_is_led_in_by_all_of_it(start: int) -> None:
    whole, effect = assemble("dahl+degradation"), registry.load("effect", "degradation").SPEC
    theta = whole.spec.start[None].copy()
    theta[0, -2:] = 2e-3, 2e-6
    channels = {"displacement": X, "velocity": V, "time": TIME}
    force = whole.simulate(np.stack([channels[n] for n in whole.spec.inputs]), theta, DT)[0]
    noise = 0.01 * np.ptp(force) * np.random.default_rng(3).standard_normal(COUNT)
    recording = Recording("0", "r.csv", "r", "none", DT, 0.0, {"displacement": X, "force": force + noise}, {})
    later = replace(
        segment("train", "0"), recording="0", start=start, stop=COUNT, warm_up=200, cycles=(COUNT - start) // 200
    )
    (stretch,) = build_bench([later], {"0": recording}, assemble("dahl"), [effect]).stretches
    (part,) = parts_of(later, recording, whole, force)
    for block in (stretch.block_for(whole), part.block):
        simulated = block.at_targets(whole.simulate(block.drive, theta, DT))[0]
        assert simulated == pytest.approx(force[start:], abs=5e-3 * np.ptp(force))
    assert stretch.block_for(assemble("dahl")).drive.shape[1] < 2 * COUNT


def test_a_sample_at_which_the_output_was_clipped_counts_for_nothing() -> None:
    own, base = replace(segment("train", "0", COUNT), recording="0"), assemble("regularised-bingham")
    force = 800.0 * V + np.random.default_rng(3).standard_normal(COUNT)
    limit = 0.8 * np.max(force)
    cut = Recording("0", "r.csv", "r", "none", DT, 0.0, {"velocity": V, "force": np.minimum(force, limit)}, {})
    found = [
        replace(cut, findings=own)
        for own in ((), (Finding("clipped", "force", DT * float(np.argmax(cut.channels["force"])), "it is clipped"),))
    ]
    whole, kept = (build_bench([own], {"0": r}, base, []).stretches[0] for r in found)
    assert np.all(kept.block.counts[force > limit + 5.0] == 0.0)
    assert np.all(kept.block.counts[force < limit - 5.0] == 1.0) and np.all(whole.block.counts == 1.0)
    theta = np.array([[p.start for p in base.spec.params]])
    counts = kept.block.counts > 0.0
    every, some = (differences(s.block_for(base), base, theta)[0] for s in (whole, kept))
    assert np.all(some[~counts] == 0.0) and np.array_equal(some[counts], every[counts])


def test_samples_that_lead_a_segment_in_are_simulated_too() -> None:
    recording = Recording("0", "r.csv", "r", "none", DT, 0.0, {"velocity": V, "force": 800.0 * V + X}, {})
    late = replace(segment("train", "0"), recording="0", start=600, stop=COUNT, warm_up=600, cycles=0)
    found = build_bench([late], {"0": recording}, assemble("regularised-bingham"), [])
    assert (found.samples("train"), found.simulated("train"), found.simulated("holdout")) == (400, COUNT, 0)
