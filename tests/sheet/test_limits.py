"""Limits of a sheet: three verdicts with the guard band, cycles, batch, units, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from mrfit.errors import ConfigError
from mrfit.io.schemas.sheet import QuantityRow, SheetCondition
from mrfit.sheet.limits import batch_verdicts, decide, quantity_named, read_limits, verdict_of, verdicts

SHIPPED = sorted((Path(__file__).parents[2] / "datasets" / "limits").glob("*.toml"))


def written(folder: Path, text: str) -> Path:
    path = folder / "limits.toml"
    path.write_text(text)
    return path


def condition(value: float, half: float, cycles: list[float] | None = None, name: str = "Fmax+") -> SheetCondition:
    row = QuantityRow(
        name=name, unit="N", value=value, low=value - half, high=value + half, cycles=cycles or [], noise=half,
        greatest_deviation=max((abs(c / value - 1.0) for c in cycles or []), default=None),
    )  # fmt: skip
    return SheetCondition(
        unit="a", condition="sine-1Hz-10mm", recording="r", source="r.csv", waveform="sine", frequency=1.0, stroke=0.02,
        peak_velocity=0.06, current=None, temperature=None, cycles=5, samples_per_cycle=100.0, noise=1.0,
        quantities=[row], findings=[],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        (91, 99, "pass"),
        (89, 95, "cannot be judged"),
        (80, 89, "fail"),
        (80, 120, "cannot be judged"),
        (111, 112, "fail"),
    ],
)
def test_three_verdicts_and_the_guard(low: float, high: float, said: str) -> None:
    assert decide(((low + high) / 2.0, low, high), (90.0, 110.0)) == said
    # without a guard the value alone decides
    assert decide(((low + high) / 2.0, low, high), (90.0, 110.0), guard=False) in ("pass", "fail")


def test_at_a_limit_few_units_pass_or_fail_wrongly() -> None:
    rng = np.random.default_rng(7)
    truth = 110.0 * rng.uniform(0.98, 1.02, 20_000)
    seen = truth + rng.standard_normal(20_000)
    said = np.array([decide((v, v - 1.96, v + 1.96), (90.0, 110.0)) for v in seen])
    good = truth <= 110.0
    assert np.mean((said == "pass") & ~good) <= 0.025 and np.mean((said == "fail") & good) <= 0.025
    assert np.mean(said == "cannot be judged") > 0.1


def test_units_and_tolerances_are_read_in_si(tmp_path: Path) -> None:
    text = '[[limit]]\nquantity = "fmax-"\ntarget = 1.0\nunit = "kN"\ntolerance = "10 %"\ncycle_tolerance = 0.1\n'
    limits = read_limits(written(tmp_path, text))
    assert (limits.limit[0].target, limits.limit[0].cycle_tolerance) == (1000.0, 100.0)
    # the magnitude of a negative force
    [value, cycles] = verdicts(limits, "a", [condition(-950.0, 10.0, [-940.0, -960.0], "Fmax-")], [])
    assert (value.least, value.most, value.verdict) == (-1100.0, -900.0, "pass")
    assert cycles.level == "cycle" and cycles.value == pytest.approx(10.0) and cycles.verdict == "pass"


def test_a_cycle_far_from_the_others_fails(tmp_path: Path) -> None:
    limits = read_limits(written(tmp_path, '[[limit]]\nquantity = "Fmax+"\ncycle_tolerance = "15 %"\n'))
    for last, said in ((101.0, "pass"), (130.0, "fail"), (115.5, "cannot be judged")):
        [row] = verdicts(limits, "a", [condition(100.0, 1.0, [99.0, 100.0, last])], [])
        assert row.verdict == said


def test_the_mean_of_a_batch_has_its_own_tolerance(tmp_path: Path) -> None:
    text = '[[limit]]\nquantity = "Fmax+"\ntarget = 100.0\ntolerance = "15 %"\nbatch_tolerance = "10 %"\n'
    limits = read_limits(written(tmp_path, text))
    units = {str(k): [condition(112.0 + k, 1.0)] for k in range(2)}
    assert all(v.verdict == "pass" for own in units.values() for v in verdicts(limits, "a", own, []))
    [mean] = batch_verdicts(limits, units)
    assert mean.verdict == "fail" and mean.value == pytest.approx(112.5)
    assert mean.high is not None and mean.high - 112.5 == pytest.approx(np.hypot(1.0, 1.0) / 2.0)


def test_what_is_not_there_cannot_be_judged(tmp_path: Path) -> None:
    text = '[[limit]]\nquantity = "E"\nmost = 3\n[[limit]]\nquantity = "Fmax+"\ncondition = "tri*"\nleast = 1\n'
    rows = verdicts(read_limits(written(tmp_path, text)), "a", [condition(100.0, 1.0)], [])
    assert {r.verdict for r in rows} == {"cannot be judged"} and verdict_of(rows) == "cannot be judged"
    assert rows[1].reason == "no condition like 'tri*' has this quantity"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[limit]]\nquantity = "Fmaxx+"\nmost = 1', "there is no quantity 'Fmaxx+'; did you mean Fmax+?"),
        ('[[limit]]\nquantity = "E"\nmost = 1\nunit = "mm"', "'mm' is no unit of this quantity; give one of J"),
        ('[[limit]]\nquantity = "E"\nmost = 1\nunit = "blob"', "'blob' is no unit of this quantity"),
        ('[[limit]]\nquantity = "E"', "says no limit"),
        ('[[limit]]\nquantity = "E"\ntarget = 1', "target without tolerance"),
        ('[[limit]]\nquantity = "E"\ntarget = 1\ntolerance = "ten"', "tolerance takes a share"),
        ('[[limit]]\nquantity = "E"\ntolerance = 1.0\nmost = 2', "tolerance without a target"),
        ('[[limit]]\nquantity = "E"\ntarget = 1\ntolerance = -0.1', "tolerance is negative"),
        ('[[limit]]\nquantity = "E"\nleast = 3\nmost = 2', "least 3 is above most 2"),
        ('[[limit]]\nquantity = "E"\nmax = 1', "max is no key mrfit knows; it may be one of"),
        ("limit = []", "too few values"),
        ("limit = [", "is not valid TOML"),
    ],
)
def test_wrong_limits_are_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ConfigError) as caught:
        read_limits(written(tmp_path, text))
    message = str(caught.value)
    assert said in message and "\n" not in message and str(tmp_path) in message


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        read_limits(tmp_path / "none.toml")


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: p.stem)
def test_the_shipped_files_are_sound(path: Path) -> None:
    assert read_limits(path).limit


def test_names_are_found_whatever_their_case_and_minus() -> None:
    assert (quantity_named("f0−"), quantity_named("K_EFF"), quantity_named("x")) == ("F0-", "K_eff", None)
