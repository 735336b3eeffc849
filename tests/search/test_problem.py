"""Folding a periodic log onto one cycle changes the work, not the answer."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.core.recording import Recording, Segment
from mrfit.models import boucwen_flux
from mrfit.search.parts import SegmentPart, parts_of
from mrfit.search.problem import AHEAD_CYCLES, beside_jumps, differences, folded_block, full_block, residual_function
from mrfit.signal.smoothing import smooth
from mrfit.simulate.assembly import assemble

THETA = np.array([[1.2, 0.018, 1.4, 0.8, 1.2, 1.6, 0.3], [1.1, 0.02, 2.0, 0.5, 1.5, 1.3, 0.5]])


def a_log(frequency: float, dt: float, cycles: int, noise: float) -> tuple[Recording, Segment]:
    """A noisy log of ``cycles`` steady cycles after two of warm-up."""
    rng = np.random.default_rng(1)
    lead, samples = int(round(2 / frequency / dt)), int(round((cycles + 2) / frequency / dt))
    time = np.arange(samples) * dt
    current = 3.0 * np.sin(2 * np.pi * frequency * time)
    flux = boucwen_flux.response(current[None, :], THETA[:1], dt)[0] + noise * rng.standard_normal(samples)
    recording = Recording("a", "a", "0", "none", dt, 0.0, {"current": current, "flux": flux}, {})
    nan = float("nan")
    segment = Segment(
        "a#1", "sine", "a", lead, samples, lead, "sine", "current", frequency, 3.0, 0.0, cycles, nan, nan, "train"
    )
    return recording, segment


@settings(max_examples=15, deadline=None)
@given(st.floats(0.7, 12.0), st.floats(350.0, 900.0), st.integers(4, 9))
def test_the_cost_over_phase_bins_is_the_cost_over_samples(frequency: float, per_cycle: float, cycles: int) -> None:
    recording, segment = a_log(frequency, 1 / (frequency * per_cycle), cycles, 1e-4)
    assembly = assemble("boucwen-flux")
    drive = smooth(recording, segment, ("current",))
    output = recording.channels["flux"][segment.start : segment.stop]
    folded = residual_function([folded_block(segment, drive, output)], assembly, lambda p: p, np.ones(1))(THETA)
    full = differences(full_block(segment, drive, output), assembly, THETA)
    cost = np.sqrt(np.mean(folded**2, axis=1))
    # the scatter inside bins is an estimate where a bin holds two samples
    assert cost == pytest.approx(np.sqrt(np.mean(full**2, axis=1)), rel=0.08)
    # the excess of a wrong model over the right one is what a search follows
    assert cost[1] ** 2 - cost[0] ** 2 == pytest.approx(np.mean(full[1] ** 2) - np.mean(full[0] ** 2), rel=2e-3)


def test_samples_closer_than_phase_bins_are_compared_with_the_mean_of_the_curve_over_a_bin() -> None:
    recording, segment = a_log(2.0, 1 / (2.0 * 2000), 3, 0.0)
    drive = smooth(recording, segment, ("current",))
    block = folded_block(segment, drive, recording.channels["flux"][segment.start : segment.stop])
    apart = differences(block, assemble("boucwen-flux"), THETA[:1])[0]
    assert np.std(apart) <= 3e-7 * np.std(block.target)


@pytest.mark.parametrize("cycles", [3, 8])
def test_an_effect_that_takes_means_sees_whole_cycles(cycles: int) -> None:
    frequency, per_cycle = 5.0, 1200
    recording, segment = a_log(frequency, 1 / (frequency * per_cycle), cycles, 0.0)
    assembly = assemble("boucwen-flux+resistance-error")
    theta = np.append(THETA[0], 0.5)[None]
    inputs = np.zeros((len(assembly.spec.inputs), recording.samples))
    # its mean over the cycles that are compared is not that over an unfinished one
    inputs[0] = 3.0 * np.sin(2 * np.pi * frequency * recording.dt * np.arange(recording.samples) + 0.8)
    flux = assembly.simulate(inputs, theta, recording.dt)[0]
    recording = replace(recording, channels={"current": inputs[0], "flux": flux})
    drive = smooth(recording, segment, assembly.spec.inputs)
    output = flux[segment.start : segment.stop]
    for block in (full_block(segment, drive, output), folded_block(segment, drive, output, AHEAD_CYCLES)):
        apart = differences(block, assembly, theta)[0]
        # the constant of a flux is unknown
        assert np.std(apart) <= 2e-5 * np.ptp(output)


@pytest.mark.parametrize("per_cycle", [8, 16])
def test_few_phases_that_repeat_leave_a_scatter_that_is_a_number(per_cycle: int) -> None:
    dt = 1.0 / 256.0  # phases are exact
    recording, segment = a_log(1.0 / (dt * per_cycle), dt, 200, 1e-4)
    drive = smooth(recording, segment, ("current",))
    block = folded_block(segment, drive, recording.channels["flux"][segment.start : segment.stop])
    assert len(block.target) == per_cycle
    assert block.scatter == pytest.approx(1e-8 * block.samples, rel=0.2)


JUMPING = {"bingham": (900.0, 2000.0, -25.0), "herschel-bulkley": (600.0, 1500.0, 0.7, 9.0)}


def part_of_a_jumping_law(model: str, motion: tuple[float, float], dt: float, noise: float) -> SegmentPart:
    """12 s of a law that jumps, under a sine of (frequency, phase) or, without a frequency, a random stroke."""
    frequency, phase = motion
    samples, rng = int(12.0 / dt), np.random.default_rng(3)
    time, lead = dt * np.arange(samples), 0
    if frequency:
        lead = int(round(1 / frequency / dt))
        displacement = 0.01 * np.sin(2 * np.pi * frequency * time + phase)
        velocity = 0.02 * np.pi * frequency * np.cos(2 * np.pi * frequency * time + phase)
    else:
        rates, phases = rng.uniform(0.5, 5.0, 30), rng.uniform(0.0, 2 * np.pi, 30)
        turns = 2 * np.pi * rates * time[:, None] + phases
        displacement = 0.003 * np.sum(np.sin(turns) / rates, axis=1)
        velocity = 0.006 * np.pi * np.sum(np.cos(turns), axis=1)
    assembly = assemble(model)
    force = assembly.simulate(velocity[None], np.array([JUMPING[model]]), dt)[0]
    channels = {"displacement": displacement + noise * rng.standard_normal(samples), "force": force}
    recording = Recording("a", "a", "0", "none", dt, 0.0, channels, {})
    cycles = int((samples - lead) * dt * frequency + 1e-9)
    stop = lead + int(round(cycles / frequency / dt)) if frequency else samples
    nan = float("nan")
    wave = (
        ("sine", "displacement", frequency, 0.01, 0.0, cycles)
        if frequency
        else ("random", "displacement", nan, nan, 0.0, 0)
    )
    segment = Segment("a#1", "a test", "a", lead, stop, lead, *wave, nan, nan, "train")
    (part,) = parts_of(segment, recording, assembly, force)
    return part


@pytest.mark.parametrize("model", JUMPING)
@pytest.mark.parametrize(
    ("motion", "dt"), [((0.5, 0.0), 2e-3), ((1.0, 0.3), 2e-3), ((2.03, 1.0), 2e-3), ((1.0, 0.0), 12e-3)]
)
def test_a_force_that_jumps_is_compared_on_either_side_of_the_jump(
    model: str, motion: tuple[float, float], dt: float
) -> None:
    # at 0.5 Hz, and in the short log that is not folded, samples fall on the jump itself
    part = part_of_a_jumping_law(model, motion, dt, 0.0)
    block, force = part.folded(0), part.output
    assert (block.bins is not None) == (dt < 0.01)
    assert block.scatter <= 1e-4 * np.ptp(force) ** 2
    assert 0.93 * len(force) <= block.samples < len(force)
    assert np.abs(differences(block, assemble(model), np.array([JUMPING[model]]))).max() <= 1e-4 * np.ptp(force)


@pytest.mark.parametrize("model", JUMPING)
def test_no_sample_on_the_wrong_side_of_a_jump_is_compared(model: str) -> None:
    part, theta = part_of_a_jumping_law(model, (0.0, 0.0), 2e-3, 2e-5), np.array([JUMPING[model]])
    # the velocity that a noisy stroke tells passes zero a sample too early or too late
    assert np.abs(differences(part.block, assemble(model), theta)).max() > theta[0, 0]
    assert np.abs(differences(part.compared, assemble(model), theta)).max() < 0.1 * theta[0, 0]
    assert np.array_equal(part.folded(0).counts, part.compared.counts)
    assert 0.9 * len(part.output) <= part.compared.samples < len(part.output)


@pytest.mark.parametrize("motion", [(1.0, 0.3), (0.0, 0.0)], ids=["sine", "random"])
def test_an_output_that_turns_over_a_knee_is_compared_at_every_sample(motion: tuple[float, float]) -> None:
    sharp = part_of_a_jumping_law("bingham", motion, 2e-3, 0.0)
    velocity = sharp.inputs(0)
    smooth_force = 900.0 * np.tanh(velocity / 0.03) + 2000.0 * velocity
    soft = replace(sharp, output=smooth_force)
    assert sharp.folded(0).samples < len(velocity) and soft.folded(0).samples == len(velocity)
    assert soft.compared.samples == len(velocity)
    # a straight line over the jump of the model, where a cubic overshoots
    simulated = soft.folded(0).at_targets(
        assemble("bingham").simulate(soft.folded(0).drive, np.array([[900.0, 1.0, 0.0]]), sharp.dt)
    )
    assert np.abs(simulated).max() <= 901.0


def test_the_ends_of_a_record_from_rest_are_no_jump() -> None:
    part = part_of_a_jumping_law("bingham", (0.0, 0.0), 2e-3, 0.0)
    time = 2e-3 * np.arange(len(part.output))
    rising = replace(part.block, drive=time[None], target=2000.0 * time, weights=part.block.weights)
    assert beside_jumps(rising, (0,)).samples == len(time)
    # where nothing else was measured, all is compared
    beside = np.where(part.compared.counts > 0.0, 0.0, 1.0)
    assert beside_jumps(replace(part.block, counts=beside), (0,)).samples == beside.sum() > 0


@pytest.mark.parametrize("folds", [True, False])
def test_a_memory_of_many_cycles_is_in_its_steady_state(folds: bool) -> None:
    # the inner displacement of a Spencer damper follows its mean within 5 s here: five cycles, of which two are led in
    planted = {"C0": 25e3, "C_inf": 1500.0, "K0": 800.0, "K_inf": 5000.0, "alpha": 450.0, "A": 1500.0}
    assembly = assemble("spencer")
    theta = assembly.spec.theta({**planted, "beta": 700.0, "gamma": 800.0, "n": 2.0, "f0": 30.0})[None]
    dt, cycles = 1 / 300.0, 12 if folds else 3
    time = dt * np.arange(-300 * 100, 300 * (cycles + 2))
    motion = np.stack([0.01 * np.sin(2 * np.pi * time + 1.0), 0.02 * np.pi * np.cos(2 * np.pi * time + 1.0)])
    force = assembly.simulate(motion, theta, dt)[0, 300 * 100 :]
    channels = {"displacement": motion[0, 300 * 100 :], "force": force}
    recording = Recording("a", "a", "0", "none", dt, 0.0, channels, {})
    nan = float("nan")
    wave = ("sine", "displacement", 1.0, 0.01, 0.0, cycles, nan, nan, "train")
    segment = Segment("a#1", "a test", "a", 600, 300 * (cycles + 2), 600, *wave)
    (part,) = parts_of(segment, recording, assembly, force)
    block = part.folded(0)
    assert (block.bins is not None) == folds
    assert abs(np.mean(differences(block, assembly, theta))) < 2e-3 * np.ptp(force)
    late = replace(part, drive=replace(part.drive, entry=0.0)).folded(0)
    assert abs(np.mean(differences(late, assembly, theta))) > 1e-2 * np.ptp(force)


def test_a_flux_record_is_compared_up_to_its_unknown_constant() -> None:
    recording, segment = a_log(5.0, 1e-4, 4, 0.0)
    assembly = assemble("boucwen-flux")
    drive = smooth(recording, segment, ("current",))
    output = recording.channels["flux"][segment.start : segment.stop]
    for shift in (0.0, 0.7):
        delta = differences(full_block(segment, drive, output + shift), assembly, THETA[:1])
        assert np.max(np.abs(delta)) < 2e-6


def test_an_effect_that_looks_ahead_finds_what_comes_after_the_cycles_compared() -> None:
    recording, segment = a_log(40.0, 1e-4, 6, 0.0)
    assembly = assemble("boucwen-flux+probe-skew")
    late = 2e-3
    shown = {**recording.channels, "current": np.roll(recording.channels["current"], round(late / recording.dt))}
    drive = smooth(replace(recording, channels=shown), segment, ("current", "flux_resistance"))
    output = recording.channels["flux"][segment.start : segment.stop]
    theta = np.append(THETA[0], late)[None]
    for block in (full_block(segment, drive, output), folded_block(segment, drive, output, AHEAD_CYCLES)):
        assert np.abs(differences(block, assembly, theta)).max() <= 2e-4 * np.ptp(output)
