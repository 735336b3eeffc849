"""The C form: equal to the simulation in Python, at any rate of steps, under a strict compiler and its sanitizers."""

import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.core import plugins, registry
from mrfit.core.specs import Array, Steps
from mrfit.errors import DataError
from mrfit.export.c import built, differs, driver, notes_of, rendered, user_inputs
from mrfit.export.c_parts import Parts, parts_of
from mrfit.export.causality import Cost, differentiated
from mrfit.export.compiler import CompiledModel, compiler
from mrfit.export.source import ExportSource
from mrfit.kernels.filters import level, level_of, times_of
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from tests.export.rigs import RECORD, STRENGTH, channels, effects_of, rig

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror", "-pedantic")
STRICT = (*WARNINGS, "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
RATES = (1e-3, 1e-4)
NO_COST = Cost((), 0.002)
EXACT = 1e-9
SELECTION = (
    "tanh+asymmetry+quadratic-drag+temperature+delay",
    "boucwen+coulomb-friction",
    "spencer+gain-drift",
    "lugre",
    "hammerstein-wiener",
    "hw-static+current-lag+residual-magnetism",
    "tanh+slow-release",
    "boucwen-flux+eddy-current+saturation",
)
DEPENDING = (
    ("tanh", "fy=2,c=1,a1=log1:0.5:2"),
    pytest.param("tanh", "fy=sat1,c=sat1:0.5:2,a1=1", marks=pytest.mark.slow),
    ("boucwen+asymmetry+temperature", "alpha=plain2,kappa=log1/0.7/1,n=plain1:0.5:2"),
    pytest.param("spencer", "2", marks=pytest.mark.slow),
)


@contextmanager
def program(source: ExportSource, options: Sequence[str] = STRICT) -> Iterator[CompiledModel]:
    parts = parts_of(source)
    with built(parts, rendered(source, parts, ["measured elsewhere"], NO_COST), options) as made:
        yield made


def shares(source: ExportSource, run: CompiledModel, drive: Array, dt: Steps) -> Array:
    """Differences (N,) from the simulation in Python as shares of the output's range."""
    wanted = source.simulate(drive, dt)
    off: Array = np.abs(run.run(user_inputs(source, drive), dt)[0] - wanted) / np.ptp(wanted)
    return off


def at_times(source: ExportSource, steps: Array) -> Array:
    """Return a smooth drive (C, N) at uneven times, whose stroke has the middle of the fit's logs."""
    times = times_of(steps)
    fine = channels(times[-1], 1e-5)
    signals = {n: np.interp(times, fine["time"], v) for n, v in fine.items()} | {"time": times}
    moved = level(source.stretches[0].inputs.get("displacement", np.zeros(1)))
    signals["displacement"] += moved - level_of(signals["displacement"], steps)
    return np.stack([signals[n] for n in source.spec.inputs])


def jittered(seed: int) -> Array:
    """Return steps (N,) of 0.1 to 3 ms."""
    return np.random.default_rng(seed).uniform(1e-4, 3e-3, 600)


def agrees(source: ExportSource, jitter: bool = True) -> None:
    with program(source) as run:
        if jitter:
            steps = jittered(4)
            assert shares(source, run, at_times(source, steps), steps).max() < EXACT
        if "velocity-hysteresis" not in source.assembly.name:
            for dt in RATES:
                signals = channels(1.0, dt)
                drive = np.stack([signals[n] for n in source.spec.inputs])
                assert shares(source, run, drive, dt).max() < EXACT
            return
    # the stroke's middle is that of the logs, which differs with their rate
    for dt in RATES:
        own = rig(source.assembly.name, source.dependence, dt=dt)
        with program(own) as run:
            assert shares(own, run, own.drive(own.stretches[0]), dt).max() < EXACT


# one of each way to keep what was: the buffer of a delay, the curve of a loop, filters, a state that is stepped
QUICK = ("tanh+asymmetry+quadratic-drag+temperature+delay", "boucwen+coulomb-friction", "hammerstein-wiener", "lugre")


@pytest.mark.parametrize("model", [pytest.param(m, marks=[pytest.mark.slow] * (m not in QUICK)) for m in SELECTION])
def test_is_the_simulation_at_1_and_10_kilohertz_and_at_uneven_steps(model: str) -> None:
    agrees(rig(model))


@pytest.mark.slow
@pytest.mark.parametrize("model", registry.names("model"))
def test_every_model_is_the_simulation(model: str) -> None:
    agrees(rig(model))


@pytest.mark.slow
@pytest.mark.parametrize(
    "model",
    [
        f"{base}+{effect}"
        for base in registry.names("model")
        for effect in effects_of(registry.load("model", base).SPEC)
    ],
)
def test_every_model_with_every_effect_is_the_simulation(model: str) -> None:
    agrees(rig(model))


@pytest.mark.parametrize(("model", "orders"), DEPENDING)
def test_parameters_follow_a_current_that_moves(model: str, orders: str) -> None:
    spec = registry.load("model", model.split("+")[0]).SPEC
    source = rig(model, CurrentDependence(orders_of(spec, orders), 0.2, 1.4))
    # the current leaves the tested range on both sides
    current = source.drive(source.stretches[0])[source.spec.inputs.index("current")]
    assert current.min() < 0.2 and current.max() > 1.4
    agrees(source)


def test_a_loop_that_depends_on_current_is_stepped_at_rest_and_when_the_current_moves() -> None:
    spec = registry.load("model", "boucwen").SPEC
    source = rig("boucwen", CurrentDependence(orders_of(spec, "kappa=1,n=1"), 0.2, 1.4))
    drive = source.drive(source.stretches[0]).copy()
    row = source.spec.inputs.index("current")
    moving = drive[row].copy()
    with program(source) as run:
        # at rest, at rest outside the range, resting until it moves, and stepping between two levels
        for current, bound in (
            # where it rests Python reads the branch curve, which is good to 3e-7
            (0.9, 1e-7),
            (3.0, 1e-7),
            (np.where(np.arange(1001) < 400, moving[0], moving), EXACT),
            (np.repeat([0.3, 1.1], [500, 501]), EXACT),
        ):
            drive[row] = current
            assert shares(source, run, drive, 1e-3).max() < bound


# What makes the force behind a filter a straight line between steps, as its inputs are: it never yields, or no delay
# puts a corner between two steps
STRAIGHT = {
    "biviscous+force-filter": {"vy": 1.0},
    "hammerstein-wiener": {"b": 0.5},
    "hw-static+current-filter": {"current-filter.tau": 0.0},
}


def jitters(model: str) -> None:
    """Steps are 1 to 30 tenths of a millisecond apart, inputs straight between them; Python follows every tenth."""
    source = rig(model, changes=STRAIGHT.get(model, {}))
    fine, times = 1e-4, np.cumsum(np.random.default_rng(4).integers(1, 31, 600))
    times -= times[0]
    smooth = channels(fine * times[-1], fine)
    signals = {n: np.interp(np.arange(times[-1] + 1), times, v[times]) for n, v in smooth.items()}
    drive = np.stack([signals[n] for n in source.spec.inputs])
    wanted = source.simulate(drive, fine)[times]
    with program(source) as run:
        got = run.run(user_inputs(source, drive[:, times]), np.diff(times, prepend=times[0]) * fine)[0]
    share = np.abs(got - wanted).max() / np.ptp(wanted)
    assert share < {"spencer": 1e-5, "lugre": 1e-5}.get(model, 1e-9)


@pytest.mark.parametrize("model", ["boucwen", "biviscous+force-filter", "hw-static+current-filter"])
def test_steps_may_jitter(model: str) -> None:
    jitters(model)


@pytest.mark.slow
@pytest.mark.parametrize("model", registry.names("model"))
def test_steps_of_every_model_may_jitter(model: str) -> None:
    jitters(model)


# Effects whose inputs are not straight between steps, and by what share of the range 1 to 30 tenths of a millisecond
# between steps are at most off those tenths
SMOOTH = {
    "tanh+coulomb-friction": 1e-5,
    "tanh+stribeck": 1e-5,
    "tanh+velocity-hysteresis": 5e-5,
    "tanh+delay": 1e-3,
    "hw-static+current-lag": 1e-6,
    "boucwen-flux+eddy-current": 1e-4,
}


def roughly(model: str) -> float:
    """Return the largest share by which uneven steps of a smooth drive are off the simulation at every tenth."""
    fine, times = 1e-4, np.cumsum(np.random.default_rng(4).integers(1, 31, 600))
    times -= times[0]
    source = rig(model, seconds=fine * times[-1], dt=fine)
    drive = source.drive(source.stretches[0])
    wanted = source.simulate(drive, fine)[times]
    with program(source) as run:
        got = run.run(user_inputs(source, drive[:, times]), np.diff(times, prepend=times[0]) * fine)[0]
    return float(np.abs(got - wanted).max() / np.ptp(wanted))


@pytest.mark.slow
@pytest.mark.parametrize("model", SMOOTH)
def test_a_smooth_drive_may_jitter(model: str) -> None:
    assert 1e-9 < roughly(model) < SMOOTH[model]


@pytest.mark.parametrize(
    ("model", "changes"),
    [
        *(
            pytest.param("tanh+delay", {"delay.tau": tau, "delay.s": 0.4}, marks=[pytest.mark.slow] * (tau > 2e-4))
            for tau in (2e-4, 0.0012, 0.003)
        ),
        pytest.param("hw-static+current-lag", {"current-lag.t_d": 0.0}, marks=pytest.mark.slow),
        ("hw-static+current-lag", {"current-lag.t_d": 4e-4}),
    ],
)
def test_short_times_are_those_of_the_simulation_too(model: str, changes: dict[str, float]) -> None:
    source = rig(model, changes=changes)
    with program(source) as run:
        assert shares(source, run, source.drive(source.stretches[0]), 1e-3).max() < EXACT


def test_floats_are_near() -> None:
    source = rig("boucwen+current-lag", CurrentDependence((("alpha", 1),), 0.1, 1.5))
    prefix = parts_of(source).context.p.upper()
    with program(source, (*STRICT, f"-D{prefix}_FLOAT")) as run:
        off = shares(source, run, source.drive(source.stretches[0]), 1e-3)
    assert 1e-9 < off.max() < 1e-4


def test_floats_are_near_where_a_loop_depends_on_current() -> None:
    spec = registry.load("model", "boucwen").SPEC
    source = rig("boucwen", CurrentDependence(orders_of(spec, "kappa=1,n=1"), 0.2, 1.4))
    drive = source.drive(source.stretches[0]).copy()
    row = source.spec.inputs.index("current")
    with program(source, (*STRICT, f"-D{parts_of(source).context.p.upper()}_FLOAT")) as run:
        for current in (drive[row], np.full(drive.shape[1], 0.9)):
            drive[row] = current
            assert 1e-9 < shares(source, run, drive, 1e-3).max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("model", ["tanh+delay", "neural-network"])
def test_late_values_suffice_at_any_rate(model: str) -> None:
    # at 40 kHz four steps share a place: what lies between them is interpolated
    source, dt = rig(model), 2.5e-5
    signals = channels(0.4, dt)
    drive = np.stack([signals[n] for n in source.spec.inputs])
    with program(source) as run:
        off = shares(source, run, drive, dt)
    assert off.max() < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("model", [*registry.names("model"), *SELECTION])
def test_floats_of_every_model_are_near(model: str) -> None:
    source = rig(model)
    with program(source, (*STRICT, f"-D{parts_of(source).context.p.upper()}_FLOAT")) as run:
        off = shares(source, run, source.drive(source.stretches[0]), 1e-3)
    assert off.max() < 1e-3


def test_inputs_that_were_never_seen_are_told() -> None:
    source = rig("tanh", CurrentDependence((("fy", 1),), 0.1, 1.5))
    drive = source.drive(source.stretches[0])
    rows = {n: k for k, n in enumerate(source.spec.inputs)}
    with program(source) as run:
        assert np.all(run.run(drive, 1e-3)[1] == 1)
        for name in rows:
            for factor in (1.1, -1.5):
                far = drive.copy()
                at = int(np.argmax(np.abs(drive[rows[name]])))
                far[rows[name], at] *= factor
                inside = run.run(far, 1e-3)[1]
                assert inside[at] == 0 and inside.sum() == len(inside) - 1


def test_values_that_are_no_numbers_leave_state_and_output() -> None:
    source = rig("boucwen")
    drive = source.drive(source.stretches[0])[:, :300]
    broken, steps = drive.copy(), np.full(300, 1e-3)
    broken[0, 100], broken[1, 101], steps[102] = np.nan, np.inf, 0.0
    with program(source) as run:
        whole, _ = run.run(np.delete(drive, [100, 101, 102], axis=1), 1e-3)
        got, inside = run.run(broken, steps)
    assert np.array_equal(np.flatnonzero(inside == 0), [100, 101, 102])
    assert np.all(got[100:103] == got[99])
    np.testing.assert_array_equal(np.delete(got, [100, 101, 102]), whole)


@pytest.mark.parametrize(
    "name",
    ["*/ int x = 1; /*", "x\\", "??/", "**//\n\x1b[31m\u202e", "int", "lugre", "é*/é", ""],
)
def test_hostile_names_stay_in_their_comment(name: str, tmp_path: Path) -> None:
    source = replace(rig("lugre"), condition=f"c {name}")
    source = replace(source, content=replace(source.content, name=name, data_sha256=f"{name}*/"))
    parts = parts_of(source)
    files = rendered(source, parts, [name], NO_COST)
    for file, text in files.items():
        (tmp_path / file).write_text(text)
        assert text.isascii() and re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).count("*/") == 0
    code = [tmp_path / file for file in files if file.endswith(".c")]
    subprocess.run(["gcc", "-std=c99", *WARNINGS, "-fsyntax-only", *code], check=True)
    if name == "*/ int x = 1; /*":
        with program(source, (*WARNINGS,)) as run:
            assert shares(source, run, source.drive(source.stretches[0]), 1e-3).max() < 1e-9


