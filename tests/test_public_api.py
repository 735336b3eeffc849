"""The face of the library: what the commands do, on recordings in memory."""

import doctest
import importlib
import inspect
import json
import pickle
import pydoc
import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import matplotlib.figure
import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from threadpoolctl import threadpool_limits

import mrfit
import mrfit.cli.main
import mrfit.discover.stage
import mrfit.fit.stage
import mrfit.ingest.stage
from mrfit.api.options import canonical, settings_of
from mrfit.api.recordings import several
from mrfit.core import registry
from mrfit.io import workspace as on_disk
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.reading import of_json
from tests.conftest import ROOT, Run

FY, SLOPE, DAMPING, MASS, NOISE = 300.0, 0.02, 900.0, 40.0, 0.5
SINES = ((1.0, 0.010), (2.0, 0.010), (3.0, 0.010), (2.0, 0.020))
DT = 1e-3

SCRIPT = """
import mrfit, pandas as pd
logs = mrfit.read(["logs/a.csv", "logs/b.csv"])
fit = mrfit.fit(logs, model="tanh", per="all")
print(fit)
print(fit.predict(mrfit.read("logs/d.csv")).nrmse)
frames = [pd.read_csv(path) for path in ("heavy/a.csv", "heavy/b.csv", "heavy/c.csv", "heavy/d.csv")]
found = mrfit.discover([mrfit.Recording.from_frame(f) for f in frames], model="tanh")
print(found)
"""


def damper(frequency: float, amplitude: float, mass: float, seed: int) -> pd.DataFrame:
    """A log of F = fy·tanh(v / v0) + c·v + m·a on a sine, with white noise."""
    time = np.arange(3000) * DT
    rate, phase = 2 * np.pi * frequency, 2 * np.pi * frequency * time
    stroke, speed = amplitude * np.sin(phase), amplitude * rate * np.cos(phase)
    force = FY * np.tanh(speed / SLOPE) + DAMPING * speed - mass * rate**2 * stroke
    force = force + NOISE * np.random.default_rng(seed).standard_normal(len(time))
    columns = {"time (s)": time, "displacement (m)": stroke, "velocity (m/s)": speed}
    return pd.DataFrame(columns | {"acceleration (m/s^2)": -(rate**2) * stroke, "force (N)": force})


def write_logs(folder: Path, mass: float) -> Path:
    folder.mkdir(parents=True)
    for k, (name, sine) in enumerate(zip("abcd", SINES, strict=True)):
        damper(*sine, mass, k).to_csv(folder / f"{name}.csv", index=False, float_format="%.9g")
    return folder


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("face")
    write_logs(folder / "logs", 0.0)
    write_logs(folder / "heavy", MASS)
    return folder


@pytest.fixture(scope="module")
def logs(place: Path) -> list[mrfit.Recording]:
    return mrfit.read(place / "logs")


@pytest.fixture(scope="module")
def fitted(logs: list[mrfit.Recording]) -> mrfit.FitResult:
    return mrfit.fit(logs, model="tanh", per="all")


