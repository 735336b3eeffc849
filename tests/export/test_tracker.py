"""The tracker in C: equal to that in Python, under a strict compiler and its sanitizers, in double and in float."""

import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.export import fmu, matlab
from mrfit.export.c import built, tracker_files, tracker_source, user_inputs
from mrfit.export.c_parts import parts_of, prefix_of
from mrfit.export.compiler import compiler
from mrfit.export.source import ExportSource
from mrfit.export.text import LONGEST_SYMBOL
from mrfit.export.tracker import plan_of
from mrfit.settings.export import Settings
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from mrfit.track.run import track_log
from tests.export.rigs import channels, rig
from tests.export.test_c import NO_COST, STRICT, deviations_not_listed
from tests.export.test_matlab import OCTAVE

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

# The noise's standard deviation as a share of the output's range
NOISE, DT = 0.005, 1e-3
# With the published divisor the loop is 0.03 % of the flux: only rounding tells A and Lc apart there
LOOP = {"boucwen-flux": {"D": 0.1}, "boucwen-flux-n1n2": {"D": 0.1}}


def two_of(model: str) -> tuple[str, ...]:
    """Two parameters of a model: of what yields and damps, where it has such."""
    params, roles = registry.load("model", model).SPEC.params, ("yield", "viscous", "stiffness")
    ranked = [*(p.name for role in roles for p in params if p.role == role), *(p.name for p in params)]
    return tuple(dict.fromkeys(ranked))[:2]


CASES = (
    ("tanh", ("fy", "c"), ""),
    ("tanh+temperature", ("temperature.b_yield", "fy"), ""),
    ("boucwen", ("alpha", "c"), "alpha=1"),
    ("dahl", ("fy", "rho"), ""),
    ("lugre", ("Fc", "dF"), ""),
    pytest.param("boucwen", ("alpha", "c", "kappa"), "alpha=1", marks=pytest.mark.slow),
    pytest.param("biviscous", ("fy", "C_inf", "vy"), "", marks=pytest.mark.slow),
    *(
        pytest.param(m, two_of(m), "", marks=pytest.mark.slow)
        for m in registry.names("model")
        if m not in ("tanh", "lugre")
    ),
)


def noisy(model: str, orders: str) -> ExportSource:
    """A fit with a residual of known size."""
    spec = registry.load("model", model.partition("+")[0]).SPEC
    dependence = CurrentDependence(orders_of(spec, orders), 0.2, 1.4) if orders else None
    source = rig(model, dependence, changes=LOOP.get(model))
    (log,) = source.stretches
    noise = NOISE * source.output_range * np.random.default_rng(0).standard_normal(len(log.measured))
    return replace(source, stretches=(replace(log, measured=log.simulated + noise),))


