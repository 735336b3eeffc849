"""Which models are simulated at uneven times, and which drives."""

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.protocols import ErrsInRecord
from mrfit.errors import DataError
from mrfit.simulate.assembly import assemble
from mrfit.simulate.uneven import simulate_unevenly

DRIVE = np.stack([np.linspace(0.0, 0.01, 6), np.array([0.1, -0.2, 0.3, 0.0, 0.05, -0.4])])


def test_a_law_without_memory_does_not_feel_the_steps() -> None:
    whole = assemble("tanh")
    theta = whole.spec.start[None] * np.array([[1.0], [1.1]])
    steps = np.array([0.0, 0.001, 0.5, 0.02, 1e-6, 3.0])
    np.testing.assert_array_equal(simulate_unevenly(whole, DRIVE, theta, steps), whole.simulate(DRIVE, theta, 0.01))


@pytest.mark.parametrize(("bad", "step"), [(3, 0.0), (5, -0.1), (2, float("nan"))])
def test_a_sample_that_is_not_later_is_named(bad: int, step: float) -> None:
    whole, steps = assemble("tanh"), np.full(6, 0.01)
    steps[bad] = step
    with pytest.raises(DataError, match=f"sample {bad} is not later than the one before it: its step is {step} s"):
        simulate_unevenly(whole, DRIVE, whole.spec.start[None], steps)
    # the step of the first sample is not read
    steps[bad], steps[0] = 0.01, step
    assert simulate_unevenly(whole, DRIVE, whole.spec.start[None], steps).shape == (1, 6)


ERRING = [n for n in registry.names("effect") if isinstance(registry.load("effect", n), ErrsInRecord)]


@pytest.mark.parametrize("name", ERRING)
def test_an_error_of_the_record_is_known_at_equal_steps_only(name: str) -> None:
    models = [
        m for m in ("boucwen-flux", "tanh") if assemble(m).spec.output in registry.load("effect", name).SPEC.outputs
    ]
    whole = assemble(f"{models[0]}+{name}")
    drive = np.zeros((len(whole.spec.inputs), 6))
    with pytest.raises(DataError, match=f"the effect {name} is not simulated at uneven times: resample the drive"):
        simulate_unevenly(whole, drive, whole.spec.start[None], np.full(6, 0.01))