def test_ten_lines_read_fit_print_predict_and_discover(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert len(SCRIPT.strip().splitlines()) <= 10
    monkeypatch.chdir(place)
    names: dict[str, Any] = {}
    exec(SCRIPT, names)
    printed = capsys.readouterr().out
    fit = names["fit"]
    for name, planted in (("fy", FY), ("c", DAMPING)):
        row = fit.params.loc[name]
        assert row.low <= planted <= row.high
        assert abs(row.value / planted - 1.0) < 0.01
        assert name in printed
    assert fit.success and fit.nfev > 10
    (nrmse,) = [float(line) for line in printed.splitlines() if re.fullmatch(r"[\d.e-]+", line)]
    assert nrmse < 2.0 * NOISE / np.ptp(names["logs"][1].channels["force"])
    found = names["found"]
    assert found.verdict == "named"
    (effect,) = found.effects
    (parameter,) = effect.parameters
    assert effect.name == "inertia" and parameter.low <= MASS <= parameter.high
    assert "inertia" in printed


def test_import_is_quick_and_loads_no_numpy() -> None:
    code = "import sys; before = set(sys.modules); import mrfit; print(*sorted(set(sys.modules) - before))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert loaded[0] == "mrfit" and len(loaded) <= 3, loaded
    seconds = []
    for _ in range(3):  # the quickest: another process may have had the processor
        done = subprocess.run(
            [sys.executable, "-X", "importtime", "-c", "import mrfit"], capture_output=True, text=True
        )
        own, whole = map(int, re.findall(r"\d+", done.stderr.splitlines()[-1])[:2])
        assert done.stderr.splitlines()[-1].endswith("| mrfit") and own <= whole
        seconds.append(1e-6 * whole)
    assert min(seconds) < 0.05, seconds


def test_every_name_of_the_face_is_there_and_no_other() -> None:
    for name in mrfit.__all__:
        assert callable(getattr(mrfit, name)), name
    assert set(mrfit.__all__) <= set(dir(mrfit))
    with pytest.raises(AttributeError, match="nosuch"):
        _ = mrfit.nosuch
    assert (ROOT / "mrfit" / "py.typed").is_file()


@pytest.mark.parametrize("room", ["fit", "discover", "compare", "models"])
def test_a_room_and_a_function_of_one_name_are_both_found(room: str) -> None:
    package = importlib.import_module(f"mrfit.{room}")
    called = getattr(mrfit, room)
    home = {"fit": "fitting", "discover": "discovery", "compare": "comparison", "models": "catalog"}[room]
    function = getattr(importlib.import_module(f"mrfit.api.{home}"), room)
    assert called is function and inspect.isfunction(called)
    # help() shows the function, not the package
    assert pydoc.plain(pydoc.render_doc(called)).splitlines()[2].startswith(f"{room}(")
    assert importlib.import_module(f"mrfit.{room}") is package
    assert pickle.loads(pickle.dumps(called)) is called
    if room != "models":
        assert called.stage is importlib.import_module(f"mrfit.{room}.stage")


def test_modules_of_a_room_are_imported_by_every_form_of_import() -> None:
    """In a process of its own, in which nothing is loaded yet."""
    lines = (
        "import mrfit.fit.stage as a",
        "import mrfit.fit.stage; b = mrfit.fit.stage",
        "from mrfit.fit import stage as c",
        "from mrfit import fit; d = fit.stage",
        "import mrfit.discover; assert callable(mrfit.discover)",
        "assert a is b is c is d and callable(mrfit.fit)",
    )
    assert subprocess.run([sys.executable, "-c", "; ".join(lines)], check=False).returncode == 0


@pytest.mark.parametrize("name", ["fit", "discover", "compare", "read"])
def test_help_explains_every_option(name: str) -> None:
    function = getattr(mrfit, name)
    told = inspect.getdoc(function) or ""
    kept = [n for n, p in inspect.signature(function).parameters.items() if p.kind is p.KEYWORD_ONLY]
    explained = dict(re.findall(r"^(\w+)(?:: .*)?\n    (\S.{9,})", told, re.MULTILINE))
    assert len(kept) > 5 and set(kept) <= set(explained), set(kept) - set(explained)


@pytest.mark.parametrize(
    ("name", "kind"), [("fit", mrfit.fit.stage.Settings), ("discover", mrfit.discover.stage.Settings)]
)
def test_a_default_of_the_signature_may_be_given(name: str, kind: Any) -> None:
    own = inspect.signature(getattr(mrfit, name)).parameters
    names = [f.name for f in fields(kind) if f.name != "model"]
    assert settings_of(kind, {n: own[n].default for n in names}, model="tanh") == kind(model="tanh")


def test_models_are_those_of_the_registry() -> None:
    assert list(mrfit.models().index) == registry.names("model")


CASES = [
    pytest.param(
        "datasets/coil-eddy", "boucwen-flux", {"optimizer": "lsq", "seed": 3}, id="coil", marks=pytest.mark.slow
    ),
    pytest.param(
        "logs", "tanh", {"per": "all", "weight": "floor", "budget": 300, "bounds": {"fy": (1, 5000)}}, id="damper"
    ),
]


@pytest.mark.parametrize(("folder", "model", "options"), CASES)
def test_a_fit_is_that_of_the_command_to_the_last_digit(
    folder: str, model: str, options: dict[str, Any], place: Path, tmp_path: Path, mrfit: Run
) -> None:
    import mrfit as face

    source = (ROOT if folder.startswith("datasets") else place) / folder
    for command in (["ingest", source], ["fit", "--model", model, "--name", "x", *_flags(options)]):
        done = mrfit(*command)
        assert done.returncode == 0, done.stderr
    stored = tmp_path / "mrfit-work" / "fits" / "x" / "fit.json"
    with threadpool_limits(limits=2, user_api="blas"):
        # as in a notebook, which has no command's one thread
        found = face.fit(face.read(source), model=model, name="x", **options)
    found.save(tmp_path / "own.json")
    own = json.loads((tmp_path / "own.json").read_text())
    assert own.pop("preparation")["resistance"] == (2.1 if "coil" in folder else None)
    assert own == json.loads(stored.read_text())
    log = next(source.glob("*.csv"))
    done = mrfit("predict", "--fit", "x", log, "--json")
    assert done.returncode == 0, done.stderr
    for one in (found, face.load(tmp_path / "own.json")):
        metrics = json.loads(done.stdout)["metrics"]
        pd.testing.assert_frame_equal(one.predict(face.read(log)).metrics, pd.DataFrame(metrics), rtol=0, atol=0)


def _flags(options: dict[str, Any]) -> list[str]:
    flags = []
    for name, value in options.items():
        pairs = [f"{n}={low}:{high}" for n, (low, high) in value.items()] if isinstance(value, dict) else [value]
        flags += [part for one in pairs for part in ("--opt" if name == "optimizer" else f"--{name}", str(one))]
    return flags


def test_fit_and_predict_write_nothing(
    logs: list[mrfit.Recording], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(on_disk, "write_atomic", lambda *_: pytest.fail("wrote a file"))
    found = mrfit.fit(logs[:2], model="bingham", optimizer="lsq")
    found.predict(logs[3])
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_discovery_is_that_of_the_command(place: Path, tmp_path: Path, mrfit: Run) -> None:
    import mrfit as face

    for command in (["ingest", place / "heavy"], ["discover", "--model", "tanh", "--seed", "1"]):
        done = mrfit(*command)
        assert done.returncode == 0, done.stderr
    found = face.discover(face.read(place / "heavy"), model="tanh", seed=1)
    found.save(tmp_path / "own.json")
    assert (tmp_path / "own.json").read_bytes() == (tmp_path / "mrfit-work/discover/discovery.json").read_bytes()
    again = face.load(tmp_path / "own.json")
    assert isinstance(again, face.Discovery) and again.to_json() == found.to_json()
    assert repr(again) == repr(found)
    drawn = [bar.get_width() for group in again.plot().axes[0].containers for bar in group]
    assert drawn[:1] == [pytest.approx(100.0 * found.gap.before)]


def test_a_discovery_on_too_few_data_has_nothing_to_draw(logs: list[mrfit.Recording]) -> None:
    with pytest.raises(mrfit.DataError, match="no errors to draw: no held-out condition"):
        mrfit.discover(logs[0], model="tanh").plot()


def test_a_discovery_on_too_few_data_says_what_is_lacking(logs: list[mrfit.Recording]) -> None:
    found = mrfit.discover(logs[0], model="tanh")
    assert found.verdict == "insufficient-data" and not found.effects
    assert found.advice[0] in repr(found).replace("No held-out", "no held-out")
    assert found.candidates.empty


@pytest.mark.slow
def test_a_comparison_ranks_the_planted_law_first_and_says_who_is_left_out(
    place: Path, tmp_path: Path, mrfit: Run
) -> None:
    import mrfit as face

    names = ["bingham", "tanh", "boucwen-flux"]
    for command in (["ingest", place / "logs"], ["compare", "--models", ",".join(names)]):
        done = mrfit(*command)
        assert done.returncode == 0, done.stderr
    found = face.compare(face.read(place / "logs"), models=names)
    assert found.best.model == "tanh" and list(found.table.index) == ["tanh", "bingham"]
    assert "no flux in this log" in found.left_out["boucwen-flux"]
    assert "left out boucwen-flux" in repr(found) and "<table" in found._repr_html_()
    stored = json.loads((tmp_path / "mrfit-work/compare/compare.json").read_text())
    own = found.to_json()
    for one in (stored, own):
        # whose message names the log by its path
        one.pop("left_out")
    assert json.loads(json.dumps(own)) == stored


def test_optimizers_are_compared_on_one_model(logs: list[mrfit.Recording]) -> None:
    found = mrfit.compare(logs, optimizers=["lsq", "pso"], model="bingham", seeds=2, budget=200)
    assert list(found.table.index) == ["lsq", "pso"]
    assert (found.table["best"] <= found.table["worst"]).all() and (found.table["seeds"] == 2).all()
    for wrong in ({"optimizers": "lsq"}, {"models": "tanh", "optimizers": "lsq", "model": "tanh"}):
        with pytest.raises(mrfit.ConfigError, match="on one model"):
            mrfit.compare(logs, **wrong)


def test_a_saved_fit_is_read_again(fitted: mrfit.FitResult, logs: list[mrfit.Recording], tmp_path: Path) -> None:
    fitted.save(tmp_path / "a.json")
    again = mrfit.load(tmp_path / "a.json")
    pd.testing.assert_frame_equal(again.params, fitted.params)
    pd.testing.assert_frame_equal(again.metrics, fitted.metrics)
    assert repr(again) == repr(fitted) and again.warnings == fitted.warnings
    again.save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    with pytest.raises(mrfit.DataError, match=r"predict\(recordings\)"):
        again.plot()
    assert again.predict(logs).nrmse == fitted.predict(logs).nrmse


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (None, "no such file"),
        ("{", "damaged"),
        ("time,force\n0,1\n", "neither a fit nor a discovery"),
        ('[{"schema": "mrfit.fit/1"}]', "neither a fit nor a discovery"),
        ("3", "neither a fit nor a discovery"),
        ('{"schema": "mrfit/fit/99"}', "does not know"),
        ("preparation", "drive"),
        ("parameter", "not all parameters"),
    ],
)
def test_a_fit_that_cannot_be_read_ends_in_one_line(
    text: str | None, told: str, fitted: mrfit.FitResult, tmp_path: Path
) -> None:
    path = tmp_path / "fit.json"
    content = json.loads(json.dumps(fitted.to_json()))
    if text == "preparation":
        content["preparation"]["segment"]["drive"] = 7
    if text == "parameter":
        content["results"][0]["parameters"].pop()
    if text is not None:
        path.write_text(json.dumps(content) if text.isalpha() else text)
    with pytest.raises(mrfit.DataError, match=told) as error:
        mrfit.load(path)
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_the_resistance_of_a_fits_logs_holds_for_logs_that_state_none(tmp_path: Path) -> None:
    time = np.arange(2500) * 4e-4
    current = 3.0 * np.sin(2 * np.pi * 5.0 * time)
    voltage = 2.0 * current + 0.02 * 2 * np.pi * 5.0 * 3.0 * np.cos(2 * np.pi * 5.0 * time)
    coil = {"current": current, "voltage": voltage}
    found = mrfit.fit(
        mrfit.Recording.from_arrays(dt=4e-4, **coil), model="boucwen-flux", optimizer="lsq", resistance=2.0
    )
    found.save(tmp_path / "fit.json")
    other = mrfit.Recording.from_arrays(dt=4e-4, **coil, condition={"resistance": 1.9})
    for fit in (found, mrfit.load(tmp_path / "fit.json")):
        # one that was given holds for all logs
        assert fit.predict(other).nrmse == found.predict(mrfit.Recording.from_arrays(dt=4e-4, **coil)).nrmse
    assert found.predict(other, resistance=1.9).nrmse > 2.0 * found.predict(other).nrmse


