"""What a fit is written as, from the command line and from Python: JSON, SSP parameter sets, lookup tables, C."""

import ctypes
import importlib
import json
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import mrfit
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.export.c_parts import parts_of
from mrfit.export.fmi_description import model_description
from mrfit.export.lookup import files as lookup_files
from mrfit.export.lookup import forward, inverted
from mrfit.export.source import source_of
from mrfit.export.ssv import drawn, intervals
from mrfit.export.ssv import files as ssv_files
from mrfit.export.stage import EXPORT_FORMATS, run
from mrfit.export.text import ascii_line
from mrfit.io.schemas.fit import Quantity
from mrfit.settings.export import Settings
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence
from tests.conftest import Run
from tests.export.rigs import rig

DT = 1e-3


def log(current: float, frequency: float, seed: int) -> pd.DataFrame:
    """A damper whose yield force and damping are straight lines of current."""
    t = DT * np.arange(2400)
    w = 2 * np.pi * frequency
    x, v = 0.01 * np.sin(w * t), 0.01 * w * np.cos(w * t)
    force = (150 + 200 * current) * np.tanh(80 * v + 40 * x) + (600 + 200 * current) * v + 300 * x + 10
    force = force + np.random.default_rng(seed).standard_normal(len(t))
    columns = {"time (s)": t, "displacement (m)": x, "velocity (m/s)": v, "current (A)": np.full(len(t), current)}
    return pd.DataFrame(columns | {"force (N)": force})


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    for k, (current, frequency) in enumerate([(0, 1), (0, 3), (1, 1), (1, 3), (2, 1), (2, 3)]):
        log(current, frequency, k).to_csv(folder / f"log{k}.csv", index=False, float_format="%.9g")
    return folder


@pytest.fixture(scope="module")
def fit(logs: Path) -> mrfit.FitResult:
    return mrfit.fit(mrfit.read(logs), model="tanh", per="all", name="damper")


@pytest.mark.parametrize("order", ["auto", "fy=sat1,c=1"])
def test_json_is_read_by_mrfit_and_by_a_script_without_it(order: str, logs: Path, tmp_path: Path) -> None:
    fit = mrfit.fit(mrfit.read(logs), model="tanh", per="all", current_order=order, name="damper")
    written = fit.export(tmp_path, to="json")
    assert written.errors == {"json": 0.0}
    again = mrfit.load(tmp_path / "damper.json")
    pd.testing.assert_frame_equal(again.params, fit.params)
    # an export of an export states the same fit
    again.export(tmp_path / "again", to="json")
    one, two = (json.loads((tmp_path / p).read_text())["export"] for p in ("damper.json", "again/damper.json"))
    assert one["sha256"] == two["sha256"] and one["parameters"] == two["parameters"]
    script = Path(__file__).with_name("read_json.py")
    assert len(script.read_text().splitlines()) <= 40
    command = [sys.executable, "-I", script, tmp_path / "damper.json"]
    assert float(subprocess.run(command, capture_output=True, text=True, check=True).stdout) < 1e-12


def test_a_fit_from_a_file_takes_its_logs_from_the_caller(fit: mrfit.FitResult, logs: Path, tmp_path: Path) -> None:
    fit.save(tmp_path / "saved.json")
    again = mrfit.load(tmp_path / "saved.json")
    with pytest.raises(DataError, match="^damper: its logs are not at hand"):
        again.export(tmp_path / "without", to="lookup")
    blind = again.export(tmp_path / "blind", to="c")
    assert blind.errors["c"] is None and "the fit's logs are not at hand" in blind.said["c"][0]
    seeing = again.export(tmp_path / "seeing", to="c", recordings=mrfit.read(logs))
    assert seeing.errors["c"] is not None and seeing.errors["c"] < 1e-9
    assert any("inputs as recorded instead of smoothed" in line for line in seeing.said["c"])
    assert sorted(p.name for p in (tmp_path / "blind").iterdir()) == ["damper.c", "damper.h"]
    with pytest.raises(ConfigError, match="^there is no option 'fmy': did you mean fmi?"):
        again.export(tmp_path, to="fmu", fmy=3)


