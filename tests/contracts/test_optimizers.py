"""What every registered optimizer must do, whatever it is."""

import pytest

from mrfit.contracts.check import Check, applying
from mrfit.contracts.optimizers import OPTIMIZER_CHECKS
from mrfit.core import registry
from mrfit.core.built_in import own_names

NAMES = own_names("optimizer")
CASES = [(name, check) for name in NAMES for check in applying(OPTIMIZER_CHECKS, registry.load("optimizer", name))]


@pytest.mark.parametrize(("name", "check"), CASES, ids=[f"{name} {check.name}" for name, check in CASES])
def test_optimizer_keeps(name: str, check: Check) -> None:
    check.run(registry.load("optimizer", name))


@pytest.mark.parametrize("name", NAMES)
def test_specification_is_named_after_its_file(name: str) -> None:
    assert registry.load("optimizer", name).SPEC.name == name