def test_figures_are_matplotlibs(fitted: mrfit.FitResult, logs: list[mrfit.Recording]) -> None:
    for kind in ("loop", "time-history", "residual"):
        figure = fitted.plot(kind)
        assert isinstance(figure, matplotlib.figure.Figure) and len(figure.axes) == len(logs)
    (axes,) = fitted.predict(logs[0]).plot("residual").axes
    assert 0.3 * NOISE < np.std(axes.lines[0].get_ydata()) < 3.0 * NOISE
    with pytest.raises(mrfit.ConfigError, match="kind takes .*loop"):
        fitted.plot("pie")
    with pytest.raises(mrfit.ConfigError, match="there are 1"):
        fitted.plot(page=1)


def test_tables_of_a_result(fitted: mrfit.FitResult, logs: list[mrfit.Recording]) -> None:
    assert {"value", "unit", "low", "high"} <= set(fitted.params.columns)
    assert fitted.params.loc["fy", "unit"] == "N"
    assert set(fitted.metrics.role) == {"train", "holdout"}
    prediction = fitted.predict(logs)
    assert prediction.nrmse == prediction.metrics.set_index("condition").loc["all", "nrmse"]
    samples = prediction.to_frame()
    rmse = float(np.sqrt(np.mean((samples["measured"] - samples["simulated"]) ** 2)))
    assert rmse == pytest.approx(prediction.metrics.iloc[-1].rmse, rel=1e-9)
    apart = mrfit.fit(logs[:2], model="bingham", optimizer="lsq")
    assert list(apart.params.loc["fy", "condition"]) == ["sine-1Hz-10mm", "sine-2Hz-10mm"]


