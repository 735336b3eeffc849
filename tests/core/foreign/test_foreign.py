"""Models of other people: a C function and an FMU give what the same equations give in numpy, and can be fitted."""

import json
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mrfit.core import plugins, registry
from mrfit.core.executors.order import in_processes
from mrfit.core.foreign import fmu as of_fmu
from mrfit.core.progress import silent
from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.simulate.assembly import assemble
from tests.core.foreign.compiled import FUNCTION, HEAD, PARAMETERS, compiled, fmu
from tests.plugin_files import run_python

DT = 1e-3
UNPACKED_BY_WORKERS = """
import tempfile
from pathlib import Path
from mrfit.core import plugins, registry
from mrfit.core.executors.order import in_processes
from mrfit.core.progress import silent

def unpacked(item, told):
    registry.load("model", "lagged")
    return sorted(p.name for p in Path(tempfile.gettempdir()).glob("mrfit-fmu-*"))

if __name__ == "__main__":
    registry.load("model", "lagged")
    print(*in_processes(unpacked, [1, 2, 3], 2, silent))
"""
V = 0.1 * np.sin(2 * np.pi * 3.0 * DT * np.arange(400))[None]
THETA = np.array([[100.0, 1000.0, 0.01], [300.0, 50.0, 0.002], [9.5e3, 50.0, 0.002]])


@pytest.fixture(autouse=True)
def store(monkeypatch: pytest.MonkeyPatch) -> None:
    """No plug-ins but those of the test."""
    monkeypatch.setattr(plugins, "_store", plugins.Store())
    monkeypatch.setenv(plugins.VARIABLE, "")


def in_numpy(v: Array, fy: float, c: float, tau: float) -> Array:
    """The same equations, written a second time."""
    z, force = 0.0, np.empty(len(v))
    for n in range(len(v)):
        z = (z + DT / tau * v[n]) / (1.0 + DT / tau) if n else 0.0
        force[n] = fy * np.tanh(v[n] / 0.01) + c * z
    return force


def c_model(folder: Path, table: str = '[c]\nlibrary = "lagged.so"\nfunction = "lagged"\n') -> Path:
    compiled(FUNCTION, folder / "lagged.so")
    path = folder / "lagged.toml"
    path.write_text(HEAD + table + PARAMETERS)
    return path


def fmu_model(folder: Path, three: bool) -> Path:
    pytest.importorskip("fmpy", reason="not run: FMPy is not installed (mrfit[fmu])")
    fmu(folder / "lagged.fmu", three)
    path = folder / "lagged.toml"
    path.write_text(HEAD + '[fmu]\nfile = "lagged.fmu"\nvariables = {velocity = "speed", force = "F"}\n' + PARAMETERS)
    return path


@pytest.mark.parametrize("kind", ["c", "fmu 2", "fmu 3"])
def test_it_gives_what_the_same_equations_give(kind: str, tmp_path: Path) -> None:
    plugins.use(c_model(tmp_path) if kind == "c" else fmu_model(tmp_path, kind == "fmu 3"))
    whole = assemble("lagged")
    found = whole.simulate(V, THETA, DT)
    for row, theta in zip(found[:2], THETA[:2], strict=True):
        np.testing.assert_allclose(row, in_numpy(V[0], *theta), rtol=1e-12, atol=1e-9)
    # the third says that it has diverged, and does the others no harm
    assert not np.isfinite(found[2]).all()
    np.testing.assert_array_equal(whole.simulate(V, THETA[:2], DT), found[:2])
    assert whole.spec.linear == ("fy", "c") and whole.spec.params[0].scale == "log"
    assert "slower than a model of mrfit's own" in whole.spec.caution

    def peak(k: int, told: object) -> float:
        return float(assemble("lagged").simulate(V, THETA[k : k + 1], DT).max())

    assert list(in_processes(peak, [0, 1], 2, silent)) == [float(row.max()) for row in found[:2]]


def test_effects_act_on_it_but_its_parameters_cannot_vary_within_a_test(tmp_path: Path) -> None:
    plugins.use(c_model(tmp_path))
    plain = assemble("lagged").simulate(V, THETA[:1], DT)
    moved = assemble("lagged+force-offset").simulate(V, np.column_stack([THETA[:1], [[7.0]]]), DT)
    np.testing.assert_allclose(moved, plain + 7.0, rtol=1e-14)
    with pytest.raises(ConfigError, match="the parameters of lagged cannot vary within a test"):
        registry.load("model", "lagged").response(V, np.repeat(THETA[:, :, None], 400, axis=2), DT)


def test_the_library_is_part_of_the_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, found = c_model(tmp_path), []
    for text in (FUNCTION, FUNCTION, FUNCTION.replace("0.01", "0.02")):
        compiled(text, tmp_path / "lagged.so")
        monkeypatch.setattr(plugins, "_store", plugins.Store())
        plugins.use(path)
        found.append(registry.digest("model", "lagged"))
    assert found[0] == found[1] != found[2]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (('function = "lagged"', 'function = "nothing"'), "lagged.so: has no function 'nothing'"),
        (('library = "lagged.so"', 'library = "none.so"'), "none.so: cannot be loaded"),
        (('unit = "s"', 'unti = "s"'), "lagged.toml: the key parameters.tau.unit is missing"),
        (('unit = "s"', 'unit = "s"\nunti = "s"'), "lagged.toml: unknown key parameters.tau.unti"),
        (("high = 0.1", 'high = "x"'), "lagged.toml: parameters.tau.high: .*got 'x'"),
        (("high = 0.1", "high = 1e-4"), r"lagged.toml: \[parameters.tau\] needs low < high, start between them"),
        (('"fy", "c"', '"fy", "d"'), "linear names 'd', which is no parameter"),
        (("[c]", "[c"), "lagged.toml: is not valid TOML"),
        (('[c]\nlibrary = "lagged.so"\nfunction = "lagged"\n', ""), r"needs either a \[c\] or an \[fmu\] table"),
        (('name = "lagged"', 'name = "tanh"'), "two models are called 'tanh': mrfit itself"),
    ],
)
def test_a_wrong_description_ends_in_one_line(change: tuple[str, str], told: str, tmp_path: Path) -> None:
    path = c_model(tmp_path)
    assert change[0] in path.read_text()
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(ConfigError, match=told) as error:
        plugins.use(path)
    assert "\n" not in str(error.value) and plugins.of_files() == []