def test_draws_have_the_intervals_widths_and_the_fit_s_correlation(fit: mrfit.FitResult, tmp_path: Path) -> None:
    fit.export(tmp_path, to="ssv", draws=100, seed=3)
    names = sorted(p.name for p in (tmp_path / "ssv").iterdir())
    assert len(names) == 100 and names[0] == "damper_001.ssv"
    space = {"ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues"}

    def values(path: Path) -> dict[str, float]:
        found = ElementTree.parse(path).getroot().findall("ssv:Parameters/ssv:Parameter", space)
        return {p.get("name", ""): float(p.find("ssv:Real", space).get("value")) for p in found}  # type: ignore

    table = fit.params[~fit.params["derived"]]
    assert values(tmp_path / "damper.ssv") == table["value"].to_dict()
    sets = pd.DataFrame([values(tmp_path / "ssv" / n) for n in names])
    assert list(sets) == list(table.index)
    widths = (table["high"] - table["low"]) / 2 / 1.96
    # a standard deviation of 100 draws is known to 7 %
    np.testing.assert_allclose(sets.std() / widths, 1.0, atol=0.3)
    # yield force and damping share the force at speed: one is more where the other is less
    assert sets["fy@2A"].corr(sets["c@2A"]) < -0.5
    again = tmp_path / "again"
    (again / "ssv").mkdir(parents=True)
    (again / "ssv" / "damper_1000.ssv").touch()
    (again / "ssv" / "mine.ssv").touch()
    fit.export(again, to="ssv", draws=100, seed=3)
    # draws of an earlier export are gone, other files stay
    assert sorted(p.name for p in (again / "ssv").iterdir()) == [*names, "mine.ssv"]
    assert (again / "ssv" / names[5]).read_bytes() == (tmp_path / "ssv" / names[5]).read_bytes()


def test_draws_hold_what_was_not_fitted() -> None:
    source = rig("dahl")
    (result,) = source.content.results
    first, *others = result.parameters
    rows = [replace(first, low=first.value * 0.9, high=first.value * 1.1)]
    rows += [replace(p, low=p.value, high=p.value, fixed=True) for p in others]
    content = replace(source.content, results=[replace(result, parameters=rows)])
    given = source_of(content, source.assembly, source.stretches)
    assert [row is not None for row in intervals(given)] == [True, False, False, False]
    sets = drawn(given, Settings(draws=2000))
    assert np.all(sets[:, 1:] == source.theta[1:])
    # damping is searched on a logarithmic scale: its draws are log-normal
    spread = np.std(np.log(sets[:, 0]))
    assert spread == pytest.approx(np.log(1.1 / 0.9) / 2 / 1.96, rel=0.05)


def test_draws_of_a_model_with_a_redundant_parameter_have_the_band_of_its_noise() -> None:
    # noise of 1 N on 1000 samples: least squares leaves a band of sqrt(7/1000) N, as the data see 7 of 8 parameters
    source = rig("boucwen", seconds=0.999)
    drive = source.drive(source.stretches[0])
    step = 1e-5 * np.abs(source.theta)
    jacobian = np.stack(
        [(source.assembly.simulate(drive, source.theta + sign * np.diag(step), DT) * sign) for sign in (1, -1)]
    ).sum(axis=0)
    root, values, _ = np.linalg.svd((jacobian / (2 * step[:, None])) * np.abs(source.theta)[:, None])
    assert values[6] / values[0] > 1e-4 > values[7] / values[0]
    covariance = (root[:, :7] / values[:7] ** 2) @ root[:, :7].T
    derived = source.assembly.derived
    slopes = (derived(source.theta + np.diag(step)) - derived(source.theta - np.diag(step))) / 2e-5
    half = 1.96 * np.sqrt(np.einsum("kd,kj,jd->d", slopes, covariance, slopes))
    at = derived(source.theta[None])[0]
    rows = [
        Quantity(name=d.name, value=a, low=a - h, high=a + h)
        for d, a, h in zip(source.spec.derived, at, half, strict=True)
    ]
    (result,) = source.content.results
    known = replace(source.content, results=[replace(result, derived=rows)])
    sets = drawn(replace(source, content=known), Settings(draws=400))
    outputs = source.assembly.simulate(drive, sets, DT)
    assert np.sqrt(np.mean(np.var(outputs, axis=0))) == pytest.approx(np.sqrt(7 / 1000), rel=0.1)
    # without any interval there is nothing to draw
    made = ssv_files(source, Settings())
    assert list(made.contents) == ["boucwen.ssv"] and made.said[0].startswith("No draws:")


def test_a_table_of_a_model_without_a_past_is_the_model() -> None:
    source = rig("biviscous", CurrentDependence((("fy", 1), ("C_inf", 1)), 0.1, 1.5), changes={"vy": 0.03})
    table = forward(source)
    v, current = (a.ravel() for a in np.meshgrid(*(a.at for a in table.axes), indexing="ij"))
    exact = source.simulate(np.stack([v, current]), DT)
    np.testing.assert_allclose(table.values.ravel(), exact, atol=1e-6 * np.ptp(exact))
    # the stated error is that of straight lines between breakpoints
    made = lookup_files(source, Settings())
    assert made.error is not None and 1e-6 < made.error < 5e-3