def test_every_model_has_a_form_and_every_effect_that_is_no_error_of_the_record() -> None:
    bases = {"force": "tanh", "flux": "boucwen-flux", "current": "stop-mmf"}
    specs = [registry.load("effect", e).SPEC for e in registry.names("effect") if e not in RECORD]
    effects = [f"{bases[s.outputs[0]]}+{s.name}" for s in specs]
    for model in (*registry.names("model"), *effects):
        assert parts_of(rig(model, seconds=0.1)).context.p


def test_an_effect_without_a_form_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(STRENGTH, "integrator-offset", (0.0,))
    with pytest.raises(DataError, match="^the effect integrator-offset has no C form: .*--without integrator-offset$"):
        parts_of(rig("boucwen-flux+integrator-offset", seconds=0.1))


PLUGIN = """
import numpy as np
from mrfit.core.plugins import model
from mrfit.core.specs import Param
from mrfit.kernels.theta import columns

@model(
    "my-damper", inputs=["velocity"], output="force",
    params=[
        Param("fy", "N", 1.0, 1e4, 100.0, "log", "yield", "yield force */"),
        Param("v0", "m/s", 1e-4, 1.0, 0.01, "log", text="speed at which it yields"),
        Param("c", "N*s/m", 1.0, 1e5, 500.0, "log", "viscous", "viscous damping"),
    ],
    equation="F = fy*(2/pi)*atan(v/v0) + c*v", linear=("fy", "c"),
)
def arctangent(drive, theta, dt):
    "Bingham body with an arctangent for its yield."
    fy, v0, c = columns(theta)
    return fy * (2 / np.pi) * np.arctan(drive[0] / v0) + c * drive[0]
"""
WITH_STATE = """
import math
import numpy as np
from mrfit.core.specs import ModelSpec, Param

SPEC = ModelSpec(
    name="my-dahl", title="Dahl friction", equation="F = c*v + fy*w", reference="none",
    inputs=("displacement", "velocity"), output="force",
    params=(
        Param("c", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "damping"),
        Param("fy", "N", 1.0, 1e6, 300.0, "log", "yield", "friction"),
        Param("rho", "1/m", 10.0, 1e6, 2000.0, "log", text="inverse of the travel"),
    ),
)

def rest(now, theta):
    return (0.0,)

def turned(w, travel, rho):
    # towards the side to which it moves
    side = math.copysign(1.0, travel)
    return side + math.exp(-rho * abs(travel)) * (w - side)

def step(state, before, now, theta, dt):
    (w,) = state
    then, (c, fy, rho) = theta
    w = turned(w, now[0] - before[0], 0.5 * (then[2] + rho))
    return c * now[1] + fy * w, (w,)

def response(drive, theta, dt):
    out = np.empty((len(theta), drive.shape[1]))
    for p, row in enumerate(theta):
        values = row if row.ndim == 2 else np.repeat(row[:, None], drive.shape[1], 1)
        then, now = tuple(values[:, 0]), tuple(drive[:, 0])
        state = rest(now, then)
        for j in range(drive.shape[1]):
            before, now, here = now, tuple(drive[:, j]), tuple(values[:, j])
            out[p, j], state = step(state, before, now, (then, here), 0.0 if j == 0 else dt)
            then = here
    return out
"""
WITH_WORDS = """
import math
from mrfit.core.specs import ModelSpec, Param
from mrfit.kernels.elements import response_of
from mrfit.kernels.jit import inlined
from mrfit.kernels.past import late

SPEC = ModelSpec(
    name="my-words", title="Names of C, of the printer and of the exported model", equation="none", reference="none",
    inputs=("displacement", "velocity"), output="force",
    params=(
        Param("curve", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "damping"),
        Param("first", "N", 1.0, 1e6, 300.0, "log", "yield", "friction"),
        Param("dt", "1/m", 10.0, 1e6, 2000.0, "log", text="inverse of the travel"),
    ),
)
LATE = 1

def longest(theta):
    return 0.004

def rest(now, theta):
    return now[1], 0.0, 0.0

@inlined
def turned(log, exp, my_words_real):
    if exp == 0.0:
        return log
    done = math.copysign(1.0, exp)
    return done + math.exp(-my_words_real * abs(exp)) * (log - done)

def step(state, before, now, theta, dt, past):
    signals, before_displacement, time = state
    then, (output, y, kept_1) = theta
    done = 0.5 * (then[2] + kept_1)
    result = turned(before_displacement, now[0] - before[0], done)
    if result > 0.5:
        return output * late(past, 0, 0.004, dt, now[1]) + y * result, (now[1], result, time + 0.1)
    s = output * now[1] + math.log(1.0 + abs(signals) + time)
    return s + y * result, (now[1], result, 0.5 * time)

response = response_of(SPEC, rest, step, LATE)
"""
SPRING = """
from mrfit.core.specs import EffectSpec, Param

SPEC = EffectSpec(
    name="my-spring", title="Spring that hardens", equation="F = F_base + k3*x^3", reference="none", slot="add",
    outputs=("force",), inputs=("displacement",),
    params=(Param("k3", "N/m^3", -1e9, 1e9, 0.0, text="cubic stiffness"),), neutral=(0.0,), aliases=(),
    experiment="none",
)

def term(channels, theta, dt):
    return theta[:, :1] * channels["displacement"] ** 3
"""


