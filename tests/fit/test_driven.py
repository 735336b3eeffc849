"""Fits of a driven mass: planted parameters come back, and wrong input is one line."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.recording import Recording, Segment
from mrfit.errors import ConfigError, DataError
from mrfit.fit.driven import with_drive
from mrfit.fit.stage import FitOrigin, identify
from mrfit.io.dataset import Dataset
from mrfit.segment.detect import detect
from mrfit.settings.fit import Settings
from mrfit.simulate.assembly import assemble

DT, PERIOD = 2e-3, 500
TRUTH = {"k": 8000.0, "c": 12.0, "f0": 0.0, "mass": 2.0}
NOISE = 1e-5


def log(channel: str, cycles: int, noise: float, output: str = "displacement") -> tuple[Recording, Segment]:
    rng = np.random.default_rng(3)
    phase = 2 * np.pi * np.arange(PERIOD) / PERIOD
    lines = range(3, 40)
    cycle = sum(4.0 * np.cos(n * phase + p) for n, p in zip(lines, rng.uniform(0, 2 * np.pi, len(lines)), strict=True))
    drive = np.resize(cycle, PERIOD * max(cycles, 1))
    by = "force" if channel == "excitation_force" else "base"
    whole = assemble(f"linear-spring-dashpot@{by}-{output.replace('_', '-')}")
    lead = 3 * PERIOD if cycles else 0
    motion = whole.simulate(np.resize(cycle, lead + len(drive))[None], whole.spec.theta(TRUTH)[None], DT)[0, lead:]
    motion = motion + noise * rng.standard_normal(len(motion))
    units = {channel: "N", output: "m"}
    recording = Recording("r", "r.csv", "", "", DT, 0.0, {channel: drive, output: motion}, units)
    (segment,) = detect(recording, channel, 3, 1, 0.1).segments
    return recording, replace(segment, condition="planted")


def fitted(recording: Recording, segment: Segment, settings: Settings):
    return identify(Dataset([segment], {"r": recording}), settings, FitOrigin("", "", "")).content


def test_planted_mass_spring_and_dashpot_lie_in_their_intervals() -> None:
    recording, segment = log("excitation_force", 4, NOISE)
    assert segment.cycles == 4
    fit = fitted(recording, segment, Settings("linear-spring-dashpot", driven_by="force", mass="free"))
    assert fit.model == "linear-spring-dashpot@force-displacement"
    for found in fit.results[0].parameters:
        assert found.low <= TRUTH[found.name] <= found.high or found.value == pytest.approx(TRUTH[found.name], rel=2e-3)
    assert fit.pooled("train").rmse == pytest.approx(NOISE, rel=0.05)


def test_record_of_a_base_from_rest_gives_what_a_known_mass_hangs_on() -> None:
    recording, segment = log("base_acceleration", 0, 0.0, "acceleration")
    assert segment.cycles == 0
    fit = fitted(recording, segment, Settings("linear-spring-dashpot", driven_by="base", mass="2.0"))
    found = {p.name: p.value for p in fit.results[0].parameters}
    assert found == pytest.approx(TRUTH, rel=1e-4, abs=1e-3)


@pytest.mark.parametrize(
    ("settings", "error", "text"),
    [
        ({"driven_by": "force"}, ConfigError, "a mass is driven, and none is given"),
        ({"driven_by": "force", "mass": "two"}, ConfigError, "--mass two is no mass"),
        ({"mass": "2.0"}, ConfigError, "add --driven-by force or base"),
    ],
)
def test_mass_and_drive_that_do_not_go_together_are_refused(settings, error, text) -> None:
    recording, _ = log("excitation_force", 1, 0.0)
    with pytest.raises(error, match=text):
        with_drive(Settings("bingham", **settings), {"r": recording})


def test_two_excitations_and_one_that_aliases_are_refused() -> None:
    recording, _ = log("excitation_force", 1, 0.0)
    asked = Settings("bingham", driven_by="force", mass="free")
    both = replace(recording, channels={**recording.channels, "base_acceleration": recording.channels["displacement"]})
    with pytest.raises(DataError, match="holds excitation_force and base_acceleration"):
        with_drive(asked, {"r": both})
    white = np.random.default_rng(0).standard_normal(PERIOD)
    with pytest.raises(DataError, match="of the excitation's power lies above 0.43 of the sampling rate"):
        with_drive(asked, {"r": replace(recording, channels={**recording.channels, "excitation_force": white})})