def test_what_comes_from_files_is_escaped(fitted: mrfit.FitResult) -> None:
    evil = "<script>alert(1)</script>\x1b[31m"
    content = json.loads(json.dumps(fitted.to_json()).replace("sine-1Hz-10mm", "c1"))
    content["results"][0]["condition"] = evil
    content["metrics"] = [m | {"role": "train"} for m in content["metrics"]]
    content["results"][0]["warnings"] = [{"kind": "made", "text": evil}]
    content["results"][0]["parameters"][0]["unit"] = evil
    made = mrfit.FitResult(of_json(Fit, json.dumps(content)))
    assert "<script" not in made._repr_html_() and "&lt;script&gt;" in made._repr_html_()
    assert "\x1b" not in repr(made) + made._repr_html_()
    log = mrfit.Recording.from_frame(pd.DataFrame({"time": [0.0, 1.0, 2.0], evil: [1.0, 2.0, 3.0]}), name="x")
    assert "<script" not in log._repr_html_() and "\x1b" not in repr(log)


# how a command is called
ELSEWHERE = {"work", "as_json", "plugins", "on", "shared", "quiet", "verbose"}


def test_options_of_the_commands_are_those_of_the_functions() -> None:
    for name in ("fit", "discover"):
        command = set(inspect.signature(getattr(mrfit.cli.main, name)).parameters) - ELSEWHERE
        own = inspect.signature(getattr(mrfit, name)).parameters
        kind = {"fit": mrfit.fit.stage.Settings, "discover": mrfit.discover.stage.Settings}[name]
        assert set(canonical([kind], dict.fromkeys(command))) <= set(own), name


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"fix": {"fy": 1.0}, "fixed": {"fy": 2.0}}, "fix and fixed are one option: give one"),
        ({"budgett": 100}, "no option 'budgett': did you mean budget"),
        ({"per": "each"}, "per takes 'condition' or 'all', not 'each'"),
        ({"bounds": {"fy": 3.0}}, r"bounds fy takes \(low, high\)"),
        ({"bounds": [("fy", 1, 2)]}, "bounds takes a dictionary"),
        ({"start": {"nosuch": 1.0}}, "nosuch"),
        ({"start": {"fy": "many"}}, "start fy takes a number"),
        ({"fixed": {"fy": float("nan")}}, "not finite"),
        ({"seed": -1}, "seed takes 0 or more"),
        ({"budget": 1.5}, "budget takes a whole number"),
        ({"stall": "long"}, "stall takes a number"),
        ({"resistance": -2.0}, "not positive"),
        ({"optimizer": "nosuch"}, "unknown optimizer"),
        ({"holdout": "current=nosuch"}, "holdout"),
    ],
)
def test_a_wrong_option_ends_in_one_line(options: dict[str, Any], told: str, logs: list[mrfit.Recording]) -> None:
    with pytest.raises(mrfit.ConfigError, match=told) as error:
        mrfit.fit(logs, model="tanh", **options)
    assert "\n" not in str(error.value)


