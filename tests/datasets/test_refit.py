import numpy as np
import pytest

from datasets.rig import coil_bench, damper_bench, press
from datasets.rig.coil_bench import Drive
from datasets.rig.damper import Damper
from datasets.rig.flux_coil import base_coil
from datasets.rig.refit import coil_gap, damper_gap

TESTS = press.rich(np.random.default_rng(1))


def gap(**magnitudes):
    named = {k.replace("_", "-"): v for k, v in magnitudes.items()}
    return damper_gap(damper_bench.run(Damper(), named, TESTS), Damper())


def test_nothing_hidden_leaves_nothing():
    share, visible = gap()
    assert share < 1e-12
    assert visible < 1e-6


def test_what_the_base_law_has_itself_is_absorbed():
    share, visible = gap(force_offset=100.0)
    assert share == pytest.approx(100.0 / np.ptp(damper_bench.run(Damper(), {}, TESTS).force), rel=1e-6)
    assert visible < 1e-6


def test_what_it_has_not_stays_but_never_more_than_the_share():
    share, visible = gap(end_stop=2e5)
    assert 0.5 * share < visible < share


@pytest.mark.slow
def test_a_coil_without_effects_is_its_own_law_and_a_wrong_resistance_is_not():
    coil = base_coil(np.random.default_rng(1))
    record = coil_bench.run(coil, {}, [Drive("sine", f, 3.0) for f in (1.0, 10.0)])
    assert coil_gap(record, coil.iron, coil.resistance, integrator=False)[1] < 2e-4
    assert coil_gap(record, coil.iron, 1.01 * coil.resistance, integrator=False)[1] > 2e-3