def drive_of(source: ExportSource, names: Sequence[str], seconds: float = 1.0) -> tuple[Array, Array]:
    """Inputs (C, N), which rest for a while, and the output where parameters grow by a fifth after a third of it."""
    signals = {
        n: np.concatenate([v, np.full(500, v[-1] * (n not in RATES)), v]) for n, v in channels(seconds, DT).items()
    }
    signals["time"] = DT * np.arange(len(signals["time"]))
    drive = np.stack([signals[n] for n in source.spec.inputs])
    grown = source.theta.copy()
    grown[[k for p in plan_of(source, names).parameters for k in p.places]] *= 1.2
    first, then = source.simulate(drive, DT), replace(source, theta=grown).simulate(drive, DT)
    noise = NOISE * source.output_range * np.random.default_rng(1).standard_normal(len(first))
    return drive, np.where(np.arange(len(first)) > len(first) // 3, then, first) + noise


RATES = ("velocity", "angular_velocity", "acceleration")


def compiled_track(
    source: ExportSource, names: Sequence[str], drive: Array, measured: Array, options: Sequence[str]
) -> Array:
    """Output, whether parameters move, estimates and variances (A, N) of the tracker in C."""
    plan = plan_of(source, names)
    parts = parts_of(replace(source, prefix="own_tracker"), plan=plan)
    files = tracker_files(replace(source, prefix="own"), plan, NO_COST)
    with built(parts, files, options) as program:
        return program.run(np.vstack([user_inputs(source, drive), measured]), DT)


@pytest.mark.parametrize(("model", "names", "orders"), CASES)
def test_it_is_the_tracker_in_python(model: str, names: tuple[str, ...], orders: str) -> None:
    source = noisy(model, orders)
    plan, (drive, measured) = plan_of(source, names), drive_of(source, names)
    measured[800:820] = np.nan
    found = track_log(source, plan, dict(zip(source.spec.inputs, drive, strict=True)), measured, DT)
    got, size, values = compiled_track(source, names, drive, measured, STRICT), len(names), plan.column("value")
    # a model of currents never stands
    assert (found.chosen > 0).any() and found.moves.all() == (not plan.standing)
    np.testing.assert_array_equal(got[1] > 0.0, found.chosen > 0)
    # a value may come near to 0 on its way
    np.testing.assert_allclose(got[2 : 2 + size].T / values, found.values / values, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.sqrt(got[2 + size :]).T, found.deviations, rtol=1e-9)
    ahead = measured - found.innovations - got[0]
    np.testing.assert_allclose(ahead[np.isfinite(measured)], 0.0, atol=1e-9 * source.output_range)


@pytest.mark.parametrize(
    ("model", "names", "remembered"),
    [
        ("tanh+temperature", ("fy", "temperature.b_yield"), (False, False)),
        ("boucwen", ("alpha", "kappa"), (False, True)),
        ("lugre", ("Fc", "dF", "sigma2"), (True, True, False)),
        ("tanh+force-filter", ("fy",), (True,)),
    ],
)
def test_what_a_model_remembers_of_a_parameter_is_told(
    model: str, names: tuple[str, ...], remembered: tuple[bool, ...]
) -> None:
    assert tuple(p.remembered for p in plan_of(noisy(model, ""), names).parameters) == remembered


@pytest.mark.parametrize("names", [("Fc",), ("Fc", "dF")])
def test_a_parameter_of_a_memory_does_not_run_away(names: tuple[str, ...]) -> None:
    source = noisy("lugre", "")
    plan, (drive, measured) = plan_of(source, names), drive_of(source, names, 2.0)
    found = track_log(source, plan, dict(zip(source.spec.inputs, drive, strict=True)), measured, DT)
    factor = found.values[:, 0] / plan.parameters[0].value
    assert factor.max() < 1.35 and factor[-1] == pytest.approx(1.2, abs=0.01)
    assert np.sqrt(np.mean(found.innovations[-1000:] ** 2)) < 1.2 * plan.deviation


def test_floats_are_near() -> None:
    source, names = noisy("boucwen", ""), ("alpha", "c")
    drive, measured = drive_of(source, names)
    exact = compiled_track(source, names, drive, measured, STRICT)
    near = compiled_track(source, names, drive, measured, (*STRICT, "-DOWN_TRACKER_FLOAT"))
    assert np.abs(near[2:4] - exact[2:4]).max(axis=1) == pytest.approx(0.0, abs=5.0)
    assert np.abs((near[2:4, -1] - exact[2:4, -1]) / np.sqrt(exact[4:, -1])).max() < 0.2


def test_a_dead_time_is_refused() -> None:
    source = noisy("tanh+delay", "")
    with pytest.raises(ConfigError, match="by which delay is late"):
        plan_of(source, ("delay.tau",))


def in_c(source: ExportSource, names: Sequence[str], drive: Array, measured: Array) -> tuple[Array, Array]:
    """Output, whether they move, and estimates (2 + T, N), and variances (T, N), of the tracker in C."""
    found = compiled_track(source, names, drive, measured, ("-O2",))
    return found[: 2 + len(names)], found[2 + len(names) :]


@pytest.mark.parametrize("fmi", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_an_fmu_gives_what_the_c_does(fmi: int, tmp_path: Path) -> None:
    pytest.importorskip("fmpy", reason="an FMU needs FMPy: pip install 'mrfit[fmu]'")
    from tests.export.test_fmu import opened, validation

    source, names = noisy("tanh", ""), ("fy", "c")
    drive, measured = drive_of(source, names, 0.6)
    made = fmu.files(source, Settings(fmi=fmi, track=names)).contents
    assert sorted(made) == ["tanh_fit.fmu", "tanh_fit_tracker.fmu"]
    path = tmp_path / "tracker.fmu"
    path.write_bytes(made["tanh_fit_tracker.fmu"])
    assert validation.validate_fmu(str(path)) == []
    wanted = in_c(source, names, drive, measured)
    asked = ["force", "fy", "c", "cov(fy,fy)", "cov(c,c)", "cov(fy,c)"]
    with opened(path) as (slave, references):
        write, read = (slave.setFloat64, slave.getFloat64) if fmi == 3 else (slave.setReal, slave.getReal)
        inputs, outputs = [references[n] for n in (*source.channels, "measured_force")], [references[n] for n in asked]
        rows, got = np.vstack([user_inputs(source, drive), measured]).T.tolist(), list[list[float]]()
        for k, row in enumerate(rows):
            if k == 0 and fmi == 2:
                slave.setupExperiment(startTime=0.0)
            if k == 0:
                slave.enterInitializationMode()
            write(inputs, row)
            if k == 0:
                slave.exitInitializationMode()
            else:
                slave.doStep(currentCommunicationPoint=(k - 1) * DT, communicationStepSize=DT)
            got.append([*slave.getBoolean([references["moving"]]), *read(outputs)])
        slave.terminate()
    found = np.array(got).T
    np.testing.assert_allclose(found[[1, 0, 2, 3]], wanted[0], rtol=1e-12)
    np.testing.assert_allclose(found[4:6], wanted[1], rtol=1e-12)
    assert np.all(found[6] ** 2 < found[4] * found[5]) and found[0].any()


def test_no_function_of_matlab_is_defined_twice() -> None:
    for effect in ("current-lag", "delay", "force-filter", "residual-magnetism", "slip-lock", "temperature"):
        source = replace(noisy(f"tanh+{effect}", ""), prefix="own")
        plan = plan_of(source, ("fy",))
        text = matlab.function_file(source, parts_of(source, plan=plan), [""], plan)
        names = re.findall(r"^function (?:[^=(\n]*= )?(\w+)", text, re.MULTILINE)
        assert len(names) > 8 and len(set(names)) == len(names), effect


@pytest.mark.skipif(not OCTAVE, reason="no Octave")
@pytest.mark.parametrize(
    ("model", "names", "orders"),
    [("tanh+current-lag", ("fy", "c"), ""), ("boucwen", ("alpha",), "alpha=1")],
)
def test_matlab_gives_what_the_c_does(model: str, names: tuple[str, ...], orders: str, tmp_path: Path) -> None:
    source = noisy(model, orders)
    drive, measured = drive_of(source, names, 0.3)
    measured[200:210] = np.nan
    made = matlab.files(replace(source, prefix="own", stretches=source.stretches), Settings(track=names)).contents
    (tmp_path / "own_tracker.m").write_bytes(made["own_tracker.m"])
    given = ", ".join(f"r({k})" for k in range(1, len(source.channels) + 2))
    (tmp_path / "follow.m").write_text(
        f"rows = dlmread('in.txt'); state = []; out = [];\nfor k = 1:rows(end, 1)\nr = rows(k, 2:end);\n"
        f"[y, found, state] = own_tracker({given}, {DT}, state);\n"
        "out(end + 1, :) = [y, found.moving, found.value, diag(found.covariance)'];\nend\n"
        "file = fopen('out.txt', 'w'); fprintf(file, [repmat('%.17g ', 1, size(out, 2)), '\\n'], out'); fclose(file);\n"
    )
    samples = np.full(len(measured), len(measured))
    np.savetxt(tmp_path / "in.txt", np.column_stack([samples, *user_inputs(source, drive), measured]), fmt="%.17g")
    subprocess.run([OCTAVE, "--no-gui", "--norc", "--quiet", "follow.m"], cwd=tmp_path, check=True)
    found = np.loadtxt(tmp_path / "out.txt").T
    wanted = in_c(source, names, drive, measured)
    np.testing.assert_allclose(found[: 2 + len(names)], wanted[0], rtol=1e-9, atol=1e-9 * np.ptp(wanted[0][0]))
    np.testing.assert_allclose(found[2 + len(names) :], wanted[1], rtol=1e-7)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="no cppcheck")
@pytest.mark.parametrize(
    ("model", "names", "orders"),
    [("tanh+temperature", ("temperature.b_yield", "fy"), ""), ("boucwen", ("alpha", "c"), "alpha=1")],
)
def test_cppcheck_finds_no_deviation_that_is_not_listed(
    model: str, names: tuple[str, ...], orders: str, tmp_path: Path
) -> None:
    source = replace(noisy(model, orders), prefix="own")
    files = tracker_files(source, plan_of(source, names), NO_COST)
    assert deviations_not_listed(files, "own_tracker.c", tmp_path) == []


def test_the_files_of_a_tracker_end_alike_however_long_the_name_is() -> None:
    source, others = rig("tanh"), set()
    for name, files in (("tanh.auto.all", "tanh_auto_all_tracker"), ("my-slider+my-stop.auto.all", ""), ("a" * 99, "")):
        prefix = tracker_source(replace(source, prefix=name)).prefix
        assert prefix.endswith("_tracker") and len(prefix) <= LONGEST_SYMBOL and prefix_of(prefix) == prefix
        assert not files or prefix == files
        others.add(prefix)
    assert len(others) == 3
