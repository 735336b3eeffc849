"""What the commands that read logs, or put a fit to use, say of their answers."""

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import mrfit.ingest.growing
from mrfit.cli import apply, console, export, measure, watch
from mrfit.core.recording import Recording
from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.export import Exported, Format
from mrfit.measure.command_lag import CommandLag
from mrfit.measure.quasi_static import QuasiStatic
from mrfit.settings.ingest import Settings as IngestSettings
from mrfit.settings.sheet import Settings as SheetSettings
from mrfit.track.watch import LookAtTest, WatchedValue


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MRFIT_COLUMNS", "200")
    monkeypatch.setattr(console, "VERBOSITY", console.Verbosity())


FY = WatchedValue("fy", "N", 300.0, 290.0, 312.0, True)
OPEN = WatchedValue("c", "N*s/m", 900.0, None, 950.0, False)
LOOK = LookAtTest(4, 4.0, [FY, OPEN], False, 9)


@pytest.mark.parametrize(
    ("look", "line"),
    [
        (LOOK, "4 cycles, 4 s: fy 300 ± 11 N reached, c 900 open N*s/m; about 5 more cycles"),
        (replace(LOOK, needed=5), "4 cycles, 4 s: fy 300 ± 11 N reached, c 900 open N*s/m; about 1 more cycle"),
        (replace(LOOK, values=[FY], needed=4), "4 cycles, 4 s: fy 300 ± 11 N reached; the next look decides"),
        (replace(LOOK, values=[FY], needed=None), "4 cycles, 4 s: fy 300 ± 11 N reached"),
        (replace(LOOK, values=[FY], reached=True), "4 cycles, 4 s: fy 300 ± 11 N reached"),
        (LookAtTest(1, 1.0, [], False, None), "1 cycle, 1 s: nothing is determined"),
    ],
)
def test_a_look_at_a_test_says_what_is_reached_and_how_long_it_will_take(look: LookAtTest, line: str) -> None:
    assert watch._line(look) == line


def test_a_test_that_may_stop_says_what_that_saves_and_whether_the_rest_agrees(
    capsys: pytest.CaptureFixture[str],
) -> None:
    last = LookAtTest(4, 4.0, [FY], True, 4)
    agreeing = LookAtTest(16, 16.0, [replace(FY, value=311.0)], True, 4)
    for whole, said in (
        (agreeing, "75 % of the log saved; the whole log agrees with the intervals"),
        (replace(agreeing, values=[replace(FY, value=313.0)]), "75 % of the log saved; the whole log gives another fy"),
    ):
        answer = watch.WatchAnswer("a.csv", [LOOK, last], whole)
        watch._show(answer)
        assert capsys.readouterr().out.splitlines()[-1] == f"Stop after 4 steady cycles; {said}"
        watch._check(answer)
    watch._show(watch.WatchAnswer("a.csv", [last], None))
    assert capsys.readouterr().out.splitlines()[-1] == "Stop after 4 steady cycles"