def test_options_may_have_the_commands_names(logs: list[mrfit.Recording]) -> None:
    own = mrfit.fit(logs[:1], model="bingham", optimizer="lsq", fixed={"f0": 0.0}, budget=np.int64(200))
    as_command = mrfit.fit(logs[:1], model="bingham", opt="lsq", fix={"f0": 0}, budget=200)
    assert own.to_json() == as_command.to_json()
    assert own.params.loc["f0", "fixed"] and own.params.loc["f0", "value"] == 0.0


@settings(max_examples=25, deadline=None)
@example(values=[0.0, 1.0, -1.0, -1.0, 0.0, -2.0], unit=("mm", 1e-3), dt=9.0)
@given(
    # below 999, the least number that stands for a missing one: ingest/meaning/marks.py
    st.lists(st.floats(-998.0, 998.0), min_size=3, max_size=50),
    st.sampled_from([("mm", 1e-3), ("inch", 0.0254), ("m", 1.0)]),
    st.floats(1e-5, 10.0),
)
def test_arrays_keep_their_values_in_si(values: list[float], unit: tuple[str, float], dt: float) -> None:
    given_values = np.array(values)
    log = mrfit.Recording.from_arrays(
        dt=dt, displacement=given_values, force=given_values, units={"displacement": unit[0]}
    )
    assert log.dt == dt and log.samples == len(values)
    np.testing.assert_allclose(log.channels["displacement"], given_values * unit[1], rtol=1e-12)
    np.testing.assert_array_equal(log.channels["force"], given_values)