def used(folder: Path, monkeypatch: pytest.MonkeyPatch, **files: str) -> None:
    monkeypatch.setattr(plugins, "_store", plugins.Store())
    monkeypatch.setenv(plugins.VARIABLE, "")
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text)
        plugins.use(folder / f"{name}.py")


def test_plug_ins_are_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(STRENGTH, "my-spring", (4e8,))
    used(tmp_path, monkeypatch, mine=PLUGIN, dahl=WITH_STATE, words=WITH_WORDS, spring=SPRING)
    depending = CurrentDependence((("rho", 1), ("fy", 1)), 0.2, 1.4)
    agrees(rig("my-damper+asymmetry+gas-spring+my-spring"), jitter=False)
    for source in (rig("my-words+asymmetry"), rig("my-dahl+asymmetry"), rig("my-dahl", depending)):
        agrees(source)
    # comments of the functions stay
    parts = parts_of(source)
    text = rendered(source, parts, [], NO_COST)["my_dahl.c"]
    assert "/* towards the side to which it moves */" in text and "F = c*v + fy*w" in text
    # what a function of whole records makes of steps of their own length is not known
    whole = rig("my-damper")
    with pytest.raises(DataError, match="^the model my-damper is not simulated at uneven times"):
        whole.simulate(at_times(whole, jittered(1)), jittered(1))
    parts = parts_of(whole)
    assert differs(whole, parts, rendered(whole, parts, [], NO_COST)).uneven is None


