import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit.flux.stage as stage
from mrfit.core.recording import Recording
from mrfit.errors import ConfigError, DataError
from mrfit.flux.stage import Settings, last_resistance, last_settings, reconstruct, run
from mrfit.io.workspace import Workspace, read_json
from tests.flux.records import coil, files_under, recording, workspace

OWN = {"resistance": 2.0}


def log(frequency: float = 5.0, amplitude: float = 3.0, own: bool = True, **planted: float) -> Recording:
    channels = coil(frequency, amplitude, **planted)
    kept = {n: channels[n] for n in ("voltage", "current")}
    return recording(f"coil-{frequency:g}Hz-{amplitude:g}A", 1 / (frequency * 500), kept, OWN if own else None)


@pytest.mark.parametrize(("rule", "tolerance"), [("trapezoid", 1e-4), ("simpson", 1e-7)])
def test_the_flux_of_a_planted_voltage_is_found(rule: str, tolerance: float, tmp_path: Path) -> None:
    made = workspace(tmp_path, [log()])
    run(made, Settings(rule=rule))
    flux = made.read_recording("coil-5Hz-3A", "flux").channels["flux"]
    truth = coil(5.0, 3.0)["truth"]
    assert np.max(np.abs(flux - truth)) < tolerance * np.max(np.abs(truth))


def test_the_history_says_what_was_done(tmp_path: Path) -> None:
    made = workspace(tmp_path, [log()])
    run(made, Settings())
    found = made.read_recording("coil-5Hz-3A", "flux")
    (line,) = found.history
    for word in ("R = 2 Ω", "recording's condition", "trapezoid", "λ0", "drift", "closure"):
        assert word in line
    assert found.units["flux"] == "Wb"
    assert found.condition["flux_resistance"] == 2.0


def test_the_summary_reports_the_loop(tmp_path: Path) -> None:
    summary = run(workspace(tmp_path, [log(loss=0.03)]), Settings())
    (row,) = summary.recordings
    assert row.action == "integrated"
    assert row.loop_area == pytest.approx(np.pi * 9 * 0.03, rel=1e-3)
    assert (row.frequency, row.amplitude) == pytest.approx((5.0, 3.0), rel=1e-4)
    assert row.closure_max < 1e-4
    assert row.loops[0].cycles == 8


def test_resistance_comes_from_the_setting_then_the_recording_then_the_data(tmp_path: Path) -> None:
    logs = [log(f, own=f < 2) for f in (1.0, 5.0, 10.0)]
    made = workspace(tmp_path, logs)

    def sources(settings: Settings) -> list[tuple[float, str]]:
        return [(round(r.resistance, 4), r.resistance_source.split()[0]) for r in run(made, settings).recordings]

    assert sources(Settings(resistance=1.9)) == [(1.9, "given")] * 3
    assert sources(Settings()) == [(2.0, "recording's"), (2.0, "estimated"), (2.0, "estimated")]
    assert sources(Settings(fallback=2.2)) == [(2.0, "recording's"), (2.2, "fallback"), (2.2, "fallback")]
    assert sources(Settings(resistance="auto")) == [(2.0, "estimated")] * 3


def test_one_frequency_cannot_give_the_resistance(tmp_path: Path) -> None:
    made = workspace(tmp_path, [log(own=False)])
    before = files_under(tmp_path)
    with pytest.raises(DataError, match="coil-5Hz-3A.csv.*--resistance OHM"):
        run(made, Settings())
    assert files_under(tmp_path) == before


def test_a_damper_needs_no_resistance(tmp_path: Path) -> None:
    damper = log(own=False)
    damper = replace(damper, channels={**damper.channels, "force": damper.channels["current"]})
    made = workspace(tmp_path, [damper])
    found = run(made, Settings())
    assert (found.resistance, [r.action for r in found.recordings]) == (None, ["passed through"])
    assert "no flux linkage" in found.findings[0] and "--resistance OHM" in found.findings[0]
    assert reconstruct([damper], Settings()) == ([damper], None)
    assert run(made, Settings()).skipped
    assert run(made, Settings(resistance=2.0)).recordings[0].action == "integrated"