def test_columns_of_one_letter_are_channels_in_si_and_this_is_said() -> None:
    time = np.arange(500) / 100
    wave = np.sin(6.0 * time)
    log = mrfit.Recording.from_frame(pd.DataFrame({"t": time, "x": wave, "v": 6.0 * wave, "F": 9.0 * wave}))
    assert dict(log.units) == {"displacement": "m", "velocity": "m/s", "force": "N"}
    np.testing.assert_array_equal(log.channels["velocity"], 6.0 * wave)
    said = [f.text for f in log.findings if f.kind == "unit-assumed"]
    assert any("'v' has no unit: taken as velocity in m/s" in text for text in said)
    assert all(text.replace("'", "&#x27;") in log._repr_html_() for text in said)
    # of a coil, v is the voltage; a unit that is given holds; a name of its own stays
    coil = mrfit.Recording.from_frame(pd.DataFrame({"t": time, "i": wave, "v": wave, "q": wave}))
    assert set(coil.channels) == {"current", "voltage", "q"}
    given_unit = mrfit.Recording.from_frame(pd.DataFrame({"t": time, "x": wave, "F": wave}), units={"x": "mm"})
    np.testing.assert_allclose(given_unit.channels["displacement"], wave / 1e3)
    # a channel that is there by its name keeps it
    both = mrfit.Recording.from_frame(pd.DataFrame({"t": time, "force": wave, "F": 2.0 * wave}))
    np.testing.assert_array_equal(both.channels["force"], wave)


