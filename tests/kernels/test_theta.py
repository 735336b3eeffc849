"""How parameters are laid out for responses."""

import numpy as np
from hypothesis import given
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import sampled_from

from mrfit.core.specs import Array
from mrfit.kernels.theta import along_samples, columns, distinct, evaluate, plain

THETA = np.arange(6.0).reshape(3, 2)


def test_columns_broadcast_constant_and_varying_parameters_alike() -> None:
    held = np.repeat(THETA[:, :, None], 5, axis=2)
    for constant, varying in zip(columns(THETA), columns(held), strict=True):
        assert constant.shape == (3, 1)
        assert np.array_equal(np.broadcast_to(constant, (3, 5)), varying)


def test_evaluation_in_blocks_equals_the_formula_at_once() -> None:
    theta = np.random.default_rng(0).normal(size=(7, 2))
    drive = np.linspace(0, 1, 9000)[None]
    out = evaluate(lambda x, a, b: a * x + b, drive, theta)
    assert np.array_equal(out, theta[:, :1] * drive[0] + theta[:, 1:])
    assert out.flags.c_contiguous


def test_plain_copies_only_what_kernels_cannot_take() -> None:
    values = np.arange(6.0)
    assert plain(values) is values
    values.flags.writeable = False
    assert plain(values).flags.writeable
    assert plain(np.arange(6.0)[::2]).flags.c_contiguous


def test_samples_come_last_and_parameters_first() -> None:
    assert along_samples(THETA).shape == (2, 3, 1)
    assert along_samples(np.zeros((3, 2, 5))).shape == (2, 3, 5)


@given(arrays(np.float64, (7, 3), elements=sampled_from([0.0, -0.0, 1.0, np.nan])))
def test_distinct_rows_at_their_places_are_all_rows(theta: Array) -> None:
    first, places = distinct(theta)
    assert theta[first][places].tobytes() == theta.tobytes()
    assert len({row.tobytes() for row in theta}) == len(theta[first])