@pytest.mark.parametrize("value", [-2.0, 0.0, float("nan"), float("inf"), "two"])
def test_a_wrong_resistance_is_refused(value: float | str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--resistance"):
        run(workspace(tmp_path, [log()]), Settings(resistance=value))


def test_a_wrong_resistance_of_a_recording_names_its_file(tmp_path: Path) -> None:
    channels = coil(5.0, 3.0)
    bad = recording("bad", 1e-3, {n: channels[n] for n in ("voltage", "current")}, {"resistance": -1.0})
    with pytest.raises(ConfigError, match="bad.csv"):
        run(workspace(tmp_path, [bad]), Settings())


@pytest.mark.parametrize("settings", [Settings(drift="cycles"), Settings(rule="midpoint")])
def test_unknown_choices_are_listed(settings: Settings, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="choose one of"):
        run(workspace(tmp_path, [log()]), settings)


def test_recordings_without_coil_voltage_are_not_copied(tmp_path: Path) -> None:
    stroke = np.sin(np.arange(2000) / 50)
    damper = recording("damper", 1e-3, {"displacement": stroke, "force": 100 * stroke})
    made = workspace(tmp_path, [damper, log()])
    rows = {r.id: r.action for r in run(made, Settings()).recordings}
    assert rows == {"damper": "passed through", "coil-5Hz-3A": "integrated"}
    assert [p.name for p in (tmp_path / "flux").iterdir()] == ["coil-5Hz-3A.parquet"]
    assert np.array_equal(made.read_recording("damper", "flux").channels["force"], 100 * stroke)
    assert made.contents(rows, "flux") == {
        "damper": made.content("damper"),
        "coil-5Hz-3A": made.content("coil-5Hz-3A", "flux"),
    }
    assert made.content("coil-5Hz-3A", "flux") != made.content("coil-5Hz-3A")
    assert run(made, Settings()).skipped is True


def test_a_recording_that_is_no_longer_changed_leaves_no_flux_behind(tmp_path: Path) -> None:
    made = workspace(tmp_path, [log()])
    run(made, Settings())
    channels = log().channels
    workspace(tmp_path, [recording("coil-5Hz-3A", 4e-4, {"current": channels["current"]})])
    run(made, Settings())
    assert not list((tmp_path / "flux").iterdir())
    assert set(made.read_recording("coil-5Hz-3A", "flux").channels) == {"current"}


def test_a_measured_flux_is_kept(tmp_path: Path) -> None:
    channels = coil(5.0, 3.0)
    measured = recording(
        "measured", 1e-3, {**{n: channels[n] for n in ("voltage", "current")}, "flux": channels["truth"]}
    )
    made = workspace(tmp_path, [measured])
    (row,) = run(made, Settings()).recordings
    assert row.action == "measured flux kept"
    assert not list((tmp_path / "flux").iterdir())
    assert np.array_equal(made.read_recording("measured", "flux").channels["flux"], channels["truth"])


def test_nothing_is_done_twice(tmp_path: Path) -> None:
    made = workspace(tmp_path, [log()])
    first = run(made, Settings())
    before = {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*")}
    again = run(made, Settings())
    assert (first.skipped, again.skipped) == (False, True)
    assert replace(again, skipped=False) == first
    assert {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*")} == before
    assert run(made, Settings(rule="simpson")).skipped is False


def test_a_lost_file_is_made_again(tmp_path: Path) -> None:
    made = workspace(tmp_path, [log()])
    run(made, Settings())
    made.recording_file("coil-5Hz-3A", "flux").unlink()
    assert run(made, Settings()).skipped is False
    assert made.recording_file("coil-5Hz-3A", "flux").is_file()


def test_a_failure_while_writing_leaves_the_workspace_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = workspace(tmp_path, [log(), log(amplitude=2.0)])
    run(made, Settings())
    before = files_under(tmp_path)
    calls = []

    def fails(self: Workspace, *arguments: object) -> None:
        calls.append(arguments)
        if len(calls) == 2:
            raise DataError("disk full")

    monkeypatch.setattr(Workspace, "write_recording", fails)
    with pytest.raises(DataError, match="disk full"):
        run(made, Settings(rule="simpson"))
    assert files_under(tmp_path) == before


class Killed(BaseException):
    """The process is gone: nothing after it touches the disk."""


def dying(call: Callable[..., Any], left: list[int]) -> Callable[..., Any]:
    """Return a call that is carried out ``left[0]`` times, counted over all that share the list, and then kills."""

    def carried_out(*arguments: Any, **options: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise Killed
        return call(*arguments, **options)

    return carried_out


def test_a_kill_at_any_step_keeps_the_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings, before, after = Settings(resistance=2.5, drift="linear"), tmp_path / "before", tmp_path / "after"
    run(workspace(before, [log()]), settings)
    shutil.copytree(workspace(before, [log(1.0)]).root, after)  # another log takes its place
    run(Workspace(after), settings)
    kills = 0
    for steps in range(100):
        made = Workspace(shutil.copytree(before, tmp_path / str(steps)))
        left = [steps]
        try:
            with monkeypatch.context() as patched:
                for owner, name in ((Path, "replace"), (Path, "unlink"), (shutil, "rmtree")):
                    patched.setattr(owner, name, dying(getattr(owner, name), left))
                run(made, last_settings(made))
        except Killed:
            kills += 1
        run(made, last_settings(made))
        assert last_settings(made) == settings
        assert files_under(made.root) == files_under(after)
        if left[0] >= 0:
            break
    assert kills >= 5


def test_settings_that_cannot_be_read_are_not_replaced_by_defaults(tmp_path: Path) -> None:
    made = workspace(tmp_path, [log()])
    run(made, Settings(resistance=2.5))
    stored = read_json(made.flux_json)
    others = {**stored, "key": "another's", "settings": {**stored["settings"], "window": 3}}
    for text in ('{"key": ', "[]", json.dumps(others)):
        made.flux_json.write_text(text)
        with pytest.raises(DataError, match=r"flux\.json: .*`mrfit flux --work .*` with the settings you want"):
            last_settings(made)
    assert run(made, Settings(resistance=2.5)).skipped is False


def test_a_change_of_bias_that_cannot_be_told_from_drift_is_a_finding(tmp_path: Path) -> None:
    channels = coil(5.0, 3.0)
    current = np.concatenate([channels["current"][:2100], 4 + channels["current"][:2100]])
    walk = np.random.default_rng(1).standard_normal(len(current))
    voltage = 2 * current + 0.1 * np.gradient(current, 4e-4) + 5 * walk
    made = workspace(tmp_path, [recording("steps", 4e-4, {"voltage": voltage, "current": current}, OWN), log()])
    (finding,) = run(made, Settings()).findings
    assert finding.startswith("steps: bias-change: ") and "--drift none" in finding
    assert run(made, Settings(drift="none")).findings == []


def test_the_same_input_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        run(workspace(tmp_path / name, [log(), log(1.0)]), Settings())
    assert files_under(tmp_path / "a") == files_under(tmp_path / "b")


def test_three_frequencies_give_the_separation_in_words(tmp_path: Path) -> None:
    logs = [log(f, loss=0.03, eddy=0.002) for f in (1.0, 5.0, 10.0)]
    summary = run(workspace(tmp_path, logs), Settings(resistance=2.1))
    (separation,) = summary.separation
    assert separation.resistance_error == pytest.approx(0.1, rel=1e-3)
    (text,) = summary.separation_text
    assert "static hysteresis" in text and "eddy" in text and "R used less the coil's is 0.1" in text


@pytest.mark.parametrize(
    ("loss", "eddy", "said"),
    [
        (0.03, 0.002, ""),
        (0.03, -0.002, "; eddy currents cannot give energy"),
        (-0.03, 0.002, "; hysteresis cannot give energy"),
        (-0.03, -0.002, "; hysteresis and eddy currents cannot give energy"),
    ],
)
def test_a_loss_that_nothing_can_have_is_said(loss: float, eddy: float, said: str, tmp_path: Path) -> None:
    logs = [log(f, loss=loss, eddy=eddy) for f in (1.0, 5.0, 10.0)]
    (text,) = run(workspace(tmp_path, logs), Settings()).separation_text
    assert said in text and ("cannot give energy" in text) == bool(said)


def test_loops_that_cannot_be_separated_say_why_in_one_line(tmp_path: Path) -> None:
    (text,) = run(workspace(tmp_path, [log(1.0), log(5.0)]), Settings()).separation_text
    assert "needs three frequencies" in text and text.endswith("there are 2 loops of 2")


def test_the_last_settings_and_resistance_are_remembered(tmp_path: Path) -> None:
    made = workspace(tmp_path, [log()])
    assert last_settings(made) == Settings() and last_resistance(made) is None
    run(made, Settings(resistance=1.5, drift="linear"))
    assert last_settings(made) == Settings(resistance=1.5, drift="linear")
    assert last_resistance(made) == 1.5


def test_progress_is_told_of_every_recording(tmp_path: Path) -> None:
    told = []
    run(workspace(tmp_path, [log(), log(1.0)]), Settings(), lambda *event: told.append(event))
    assert told == [("flux", 1, 2), ("flux", 2, 2)]


def test_the_shipped_coil_logs_give_their_resistance(datasets: Path, tmp_path: Path) -> None:
    logs = []
    for path in sorted((datasets / "coil").glob("*.csv")):
        head = path.read_text().splitlines()[:20]
        dt = next(float(line.split(",")[1]) for line in head if line.startswith("Sample Interval"))
        table = np.loadtxt(path, delimiter=",", skiprows=21)
        logs.append(recording(path.stem, dt, {"voltage": table[:, 1], "current": 10 * table[:, 2]}))
    summary = run(workspace(tmp_path, logs), Settings())
    assert summary.resistance == pytest.approx(2.1, rel=3e-4)
    assert len(summary.separation) == 5
    assert all(s.static > 10 * abs(s.eddy) for s in summary.separation)


def test_stage_name_is_the_folder(tmp_path: Path) -> None:
    run(workspace(tmp_path, [log()]), Settings())
    assert (tmp_path / stage.STAGE / "coil-5Hz-3A.parquet").is_file()
    assert not list(tmp_path.glob(".flux-*"))