def test_the_column_of_times_may_be_named() -> None:
    table = pd.DataFrame({"clock": np.arange(50) / 10, "t": np.ones(50), "force": np.arange(50.0)})
    log = mrfit.Recording.from_frame(table, time="clock")
    assert log.dt == pytest.approx(0.1) and list(log.channels) == ["force"]
    with pytest.raises(mrfit.ConfigError, match=r"time = 'when' is no column; there are clock, t, force$"):
        mrfit.Recording.from_frame(table, time="when")


def test_logs_without_a_name_are_told_apart() -> None:
    table = pd.DataFrame({"time": np.arange(50) / 10, "force": np.arange(50.0)})
    made = [mrfit.Recording.from_frame(table, condition={"current": k / 4}) for k in range(3)]
    assert [log.id for log in made] == ["current-0", "current-0.25", "current-0.5"]
    table.attrs["name"] = "press 7"
    assert mrfit.Recording.from_frame(table).id == "press-7"
    assert mrfit.Recording.from_frame(table, name="own").id == "own"
    assert len({log.id for log in several([mrfit.Recording.from_frame(table)] * 10)}) == 10


def test_a_result_is_shown_in_percent_with_units_and_plus_minus(fitted: mrfit.FitResult) -> None:
    shown = fitted._repr_html_()
    (whole,) = [m for m in fitted.content.metrics if m.condition == "all" and m.role == "train"]
    assert f"{100.0 * (whole.nrmse or 0.0):.3g} %" in shown and "identifiable" not in shown
    row = fitted.params.loc["fy"]
    value, half = re.search(r"<td>fy</td>\s*<td>([\d.]+) ± ([\d.]+) N</td>\s*<td>well</td>", shown).groups()  # type: ignore[union-attr]
    assert float(value) == pytest.approx(row.value, rel=1e-3)
    assert float(half) == pytest.approx((row.high - row.low) / 2.0, rel=0.05)


def frame(columns: dict[str, Any], index: Any = None) -> pd.DataFrame:
    return pd.DataFrame(columns, index=index)


def test_a_frame_may_have_its_times_in_a_column_or_in_its_index() -> None:
    time, force = np.arange(100) * 0.01, np.arange(100.0)
    stamps = pd.Timestamp("2024-05-01") + pd.to_timedelta(time, unit="s")
    for made in (
        mrfit.Recording.from_frame(frame({"Time (ms)": 1e3 * time, "Load (kN)": force / 1e3})),
        mrfit.Recording.from_frame(frame({"Force [N]": force}, stamps)),
        mrfit.Recording.from_frame(frame({"force": force}, pd.Index(time, name="time"))),
        mrfit.Recording.from_frame(frame({"when": stamps, "force": force}).rename(columns={"when": "time"})),
        mrfit.Recording.from_frame(frame({"force": force}), dt=0.01),
    ):
        assert made.dt == pytest.approx(0.01, rel=1e-9)
        np.testing.assert_allclose(made.channels["force"], force, atol=1e-9)
        assert made.units["force"] == "N"
    back = made.to_frame()
    assert list(back.columns) == ["force"] and back.index[-1] == pytest.approx(0.99)


@pytest.mark.parametrize(
    ("columns", "options", "kind", "told"),
    [
        ({"force": [1.0, 2.0, 3.0]}, {}, mrfit.ConfigError, "give dt"),
        ({"force": [1.0, 2.0, 3.0]}, {"dt": 0.0}, mrfit.ConfigError, "no sample interval"),
        (
            {"force": [1.0, 2.0, 3.0]},
            {"dt": 1.0, "units": {"load": "N"}},
            mrfit.ConfigError,
            "'load', which is no column",
        ),
        ({"force": ["a", "b", "c"]}, {"dt": 1.0}, mrfit.DataError, "no number"),
        ({"force": [1.0, 2.0, 3.0]}, {"dt": 1.0, "units": {"force": "mm"}}, mrfit.DataError, "mm"),
        ({"time": [0, 1, 2, 3, 4, 500, 501, 502], "force": range(8)}, {}, mrfit.DataError, "2 stretches"),
        ({"force": [np.nan, np.nan, np.nan]}, {"dt": 1.0}, mrfit.DataError, "no number"),
    ],
)
def test_a_frame_that_is_no_log_ends_in_one_line(
    columns: dict[str, Any], options: dict[str, Any], kind: type[Exception], told: str
) -> None:
    with pytest.raises(kind, match=told) as error:
        mrfit.Recording.from_frame(frame(columns), name="made", **options)
    assert str(error.value).startswith("made") and "\n" not in str(error.value)


