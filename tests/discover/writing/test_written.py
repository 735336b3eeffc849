"""Entries of discovery.json that are written where nothing is found, and models of a driven mass."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrfit.discover.evidence.bench import Bench
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.invariance.records import Record
from mrfit.discover.policy import STANDARD
from mrfit.discover.repair.proposal import Repair
from mrfit.discover.writing import formula, law_repair
from mrfit.discover.writing.beside_open_law import held_at, left_by, not_applicable
from mrfit.discover.writing.driven_mass import of_driven, with_inertia
from mrfit.discover.writing.result import DiscoveryRequest, insufficient, model_toml
from mrfit.io.schemas.discovery import LawRepair, OtherBase, Way, Ways
from mrfit.settings.discover import Settings
from tests.discover.test_open_law import EXACT, LAG, SPRING, other

MOTION = {"displacement", "velocity", "acceleration"}


def base(output: str = "force") -> Refit:
    return cast(Refit, SimpleNamespace(assembly=SimpleNamespace(spec=SimpleNamespace(output=output))))


def bench(*channels: str) -> Bench:
    return cast(Bench, SimpleNamespace(channels=set(channels), stretches=(), of_role=lambda role: []))


@pytest.mark.parametrize(
    ("output", "channels", "why"),
    [
        ("force", MOTION, ""),
        ("force", MOTION - {"displacement"}, "no displacement"),
        ("force", {"acceleration"}, "no displacement"),
        ("torque", {"angle", "angular_velocity"}, "no angular_acceleration"),
        ("flux", MOTION, "no law of flux is known to keep invariances"),
    ],
)
def test_only_forces_and_torques_of_a_known_motion_are_examined(output: str, channels: set[str], why: str) -> None:
    assert not_applicable(output, channels) == why
    if why:
        found = formula.with_formula(EXACT, bench(*channels), base(output), STANDARD)
        assert found.proposed is not None and (found.proposed.reason, found.proposed.text) == (why, "")
        repaired = law_repair.with_law_repair(EXACT, bench(*channels), base(output), STANDARD)
        assert repaired.lacking == LawRepair(reason=why)


def test_equations_without_a_solution_are_a_reason_and_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*given: Any) -> Any:
        raise np.linalg.LinAlgError

    monkeypatch.setattr(formula, "base_of", fails)
    monkeypatch.setattr(law_repair, "repaired", fails)
    monkeypatch.setattr(law_repair, "base_on", lambda *given: (None, None))
    found = formula.with_formula(
        EXACT, bench(*MOTION), cast(Any, SimpleNamespace(**vars(base()), theta=None)), STANDARD
    )
    assert found.proposed is not None and "no solution on these data" in found.proposed.reason
    repaired = law_repair.with_law_repair(EXACT, bench(*MOTION), base(), STANDARD)
    assert repaired.lacking is not None and "no solution on these data" in repaired.lacking.reason


@pytest.mark.parametrize(("why", "law"), [("", "guo"), ("too few", "")])
def test_beside_a_term_stands_the_other_law_that_leaves_least(
    monkeypatch: pytest.MonkeyPatch, why: str, law: str
) -> None:
    monkeypatch.setattr(law_repair, "base_on", lambda *given: (None, None))
    monkeypatch.setattr(law_repair, "repaired", lambda *given: Repair((), why))
    laws = (
        other("tanh", 0.5),
        other("guo", 0.5).model_copy(update={"holdout_nrmse": 0.009}),
        other("dahl", 0.9).model_copy(update={"holdout_nrmse": None}),
    )
    entry = law_repair.with_law_repair(
        EXACT.model_copy(update={"other_laws": laws}), bench(*MOTION), base(), STANDARD
    ).lacking
    assert entry is not None and entry.other_law == law
    assert entry.other_error == (0.009 if law else None)


def test_a_residual_is_taken_as_means_over_as_many_samples_as_a_record_has_them() -> None:
    """Errors are of the simulation, in floors, role by role; stretches come in the order of the segments."""

    def stretch(role: str, floor: float, dt: float) -> SimpleNamespace:
        block = SimpleNamespace(dt=dt)
        return SimpleNamespace(segment=SimpleNamespace(role=role), floor=floor, block=block)

    stretches = [stretch("train", 2.0, 1.0), stretch("holdout", 3.0, 1.0), stretch("train", 5.0, 2.0)]
    records = [SimpleNamespace(dt=2.0, output=np.zeros(n)) for n in (2, 2, 3)]
    fit = SimpleNamespace(train=[np.array([1.0, 3.0, 5.0, 7.0, 99.0]), np.arange(3.0)], holdout=[np.ones(4)])
    own = cast(Bench, SimpleNamespace(stretches=stretches))
    found = left_by(own, cast(list[Record], records), cast(Refit, fit))
    assert [f.tolist() for f in found] == [[4.0, 12.0], [3.0, 3.0], [0.0, 5.0, 10.0]]


def test_effects_are_held_at_the_values_that_were_found() -> None:
    assert held_at((SPRING, LAG)) == {"gas-spring.k_g": 9030.0, "gas-spring.c": 0.0, "current-lag.tau": 0.02}
    assert held_at(()) == {}


def test_too_few_data_are_a_discovery_with_advice_and_no_numbers() -> None:
    found = insufficient(DiscoveryRequest("tanh", 3, "sha", "key"), "log more")
    assert (found.verdict, found.advice, found.augmented_model) == ("insufficient-data", ("log more",), "tanh")
    assert (found.seed, found.data_sha256, found.key) == (3, "sha", "key")
    assert found.gap.before is None and found.unexplained.share_of_gap is None


def test_a_driven_mass_is_free_once_and_only_where_it_is_asked_for() -> None:
    assert with_inertia(Settings("dahl+inertia", driven_by="force", mass="free")).model == "dahl+inertia"
    assert with_inertia(Settings("dahl")).model == "dahl"
    assert with_inertia(Settings("dahl+delay", driven_by="base", mass="free")).model == "dahl+delay+inertia"


def test_the_mass_of_a_driven_law_is_told_nowhere_as_an_effect() -> None:
    way = Way(verdict="named")
    found = EXACT.model_copy(
        update={
            "other_base": OtherBase(model="guo+inertia", verdict="none", gap=EXACT.gap),
            "ways": Ways(exact_base=way, invariances=way, agree=False, difference="of bingham+inertia and more"),
        }
    )
    told = of_driven(found, Settings("bingham", driven_by="force", mass="free"))
    assert told.other_base is not None and told.other_base.model == "guo"
    assert told.ways is not None and told.ways.difference == "of bingham and more"
    held = of_driven(found, Settings("bingham", driven_by="force", mass="2.0"))
    assert held.other_base is not None and held.other_base.model == "guo+inertia"


def test_held_values_are_written_with_every_digit() -> None:
    held = EXACT.model_copy(update={"held": (("a.k", 1.0 / 3.0), ("b.c", 2e-300))})
    assert f'fixed = {{ "a.k" = {1.0 / 3.0!r}, "b.c" = 2e-300 }}' in model_toml(held)
