"""What every model in the registry must keep, whatever its equations."""

from types import ModuleType

import pytest

from mrfit.contracts.check import Check, applying
from mrfit.contracts.models import MODEL_CHECKS
from mrfit.core import registry
from mrfit.core.built_in import own_names

NAMES = own_names("model")
CASES = [(name, check) for name in NAMES for check in applying(MODEL_CHECKS, registry.load("model", name))]


@pytest.fixture(params=NAMES)
def model(request: pytest.FixtureRequest) -> ModuleType:
    return registry.load("model", request.param)


@pytest.mark.parametrize(("name", "check"), CASES, ids=[f"{name} {check.name}" for name, check in CASES])
def test_model_keeps(name: str, check: Check) -> None:
    check.run(registry.load("model", name))


def test_every_check_concerns_some_model() -> None:
    assert {check.name for _, check in CASES} == {check.name for check in MODEL_CHECKS}


def test_specification_is_named_after_its_file_and_says_where_it_comes_from(model: ModuleType) -> None:
    spec = model.SPEC
    assert model.__name__.rsplit(".", 1)[1].replace("_", "-") == spec.name
    assert spec.equation and spec.reference


def test_every_input_and_parameter_is_in_the_docstring(model: ModuleType) -> None:
    assert "Source:" in model.__doc__
    if len(model.SPEC.params) <= 16:
        missing = [p.name for p in model.SPEC.params if p.name not in model.__doc__]
        assert not missing


def test_a_flux_has_an_unknown_constant_and_its_loop_is_co_energy(model: ModuleType) -> None:
    integrated = model.SPEC.output == "flux"
    assert model.SPEC.free_offset == integrated
    assert model.SPEC.co_energy == integrated