def test_an_fmu_without_the_variable_or_none_at_all_is_refused(tmp_path: Path) -> None:
    path = fmu_model(tmp_path, three=False)
    text = path.read_text()
    path.write_text(text.replace('"speed"', '"v"'))
    with pytest.raises(ConfigError, match=r"has no variable 'v'; name it in \[fmu.variables\] \(it has speed, fy, c"):
        plugins.use(path)
    path.write_text(text)
    (tmp_path / "lagged.fmu").write_bytes(b"no archive")
    with pytest.raises(ConfigError, match="lagged.fmu: cannot be read as an FMU"):
        plugins.use(path)


def test_without_fmpy_the_message_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmpy", None)
    path = tmp_path / "lagged.toml"
    path.write_text(HEAD + '[fmu]\nfile = "lagged.fmu"\n' + PARAMETERS)
    with pytest.raises(ConfigError, match=r"lagged.fmu: an FMU needs FMPy; install it with: pip install 'mrfit\[fmu"):
        plugins.use(path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["c", "fmu 2"])
def test_it_is_fitted_and_the_fit_says_in_one_line_that_it_is_slow(kind: str, tmp_path: Path) -> None:
    path = c_model(tmp_path) if kind == "c" else fmu_model(tmp_path, False)
    t = np.arange(1200) * 5e-3
    v = 0.1 * np.cos(2 * np.pi * 2.0 * t)
    z, truth = 0.0, (250.0, 1200.0, 0.02)
    rows = []
    for n in range(len(t)):
        z = (z + 5e-3 / truth[2] * v[n]) / (1.0 + 5e-3 / truth[2]) if n else 0.0
        rows.append(f"{t[n]:.4f},{v[n]:.9f},{truth[0] * np.tanh(v[n] / 0.01) + truth[1] * z:.6f}\n")
    (tmp_path / "log.csv").write_text("time (s),velocity (m/s),force (N)\n" + "".join(rows))
    around = {"site": os.environ.get("PYTHONPATH", "")}
    assert run_python(tmp_path, "mrfit.cli", "ingest", "log.csv").returncode == 0
    command = ("fit", "--model", "lagged", "--plugin", path, "--per", "all", "--budget", "400", "--json")
    done = run_python(tmp_path, "mrfit.cli", *command, **around)
    assert done.returncode == 0, done.stderr
    fit = json.loads(done.stdout)
    values = [p["value"] for p in fit["results"][0]["parameters"]]
    assert values == pytest.approx(truth, rel=0.02)
    assert [w["kind"] for w in fit["warnings"]].count("slow-model") == 1


def archive(path: Path, members: int, size: int) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        for number in range(members):
            made.writestr(f"resources/{number}", b"\0" * size)
    return path


@pytest.mark.parametrize(
    ("most", "free", "told"),
    [
        ((10**6, 100), 10**9, r"unpacks to 0.0 GB in 3 files, more than the 0 GB in 100 that an FMU may have"),
        ((10**9, 2), 10**9, r"in 3 files, more than the 1 GB in 2 that"),
        (
            (10**9, 100),
            10**6,
            r"unpacks to 3 MB, more than half of the 1 MB free in .*; make room",
        ),
    ],
)
def test_an_fmu_that_unpacks_to_too_much_is_refused_before(
    most: tuple[int, int], free: int, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bomb = archive(tmp_path / "bomb.fmu", 3, 10**6)
    assert bomb.stat().st_size < 10_000
    of_fmu.check_size(bomb)
    monkeypatch.setattr(of_fmu, "MOST_BYTES", most[0])
    monkeypatch.setattr(of_fmu, "MOST_FILES", most[1])
    monkeypatch.setattr("shutil.disk_usage", lambda path: SimpleNamespace(free=free))
    with pytest.raises(ConfigError, match=told):
        of_fmu.check_size(bomb)


def test_an_fmu_that_is_refused_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("fmpy", reason="not run: needs the extra mrfit[fmu]")
    path = fmu_model(tmp_path, False)
    monkeypatch.setattr(of_fmu, "MOST_FILES", 1)
    monkeypatch.setattr("fmpy.extract", lambda *_, **__: pytest.fail("it was unpacked"))
    with pytest.raises(ConfigError, match="more than the 1 GB in 1 that an FMU may have"):
        plugins.use(path)


def test_an_unpacked_fmu_goes_with_its_process_and_those_of_its_workers(tmp_path: Path) -> None:
    pytest.importorskip("fmpy", reason="not run: needs the extra mrfit[fmu]")
    # a socket's path is short
    path, common = fmu_model(tmp_path, False), Path(tempfile.mkdtemp(prefix="mrfit-test"))
    program = tmp_path / "program.py"
    program.write_text(UNPACKED_BY_WORKERS)
    around = {**os.environ, "TMPDIR": str(common), "MRFIT_PLUGINS": str(path), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, program], env=around, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0 and "mrfit-fmu-" in done.stdout, done.stderr
    # which fails where there is anything in it
    common.rmdir()