def test_a_table_of_a_loop_is_its_middle_and_says_what_it_loses() -> None:
    source = rig("hysteretic-regularised-bingham", changes={"vh": 0.02, "vy": 0.005})
    table = forward(source)
    v = table.axes[0].at
    both = [source.simulate(np.stack([v, np.full(len(v), sign)]), DT) for sign in (1.0, -1.0)]
    inner = slice(2, -2)
    np.testing.assert_allclose(table.values[inner], np.mean(both, axis=0)[inner], atol=2e-3 * np.ptp(both[0]))
    loop = np.max(np.abs(both[0] - both[1])) / 2 / source.output_range
    error = lookup_files(source, Settings()).error
    assert error is not None and error == pytest.approx(loop, rel=0.1)


def test_the_inverse_gives_the_current_where_one_does() -> None:
    changes = {"vy": 0.01, "fy@0.1A": 200.0, "fy@1.5A": 900.0}
    source = rig("biviscous", CurrentDependence((("fy", 1),), 0.1, 1.5), changes=changes)
    table = forward(source)
    inverse = inverted(source, table)
    assert inverse is not None and [a.name for a in inverse.axes] == ["velocity", "force"]
    v = np.full(50, table.axes[0].at[-3])
    at = np.linspace(0.15, 1.45, 50)
    force = source.simulate(np.stack([v, at]), DT)
    found = inverse(v, force)
    back = source.simulate(np.stack([v, found]), DT)
    assert np.abs(back - force).max() < 0.02 * source.output_range
    # beyond what any current gives it stays at the end of the range
    low, high = source.ranges["current"]
    ends = inverse(v[:2], np.array([-1e6, 1e6]))
    np.testing.assert_allclose(ends, [low, high])


def test_tables_in_c_are_those_in_csv(fit: mrfit.FitResult, tmp_path: Path) -> None:
    fit.export(tmp_path, to="lookup")
    command = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-shared", "-fPIC"]
    subprocess.run([*command, tmp_path / "damper_lookup.c", "-o", tmp_path / "t.so"], check=True)
    library = ctypes.CDLL(str(tmp_path / "t.so"))
    for name in ("lookup", "inverse"):
        table = pd.read_csv(tmp_path / f"damper_{name}.csv", comment="#")
        function = getattr(library, f"damper_{name}")
        function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * 2
        rows: Array = table.to_numpy()[:: max(len(table) // 200, 1)]
        got = [function(*row[:2]) for row in rows]
        np.testing.assert_allclose(got, rows[:, 2], atol=1e-6 * np.ptp(rows[:, 2]))


def test_the_same_fit_gives_the_same_bytes(fit: mrfit.FitResult, tmp_path: Path) -> None:
    formats = ["c", "json", "lookup", "modelica", "ssv"]
    for name in ("one", "two"):
        fit.export(tmp_path / name, to=formats, draws=3)
    one, two = (
        {p.relative_to(tmp_path / n): p.read_bytes() for p in (tmp_path / n).rglob("*") if p.is_file()}
        for n in ("one", "two")
    )
    assert one == two and len(one) == 16


def test_a_fit_of_conditions_asks_whose_parameters(logs: Path, tmp_path: Path) -> None:
    found = mrfit.fit(mrfit.read(logs), model="bingham", name="six")
    with pytest.raises(ConfigError, match=r"^six: has 6 sets of parameters; name one with --condition \(sine-1Hz"):
        found.export(tmp_path, to="json")
    chosen = found.content.results[4].condition
    found.export(tmp_path, to=["json", "lookup"], condition=chosen)
    model = json.loads((tmp_path / "six.json").read_text())["export"]
    assert model["condition"] == chosen
    given = found.params[found.params["condition"] == chosen]["value"]
    own = found.metrics[found.metrics["condition"] == chosen]
    stated = [line.strip().split(",")[0] for line in model["head"] if "RMSE" in line]
    words = {"train": "training", "holdout": "held out"}
    assert stated == [f"{words[row.role]}: RMSE {row.rmse:.4g} N" for row in own.itertuples()]
    assert {p["name"]: p["value"] for p in model["parameters"]} == given.loc[["fy", "C_inf", "f0"]].to_dict()
    with pytest.raises(ConfigError, match="^--condition 'nix': six has no parameters of it; there are sine-1Hz"):
        found.export(tmp_path, to="json", condition="nix")


def test_an_effect_is_left_out_where_it_is_named() -> None:
    source = rig("tanh+inertia+delay")
    kept = source_of(source.content, source.assembly, source.stretches, without=["delay"])
    assert kept.assembly.name == "tanh+inertia"
    values = dict(zip(source.spec.names, source.theta, strict=True))
    np.testing.assert_array_equal(kept.theta, [values[n] for n in kept.spec.names])
    with pytest.raises(ConfigError, match="^--without nix: the model is tanh[+]inertia[+]delay, which has no such"):
        source_of(source.content, source.assembly, source.stretches, without=["nix"])


@pytest.mark.parametrize(
    ("formats", "said"),
    [
        ([], "--to: name a format: c, fmu"),
        (["cc"], "--to cc: no such format; choose one of c, fmu"),
    ],
)
def test_formats_that_do_not_exist(formats: list[str], said: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=f"^{said}"):
        run(rig("bingham"), formats, tmp_path / "out", Settings())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"fmi": 1}, "fmi takes 2 or more, not 1"),
        ({"fmi": 4}, "fmi takes 3 or less, not 4"),
        ({"draws": 0}, "draws takes 1 or more, not 0"),
        ({"seed": "one"}, "seed takes a number, not 'one'"),
    ],
)
def test_options_out_of_their_limits(
    fit: mrfit.FitResult, options: dict[str, object], said: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=f"^{said}"):
        fit.export(tmp_path / "out", to="json", **options)
    assert not (tmp_path / "out").exists()


