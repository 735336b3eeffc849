"""Energy, effective stiffness and damping of whole cycles, and the reasons where a record does not tell them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from datasets.rig.closed_forms import Rig
from mrfit.measure.cycles import Cycles
from mrfit.measure.energy import quantities, travel_of, work_of
from mrfit.measure.forces import forces_of
from mrfit.measure.intervals import PerCycle
from mrfit.measure.quantity import Quantity
from tests.measure.rigs import cycles, of_rig


@cache
def gas_damper(rate: float = 200.0) -> Cycles:
    return cycles(of_rig(Rig("gas", 2.0, rate, noise=1e-4, cycles=6)))


def found(whole: Cycles, sine: bool = True) -> dict[str, Quantity]:
    return {one.name: one for one in quantities(whole, forces_of(whole), sine)}


def test_the_work_of_a_gap_is_the_force_at_the_least_displacement_times_the_gap() -> None:
    rig, whole = Rig("gas", 2.0, 200.0), gas_damper()
    gaps = 1e-4 * np.array([1.0, -2.0, 3.0, 0.0, 4.0])
    opened = replace(whole, middles=np.concatenate([[0.5], 0.5 + np.cumsum(gaps)])[: whole.count])
    closure = found(opened)["closure"].estimate
    gaps = gaps[: whole.count - 1]
    assert closure is not None and len(closure.cycles) == len(gaps)
    truth = np.abs(gaps * rig.truth()["Fd-"] / rig.truth()["E"])
    assert closure.cycles == pytest.approx(truth, rel=5e-3)
    assert closure.value == pytest.approx(truth.mean(), rel=5e-3)


@pytest.mark.parametrize(("count", "reason"), [(2, "fewer than three cycles"), (3, "")])
def test_closure_needs_three_cycles(count: int, reason: str) -> None:
    whole = gas_damper()
    gains = PerCycle(whole.gains.values[:count], whole.gains.noise[:count])
    some = replace(whole, reversals=whole.reversals[: 2 * count + 1], middles=whole.middles[:count], gains=gains)
    assert some.count == count and found(some)["closure"].reason == reason


def test_a_motion_that_is_no_sine_has_no_equivalent_viscous_damping() -> None:
    sine, other = (found(gas_damper(), said)["C_eq"] for said in (True, False))
    assert sine.estimate is not None and (other.estimate, other.reason) == (None, "the motion is no sine")


@pytest.mark.parametrize(("rate", "told"), [(62.0, False), (66.0, True)])
def test_stiffness_and_damping_ratio_take_32_samples_a_cycle(rate: float, told: bool) -> None:
    whole = found(gas_damper(rate))
    for name in ("K_eff", "xi_eff"):
        assert (whole[name].estimate is not None) == told
        assert told or whole[name].reason == "31 samples a cycle; 32 are needed for the force at a reversal"


def test_a_force_with_the_motion_has_no_efficiency() -> None:
    driven = found(gas_damper().negated())["efficiency"]
    assert driven.estimate is None and driven.reason == "no force against the motion"
    assert found(gas_damper())["efficiency"].estimate is not None


def test_work_and_travel_grow_with_the_amplitude_that_was_recorded() -> None:
    whole = gas_damper()
    share = np.linspace(0.9, 1.1, whole.count)
    whole = replace(whole, noise=50.0)
    scaled = replace(whole, gains=PerCycle(share, np.full(whole.count, 0.01**2)))
    assert work_of(scaled).values == pytest.approx(share * whole.work.values)
    assert travel_of(scaled).values == pytest.approx(share * whole.stroke)
    # of a product: the shares of the errors of both, added as squares
    own = whole.work.noise / whole.work.values**2
    assert work_of(scaled).noise / work_of(scaled).values ** 2 == pytest.approx(own + (0.01 / share) ** 2)
    assert travel_of(scaled).noise == pytest.approx(np.full(whole.count, (0.01 * whole.stroke) ** 2))


def test_the_error_of_work_that_all_cycles_share_stays_with_it() -> None:
    whole = gas_damper()
    assert whole.work.shared > 0.0 and work_of(whole).shared == whole.work.shared
    # of a late force the value alone is asked for
    assert whole.late_by(1e-3).work.shared == 0.0


def test_the_noise_of_a_cycles_work_is_that_of_its_samples() -> None:
    whole, rng = gas_damper(), np.random.default_rng(5)
    drawn = [replace(whole, force=whole.force + 4.0 * rng.standard_normal(len(whole.force))) for _ in range(30)]
    scatter = np.var([one.work.values - whole.work.values for one in drawn])
    assert replace(whole, noise=4.0).work.noise.mean() == pytest.approx(scatter, rel=0.25)