@pytest.mark.parametrize(("needed", "end"), [(9, "; about 9 cycles would reach them"), (None, "")])
def test_a_test_that_has_not_told_enough_ends_in_an_error(
    needed: int | None, end: str, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = watch.WatchAnswer("a.csv", [replace(LOOK, needed=needed)], None)
    watch._show(answer)
    assert "Stop" not in capsys.readouterr().out
    with pytest.raises(DataError, match=re.escape(f"a.csv: the intervals are not reached in 4 s{end}") + "$"):
        watch._check(answer)


def test_a_growing_log_is_read_until_it_rests(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, steps = [0.0], iter([True, False, False, True, False, False, False, False, False])

    class Growing:
        """A log that grows at the first and at the fourth look, first without a record."""

        def __init__(self, log: Path, settings: object) -> None:
            self.record: str | None = None
            self.times = 0

        def grow(self) -> bool:
            self.times += 1
            self.record = f"record {self.times}" if self.times > 1 else None
            return next(steps)

    monkeypatch.setattr(mrfit.ingest.growing, "GrowingLog", Growing)
    monkeypatch.setattr(watch.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(watch.time, "sleep", lambda seconds: clock.__setitem__(0, clock[0] + seconds))
    found: Iterator[Any] = watch._followed(Path("a.csv"), IngestSettings(), 3.5 * watch.POLL)
    assert list(found) == ["record 4"]
    # a patience of three and a half polls ends at the fourth without rows
    assert clock[0] == pytest.approx(6 * watch.POLL)


def lag(name: str, late: float, dead: float | None) -> CommandLag:
    constant = None if dead is None else late - dead
    return CommandLag(
        recording=name, lag=late, dead_time=dead, time_constant=constant, response_time=None, measured_response=None,
        steps=0, gain=1.0, error=0.01,
    )  # fmt: skip


def test_lags_are_in_milliseconds_and_what_is_not_told_apart_is_explained(capsys: pytest.CaptureFixture[str]) -> None:
    measure._print_lags([lag("a", 0.0204, 0.005), lag("b", 0.0151, None)], "u", "i")
    shown = capsys.readouterr().out
    assert "20.4" in shown and "not told: a pure dead time and a pure lag fit alike" in shown
    assert shown.splitlines()[-1] == "Lag of i behind u in 2 logs: 15.1 to 20.4 ms"
    measure._print_lags([lag("a", 0.0204, 0.005)], "u", "i")
    shown = capsys.readouterr().out
    assert "a pure dead time" not in shown and shown.splitlines()[-1] == "Lag of i behind u in 1 log: 20.4 ms"


def test_values_that_look_the_same_are_said_once() -> None:
    assert measure._ends([1.00001, 1.00002]) == "1" and measure._ends([3.0, 1.0, 2.0]) == "1 to 3"


def test_a_fast_test_is_said_to_be_no_slow_one(capsys: pytest.CaptureFixture[str]) -> None:
    slow = SheetSettings().slow
    one = QuasiStatic(
        recording="a", stiffness=1e4, friction=50.0, offset=0.0, loss=1.0, peak_speed=slow, ways=4, spread=0.1
    )
    measure._print_quasi_static([one, replace(one, recording="b", peak_speed=1.1 * slow)])
    shown = capsys.readouterr()
    assert [line.partition(":")[0] for line in shown.err.splitlines()] == ["b"]
    assert shown.out.splitlines()[-1] == "Quasi-static test of 2 logs: stiffness 1e+04 N/m, friction 50 N"


def log(**channels: Any) -> Recording:
    return Recording("a", "a.csv", "0", "none", 1e-2, 0.0, channels, {})


def test_a_channel_that_is_not_there_is_told_with_those_that_are() -> None:
    record = log(displacement=np.arange(3.0), force=np.ones(3))
    assert measure.channel(record, "force").tolist() == [1.0, 1.0, 1.0]
    with pytest.raises(DataError, match=r"a.csv: no channel 'current'; there are displacement, force; a channel map"):
        measure.channel(record, "current")


@pytest.mark.parametrize(("logs", "sine"), [(None, ""), ([Path("a.csv")], "1:0.01")])
def test_a_motion_is_that_of_logs_or_of_a_sine(logs: list[Path] | None, sine: str) -> None:
    with pytest.raises(ConfigError, match="give logs whose motion to take, or --sine HZ:M"):
        apply.motions_of(logs, sine, 1e-3, None, SimpleNamespace(output="force"))  # type: ignore[arg-type]


def test_the_motion_of_a_written_sine_is_that_sine() -> None:
    (motion,) = apply.motions_of(None, "2:0.01:3", 1e-3, None, SimpleNamespace(output="force"))  # type: ignore[arg-type]
    x = np.asarray(motion.channels["displacement"])
    assert motion.dt == 1e-3 and len(x) == pytest.approx(1500, abs=1)
    assert float(np.ptp(x)) == pytest.approx(0.02, rel=1e-3)
    assert float(np.abs(motion.channels["velocity"]).max()) == pytest.approx(0.01 * 4.0 * math.pi, rel=1e-3)


def test_what_the_lag_costs_is_the_mean_over_laws_of_each_scheme_that_has_both() -> None:
    def cost(scheme: str, error: float | None, without: float | None) -> SimpleNamespace:
        return SimpleNamespace(scheme=scheme, error=error, without_lag=without)

    costs = [
        cost("both", 0.1, 0.02),
        cost("feedback", 0.4, None),
        cost("both", 0.3, 0.04),
        cost("feedforward", 0.5, 0.1),
    ]
    assert apply._lag_words(SimpleNamespace(lag_costs=costs)) == [  # type: ignore[arg-type]
        "The lag costs both: rms error 0.2 of the force, mean of all laws, 0.03 without lag",
        "The lag costs feedforward: rms error 0.5 of the force, mean of all laws, 0.1 without lag",
    ]


def test_currents_and_inversions_have_their_shares_in_percent(capsys: pytest.CaptureFixture[str]) -> None:
    shares = {"reached": 0.5, "above reach": 0.251, "below reach": 0.249}
    row = SimpleNamespace(
        motion="sine", samples=100, shares=shares, limited=0.125, greatest_error_where_reached=1.5, rms_error=2.5,
        explicit=True,
    )  # fmt: skip
    summary = SimpleNamespace(motions=[row], fit="f", notes=["a note"], page="page.html")
    apply._print_inversions("N", summary)  # type: ignore[arg-type]
    shown = capsys.readouterr().out
    assert all(part in shown for part in ("50.0 %", "25.1 %", "24.9 %", "12.5 %", "in closed form", "error (N)"))
    assert shown.splitlines()[-2:] == ["a note", "Page: page.html"]
    apply._print_inversions("N", replace_of(summary, motions=[replace_of(row, explicit=False)]))
    assert "by search" in capsys.readouterr().out
    known = SimpleNamespace(log="a", samples=9, known=2, range=1.0, rms_error=0.01, error=0.0123)
    apply._print_currents(replace_of(summary, logs=[known, replace_of(known, log="b", error=None)]))
    a, b = (line for line in capsys.readouterr().out.splitlines() if re.match(r"│ [ab] ", line))
    assert "1.23 %" in a and "–" in b


def replace_of(row: SimpleNamespace, **changes: Any) -> Any:
    return SimpleNamespace(**{**vars(row), **changes})


def exported(failed: dict[str, str]) -> Exported:
    files = [f"{k}.c" for k in range(6)]
    rows = [
        Format(format="c", files=files, said=["checked"], error=1e-12),
        Format(format="json", files=["a.json"], said=[], error=None),
    ]
    return Exported(fit="f", model="tanh", folder="out", formats=rows, failed=failed, outdated=["old", "older"])


def test_an_export_names_its_files_and_what_could_not_be_made(capsys: pytest.CaptureFixture[str]) -> None:
    export.show(exported({}))
    shown = capsys.readouterr().out
    assert "0.c, 1.c, 2.c, 3.c and 2 more" in shown and "c: checked" in shown
    assert shown.count("warning outdated: f: old; older") == 1
    assert shown.splitlines()[-1] == "Export of f: c, json; out"
    export.check_all_made(exported({}))
    with pytest.raises(DataError, match="the other formats are written, but not fmu: no compiler; ssv: no such"):
        export.check_all_made(exported({"fmu": "no compiler", "ssv": "no such"}))
    export.outdated({"a": "", "b": "why"})
    assert capsys.readouterr().out.count("warning") == 1