def test_a_format_that_fails_does_not_take_the_others(tmp_path: Path) -> None:
    source = rig("boucwen-flux")
    assembly = assemble("boucwen-flux+integrator-offset")
    broken = replace(source, assembly=assembly, theta=np.append(source.theta, 0.01))
    written = run(broken, ["json", "c"], tmp_path / "out", Settings())
    assert list(written.files) == ["json"] and (tmp_path / "out" / written.files["json"][0]).is_file()
    assert written.failed["c"].startswith("the effect integrator-offset has no C form")
    with pytest.raises(DataError, match="^the effect integrator-offset has no C form"):
        run(broken, ["c"], tmp_path / "alone", Settings())
    assert not (tmp_path / "alone").exists()


@pytest.mark.slow
def test_from_the_command_line(logs: Path, mrfit: Run, tmp_path: Path) -> None:
    assert mrfit("ingest", logs / "log0.csv", logs / "log1.csv").returncode == 0
    assert mrfit("fit", "--model", "tanh", "--per", "all", "--name", "d").returncode == 0
    done = mrfit("export", "--fit", "d", "--to", "c", "--to", "json", "--json")
    assert done.returncode == 0, done.stderr
    errors = [row["error"] for row in json.loads(done.stdout)["formats"]]
    assert errors[0] < 1e-9 and errors[1] == 0.0
    folder = tmp_path / "mrfit-work" / "export" / "d"
    assert sorted(p.name for p in folder.iterdir()) == ["d.c", "d.h", "d.json", "d_selftest.c"]
    head = " ".join((folder / "d.h").read_text().replace(" *", " ").split())
    for part in (
        "F = fy*tanh(a1*v + a2*x)",
        "from the fit d,",
        "SHA-256 of the fit",
        "velocity in m/s, -0.188",
        "training: RMSE",
        "Difference from the simulation in Python on",
        "inputs as recorded instead of smoothed change the output by",
        "tau 1 ms, 2 ms late:",
    ):
        assert part in head
    for arguments, code, said in (
        (("--fit", "nix", "--to", "c"), 1, "no fit named 'nix' (there are: d)"),
        (("--fit", "d", "--to", "nix"), 2, "--to nix: no such format"),
        (("--fit", "d", "--to", "fmu", "--fmi", "4"), 2, "--fmi"),
    ):
        done = mrfit("export", *arguments)
        assert done.returncode == code and said in done.stderr and len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("name", ["--> <x>", "a]]>&\"'", "\x00\u202e", "-", "--"])
def test_hostile_names_stay_in_their_attribute(name: str) -> None:
    source = replace(rig("dahl"), condition=name)
    results = [replace(source.content.results[0], condition=name)]
    source = replace(source, content=replace(source.content, name=name, results=results))
    made = ssv_files(source, Settings(draws=1))
    for text in made.contents.values():
        root = ElementTree.fromstring(text)
        assert len(root) == 2 and len(root[0]) == 4
    described = model_description(source, parts_of(source), "{0}", [name], 2)
    assert ElementTree.fromstring(described).get("modelName") == ascii_line(name)


def test_every_format_has_its_module() -> None:
    for module in EXPORT_FORMATS.values():
        assert callable(importlib.import_module(f"mrfit.export.{module}").files)