def test_a_plug_in_outside_of_the_subset_is_one_line_with_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_sum = PLUGIN.replace("c * drive[0]\n", "c * np.cumsum(drive[0])\n")
    used(tmp_path, monkeypatch, mine=with_sum)
    line = 1 + with_sum.splitlines().index(next(k for k in with_sum.splitlines() if "cumsum" in k))
    with pytest.raises(DataError, match=rf"^mine.py:{line}: 'np.cumsum\(drive\[0\]\)' has no form in C: [^\n]*$"):
        parts_of(rig("my-damper"))


def test_the_differentiator_is_the_one_whose_cost_is_stated(tmp_path: Path) -> None:
    source = rig("hysteretic-biviscous")
    parts = parts_of(source)
    files = rendered(source, parts, [], NO_COST)
    prefix = parts.context.p
    main = f"""#include <stdio.h>
#include "{prefix}.h"
int main(void) {{
    {prefix}_differentiator d; {prefix}_inputs in; double row[2];
    {prefix}_differentiator_init(&d);
    while (fread(row, sizeof(double), 2, stdin) == 2) {{
        {prefix}_differentiate(&d, row[1], row[0], &in);
        row[0] = in.velocity; row[1] = in.acceleration;
        fwrite(row, sizeof(double), 2, stdout);
    }}
    return 0;
}}"""
    for name, text in {**files, "main.c": main}.items():
        (tmp_path / name).write_text(text)
    command = ["gcc", "-std=c99", *STRICT, tmp_path / f"{prefix}.c", tmp_path / "main.c", "-lm", "-o", tmp_path / "d"]
    subprocess.run(command, check=True)
    x = channels(1.0, 1e-3)["displacement"]
    rows = np.column_stack([np.full(len(x), 1e-3), x])
    answer = np.frombuffer(subprocess.run([tmp_path / "d"], input=rows.tobytes(), capture_output=True).stdout)
    for got, wanted in zip(answer.reshape(-1, 2).T, differentiated(x, 1e-3, NO_COST.tau), strict=True):
        np.testing.assert_allclose(got, wanted, atol=1e-9 * np.ptp(wanted))
    # it is late by 2 tau: 4 ms
    t = 1e-3 * np.arange(len(x))
    v = channels(1.0, 1e-3)["velocity"]
    late = np.interp(t - 4e-3, t, v)
    settled = t > 0.05
    assert np.std((answer.reshape(-1, 2)[:, 0] - late)[settled]) < 0.02 * np.std(v)
    assert np.std((answer.reshape(-1, 2)[:, 0] - v)[settled]) > 0.05 * np.std(v)


