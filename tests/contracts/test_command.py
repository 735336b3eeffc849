"""The contract suite on plug-ins: every check finds the item that breaks it, and the command's exit code says so."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrfit.contracts import effects, models, optimizers, readers
from mrfit.contracts.check import applying, broken
from mrfit.core import plugins
from mrfit.core.specs import DerivedQuantity, EffectSpec, ModelSpec, OptimizerSpec, Param, ReaderSpec
from tests.plugin_files import EXAMPLE, acme_log, run_python

EXAMPLES = [EXAMPLE / "mrfit_example" / f"{n}.py" for n in ("cubic_damper", "hardening_spring", "hooke", "acme")]
SPEC = ModelSpec(
    "own",
    "Own",
    "F = c*v + f0",
    "none",
    ("velocity",),
    "force",
    (Param("c", "N*s/m", 1.0, 1e3, 50.0, text="damping"), Param("f0", "N", -50.0, 50.0, 3.0, text="offset")),
    linear=("c", "f0"),
    rate_independent=False,
)


@pytest.fixture(autouse=True)
def store(monkeypatch: pytest.MonkeyPatch) -> None:
    """No plug-ins but those of the test."""
    monkeypatch.setattr(plugins, "_store", plugins.Store())
    monkeypatch.setenv(plugins.VARIABLE, "")


def line(drive: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    c, f0 = (theta[:, k, None] if theta.ndim == 2 else theta[:, k] for k in (0, 1))
    return c * drive[0] + f0


def faults(checks: Any, item: Any, *asked: str) -> set[str]:
    """Return the names of the checks that an item breaks, of all or of those asked for."""
    return {c.name for c in applying(checks, item) if (not asked or c.name in asked) and broken(c, item)}


def test_a_sound_model_keeps_all() -> None:
    assert faults(models.MODEL_CHECKS, SimpleNamespace(SPEC=SPEC, response=line)) == set()


def _noisy(drive: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    return line(drive, theta, dt) + 1e-9 * np.random.default_rng().standard_normal(drive.shape[1])


def _ahead(drive: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    return line(np.roll(drive, -1, axis=1), theta, dt)


def _by_batch(drive: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    return line(drive, theta, dt) + 1e-6 * len(theta)


def _writes(drive: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    out = line(drive, theta, dt)
    theta *= 1.0 + 1e-15
    drive += 0.0
    return out


def _far(drive: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    out = line(drive, theta, dt)
    out[(theta[:, 0] if theta.ndim == 2 else theta[:, 0, 0]) > 600.0] = np.nan
    return out


def _steps(drive: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    return line(drive, 0.004 * np.round(theta / 0.004), dt)


def _constant_only(drive: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    return theta[:, :1] * drive[0] + theta[:, 1:2]


def _starts(drive: np.ndarray, output: np.ndarray, dt: float) -> dict[str, float]:
    return {"c": float(output.max())}


MODELS = {
    "specification_is_sound": {"SPEC": replace(SPEC, inputs=("speed",))},
    "bounds_enclose_the_start": {"SPEC": replace(SPEC, params=(replace(SPEC.params[0], start=2e3), SPEC.params[1]))},
    "units_are_known": {"SPEC": replace(SPEC, params=(replace(SPEC.params[0], unit="N*blink"), SPEC.params[1]))},
    "response_is_a_finite_batch": {"response": lambda drive, theta, dt: line(drive, theta, dt).astype(np.float32)},
    "response_is_finite_within_the_bounds": {"response": _far},
    "response_is_finite_at_rest": {
        "response": lambda drive, theta, dt: np.where(drive[0] == 0.0, np.nan, line(drive, theta, dt))
    },
    "inputs_are_left_untouched": {"response": _writes},
    "response_is_deterministic": {"response": _noisy},
    "batch_equals_single_vectors": {"response": _by_batch},
    "response_is_causal": {"response": _ahead},
    "every_parameter_moves_the_response": {"response": lambda drive, theta, dt: line(drive, 0 * theta + 1, dt)},
    "differences_are_consistent": {"response": _steps},
    "linear_parameters_are_jointly_affine": {"response": lambda drive, theta, dt: line(drive, theta**2, dt)},
    "parameters_may_vary_along_the_samples": {"response": _constant_only},
    "rate_independent_response_follows_the_path": {
        "SPEC": replace(SPEC, rate_independent=True),
        "response": lambda drive, theta, dt: line(np.gradient(drive, dt, axis=1), theta, dt),
    },
    "jumps_are_declared": {"response": lambda drive, theta, dt: line(drive, theta, dt) + np.sign(drive[0])},
    "derived_quantities_have_their_function": {"SPEC": replace(SPEC, derived=(DerivedQuantity("d", "N"),))},
    "derived_quantities_have_their_shape": {
        "SPEC": replace(SPEC, derived=(DerivedQuantity("d", "N"),)),
        "derived": lambda theta: theta,
    },
    "start_values_are_inside_the_bounds": {"start_values": _starts},
    "sensitivities_are_the_derivatives": {
        "sensitivities": lambda drive, theta, dt, columns: np.repeat(line(drive, theta, dt)[:, None], 3, axis=1)
    },
}


def test_a_linear_parameter_whose_speed_counts_is_found() -> None:
    def hurried(drive: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
        changes = np.abs(np.gradient(theta[:, 0], axis=1)) if theta.ndim == 3 else 0.0
        return line(drive, theta, dt) + changes

    item = SimpleNamespace(SPEC=SPEC, response=hurried)
    assert faults(models.MODEL_CHECKS, item, "linear_parameters_are_jointly_affine") == {
        "linear_parameters_are_jointly_affine"
    }


@pytest.mark.parametrize("check", MODELS)
def test_a_model_that_breaks_a_check_is_found(check: str) -> None:
    item = SimpleNamespace(**({"SPEC": SPEC, "response": line} | MODELS[check]))
    assert faults(models.MODEL_CHECKS, item, check) == {check}


EFFECT = EffectSpec(
    "own-spring",
    "Own",
    "F = F_base + k3*x^3",
    "none",
    "add",
    ("force",),
    ("displacement",),
    (Param("k3", "N/m^3", -1e9, 1e9, 0.0, text="stiffness"),),
    (0.0,),
    ("gas-spring",),
    "strokes of two amplitudes, of which one is three times the other, at a held current and temperature",
)


def spring(channels: dict[str, np.ndarray], theta: np.ndarray, dt: float) -> np.ndarray:
    return theta[:, :1] * channels["displacement"] ** 3


EFFECTS = {
    "specification_is_sound": {"SPEC": replace(EFFECT, equation="")},
    "function_is_that_of_the_slot": {"shape": spring},
    "rivals_are_told_apart": {"SPEC": replace(EFFECT, experiment="look")},
    "rivals_are_known": {"SPEC": replace(EFFECT, aliases=("nobody",))},
    "bounds_hold_the_neutral": {"SPEC": replace(EFFECT, neutral=(1e10,))},
    "neutral_survives_the_unit_interval": {
        "SPEC": replace(EFFECT, params=(Param("k3", "N/m^3", -1.1, 1e9, 0.3, text="stiffness"),), neutral=(0.3,))
    },
    "neutral_leaves_the_base": {"term": lambda channels, theta, dt: spring(channels, theta + 1.0, dt)},
    "every_parameter_moves_the_output": {"term": lambda channels, theta, dt: 0.0 * spring(channels, theta, dt)},
    "sensitivity_does_not_vanish_at_neutral": {
        "term": lambda channels, theta, dt: spring(channels, 1e-18 * theta**3, dt)
    },
    "output_is_finite_within_the_bounds": {
        "term": lambda channels, theta, dt: np.where(theta[:, :1] > 9e8, np.nan, spring(channels, theta, dt))
    },
    "batch_equals_single_vectors": {"term": lambda channels, theta, dt: spring(channels, theta * len(theta), dt)},
}


def test_a_sound_effect_keeps_all() -> None:
    item = SimpleNamespace(SPEC=EFFECT, term=spring)
    plugins.register(item, "the test")
    assert faults(effects.EFFECT_CHECKS, item) == set()


@pytest.mark.parametrize("check", EFFECTS)
def test_an_effect_that_breaks_a_check_is_found(check: str) -> None:
    item = SimpleNamespace(**({"SPEC": EFFECT, "term": spring} | EFFECTS[check]))
    plugins.register(item, "the test")
    assert faults(effects.EFFECT_CHECKS, item, check) == {check}


def _optimizer(minimise: Any, kind: Any = "global") -> SimpleNamespace:
    spec = OptimizerSpec("own", "Own", "none", kind, lambda dimension, options: 2000)
    return SimpleNamespace(SPEC=spec, minimise=minimise)


def _global_state(objective: Any, rng: np.random.Generator, options: Any) -> None:
    while True:
        objective.costs(np.random.uniform(size=(20, objective.dimension)))  # noqa: NPY002


def _uniform(objective: Any, rng: np.random.Generator, options: Any) -> None:
    objective.costs(objective.best_point[None])
    while True:
        objective.costs(rng.uniform(size=(20, objective.dimension)))


def _blind(objective: Any, rng: np.random.Generator, options: Any) -> None:
    objective.costs(rng.uniform(size=(20, objective.dimension)))


@pytest.mark.parametrize(
    ("item", "wrong"),
    [
        (_optimizer(_global_state), {"same_seed_gives_the_same_bytes"}),
        # drawing at random is an honest optimizer, but no good one
        (_optimizer(_uniform), {"quadratic_is_minimised", "curved_valley_is_followed"}),
        (_optimizer(_blind), {"whole_budget_is_used", "result_is_never_worse_than_the_start"}),
        (_optimizer(_uniform, "local"), {"another_seed_searches_elsewhere"}),
    ],
)
def test_an_optimizer_that_breaks_a_check_is_found(item: SimpleNamespace, wrong: set[str]) -> None:
    plugins.register(item, "the test")
    kept = {"points_stay_in_the_cube", "budget_is_never_exceeded", "flat_objective_ends_quietly"}
    assert faults(optimizers.OPTIMIZER_CHECKS, item, *wrong, *kept) == wrong


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return acme_log(tmp_path / "run.log", seconds=1.0)


def _reader_faults(folder: Path, log: Path, **changes: Any) -> set[str]:
    space: dict[str, Any] = {}
    exec(EXAMPLES[3].read_text(), space)
    item = SimpleNamespace(SPEC=ReaderSpec("acme", "ACME"), sniff=space["sniff"], read=space["read"], space=space)
    for name, change in changes.items():
        setattr(item, name, change(getattr(item, name)))
    plugins.register(item, "the test")
    found = set()
    for k, check in enumerate(readers.READER_CHECKS):
        (folder / str(k)).mkdir()
        case = readers.Case(item, folder / str(k), log.name, log.read_bytes())
        if check.applies(case) and broken(check, case):
            found.add(check.name)
    return found


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({}, set()),
        ({"sniff": lambda sniff: lambda head: True}, {"files_of_nobody_are_not_claimed"}),
        (
            {"sniff": lambda sniff: lambda head: sniff(head) and head.path.suffix == ".log"},
            {"file_name_does_not_matter"},
        ),
        (
            {"read": lambda read: lambda source: read(source) if source.head.size > 9000 else 1 / 0},
            {"half_a_log_is_read_as_far_as_it_goes", "first_bytes_end_in_one_line"},
        ),
        ({"SPEC": lambda spec: replace(spec, title="")}, {"specification_is_sound"}),
    ],
)
def test_a_reader_that_breaks_a_check_is_found(
    changes: dict[str, Any], wrong: set[str], log: Path, tmp_path: Path
) -> None:
    assert _reader_faults(tmp_path, log, **changes) == wrong


def test_the_command_prints_what_holds_and_ends_with_0(tmp_path: Path) -> None:
    log = acme_log(tmp_path / "run1.log", seconds=1.0)
    done = run_python(tmp_path, "mrfit.contracts", *EXAMPLES, "--log", log)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "  holds   The response depends on the past of its inputs, not on their future." in done.stdout
    assert "BROKEN" not in done.stdout and done.stdout.endswith("all hold\n")
    for kind, name in (("model", "cubic-damper"), ("effect", "hardening-spring"), ("optimizer", "hooke")):
        assert f"{kind} {name} (" in done.stdout


def test_the_command_says_what_does_not_hold_and_ends_with_1(tmp_path: Path) -> None:
    path = tmp_path / "own.py"
    path.write_text(EXAMPLES[0].read_text().replace("c * v + c3", "c * v[::-1] + c3"))
    done = run_python(tmp_path, "mrfit.contracts", path)
    assert done.returncode == 1 and done.stdout.endswith("1 broken\n")
    text = "The response depends on the past of its inputs, not on their future."
    assert f"  BROKEN  {text} samples before a change of the inputs change with it\n" in done.stdout


def test_the_command_says_the_same_fault_once(tmp_path: Path) -> None:
    path = tmp_path / "own.py"
    path.write_text(
        EXAMPLES[0].read_text().replace("return evaluate(", "raise ValueError('no such law')\n    return evaluate(")
    )
    done = run_python(tmp_path, "mrfit.contracts", path)
    assert done.returncode == 1 and done.stdout.count("no such law") == 1
    assert done.stdout.count("BROKEN") == done.stdout.count("(as above)") + 1 > 5


def test_the_command_on_a_file_that_fails_ends_with_2(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("1 / 0\n")
    done = run_python(tmp_path, "mrfit.contracts", "own.py")
    assert done.returncode == 2 and "own.py, line 1: ZeroDivisionError" in done.stderr