def test_arrays_of_different_lengths_are_refused() -> None:
    with pytest.raises(mrfit.DataError, match="displacement 3, force 4"):
        mrfit.Recording.from_arrays(dt=1.0, displacement=np.zeros(3), force=np.zeros(4))
    with pytest.raises(mrfit.DataError, match=r"shape \(2, 3\)"):
        mrfit.Recording.from_arrays(dt=1.0, force=np.zeros((2, 3)))


def test_a_frame_is_read_as_its_file(place: Path, logs: list[mrfit.Recording]) -> None:
    made = mrfit.Recording.from_frame(pd.read_csv(place / "logs" / "a.csv"), name="a")
    (same,) = (r for r in logs if r.id == "a")
    assert made.dt == same.dt and made.units == same.units
    for name, values in same.channels.items():
        np.testing.assert_array_equal(made.channels[name], values)


def test_patterns_folders_and_single_files_are_read(place: Path) -> None:
    ids = ["a", "b", "c", "d"]
    for paths in (place / "logs", str(place / "logs" / "*.csv"), [place / "logs" / f"{i}.csv" for i in reversed(ids)]):
        assert [r.id for r in mrfit.read(paths)] == ids
    with pytest.raises(mrfit.ConfigError, match="matches nothing"):
        mrfit.read(place / "logs" / "*.tdms")
    with pytest.raises(mrfit.DataError, match="no such file"):
        mrfit.read(place / "nosuch.csv")


def test_a_file_that_cannot_be_read_is_warned_of_and_the_others_are_read(place: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_bytes(bytes(range(256)))
    with pytest.warns(UserWarning, match=r"left out .*bad\.csv"):
        found = mrfit.read([place / "logs" / "a.csv", bad])
    assert [r.id for r in found] == ["a"]


def test_long_logs_are_in_memory_once_read(place: Path) -> None:
    whole = mrfit.read(place / "logs" / "a.csv")[0]
    small = mrfit.ingest.stage.Settings(block=4096, jobs=1)
    (read,) = mrfit.ingest.stage.read([place / "logs" / "a.csv"], small).recordings
    for name, values in whole.channels.items():
        assert type(read.channels[name]) is np.ndarray
        np.testing.assert_array_equal(read.channels[name], values)


def test_recordings_of_one_name_are_told_apart(logs: list[mrfit.Recording]) -> None:
    frames = [r.to_frame().reset_index() for r in logs]
    found = mrfit.fit([mrfit.Recording.from_frame(f) for f in frames], model="bingham", optimizer="lsq", per="all")
    segments = [s.id for s in found.content.results[0].segments]
    assert len(set(segments)) == len(segments) == len(logs)
    for wrong in ([], ["logs/a.csv"]):
        with pytest.raises(mrfit.ConfigError, match="recording"):
            mrfit.fit(wrong, model="bingham")


def test_progress_is_told(logs: list[mrfit.Recording]) -> None:
    heard: list[str] = []
    mrfit.fit(logs[:1], model="bingham", optimizer="lsq", progress=lambda what, done, total: heard.append(what))
    assert heard[0] == "segment" and any("best" in what for what in heard)


def test_examples_in_docstrings_print_what_they_say() -> None:
    tried = 0
    for path in sorted((ROOT / "mrfit" / "api").glob("*.py")):
        module = importlib.import_module(f"mrfit.api.{path.stem}" if path.stem != "__init__" else "mrfit.api")
        result = doctest.testmod(module)
        assert result.failed == 0, path
        tried += result.attempted
    assert tried >= 10