def test_the_self_test_passes_and_fails(tmp_path: Path) -> None:
    source = rig("dahl")
    parts = parts_of(source)
    prefix = parts.context.p
    files = rendered(source, parts, [], NO_COST)

    def passes(changed: dict[str, str]) -> bool:
        for name, text in changed.items():
            (tmp_path / name).write_text(text)
        sources = [tmp_path / f"{prefix}.c", tmp_path / f"{prefix}_selftest.c"]
        subprocess.run(["gcc", "-std=c99", *STRICT, *sources, "-lm", "-o", tmp_path / "t"], check=True)
        return subprocess.run([tmp_path / "t"], capture_output=True).returncode == 0

    assert passes(files)
    wrong = files[f"{prefix}.c"].replace("(b->c * in->velocity)", "(b->c * in->velocity * K(2.0))")
    assert not passes({**files, f"{prefix}.c": wrong})


def test_the_stroke_s_middle_is_that_of_the_logs() -> None:
    source = rig("tanh+velocity-hysteresis")
    (effect,) = parts_of(source).context.effects
    middle = float(effect.fields[-1].initial)
    assert middle == level(source.stretches[0].inputs["displacement"]) != 0.0
    assert any("middle of the stroke" in line for line in notes_of(source))


def test_what_is_early_is_exported_as_prompt_and_told(tmp_path: Path) -> None:
    source = rig("tanh+delay", changes={"delay.tau": -0.004})
    assert ["delay.tau is -0.004 s" in line for line in notes_of(source)] == [True]
    parts = parts_of(source)
    for name, text in rendered(source, parts, [], NO_COST).items():
        (tmp_path / name).write_text(text)
    code = [tmp_path / f"{parts.context.p}{end}.c" for end in ("", "_selftest")]
    subprocess.run(["gcc", "-std=c99", *WARNINGS, *code, "-lm", "-o", tmp_path / "t"], check=True)
    assert subprocess.run([tmp_path / "t"], capture_output=True).returncode == 0


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="no cppcheck")
@pytest.mark.parametrize(
    ("model", "orders"), [*((m, "") for m in (*SELECTION, "neural-network", "boucwen")), ("boucwen", "kappa=1,n=1")]
)
def test_cppcheck_finds_no_deviation_that_is_not_listed(model: str, orders: str, tmp_path: Path) -> None:
    spec = registry.load("model", model.split("+")[0]).SPEC
    source = rig(model, CurrentDependence(orders_of(spec, orders), 0.2, 1.4) if orders else None)
    parts: Parts = parts_of(source)
    files = rendered(source, parts, [], NO_COST)
    assert deviations_not_listed({**files, "driver.c": driver(parts)}, f"{parts.context.p}.c", tmp_path) == []


def deviations_not_listed(files: dict[str, str], name: str, folder: Path) -> list[str]:
    """Return what cppcheck and its addon for MISRA find in one of C files and docs/export.md does not list."""
    for file, text in files.items():
        (folder / file).write_text(text)
    command = ["cppcheck", "--addon=misra", "--std=c99", "--enable=warning,style,performance,portability", "-q"]
    done = subprocess.run([*command, name], cwd=folder, capture_output=True, text=True)
    page = (Path(__file__).parents[2] / "docs" / "export.md").read_text()
    listed = set(re.findall(r"^\| (\d+\.\d+) \|", page, flags=re.MULTILINE))
    found = set(re.findall(r"misra-c2012-(\d+\.\d+)", done.stderr))
    others = re.findall(r"^.*\[(?!misra)\w+\]$", done.stderr, flags=re.MULTILINE)
    return [*sorted(found - listed), *others]
