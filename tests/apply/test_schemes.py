"""Schemes of control against their own equations, and what a series of currents and a study say of themselves."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.apply.calls import as_motions, track, wanted
from mrfit.apply.laws import Law, law_of
from mrfit.apply.motion import Motion, sine
from mrfit.apply.series import inversion
from mrfit.apply.solving import ABOVE, REACHED
from mrfit.apply.tracking import Gains
from mrfit.errors import ConfigError, DataError
from tests.apply.dampers import monotone

DT = 2e-3
MOTION = sine(1.0, 0.01, 1.0, DT)


@pytest.mark.parametrize("integral", [0.0, 0.4])
def test_feedback_is_a_pi_controller_whose_integral_is_held_at_a_limit(integral: float) -> None:
    gains = Gains(1e-3, integral)
    weak = monotone(**{"fy@1A": 500.0, "c@1A": 2500.0})
    (case,) = track(monotone(), MOTION, "c=1e4", ["feedback"], plant=weak, gains=gains).cases
    sum_of_errors, sent = 0.0, [0.0]
    for k in range(1, MOTION.samples):
        # of the size of the force: more current is more of it
        wish, made = case.feasible[k - 1], case.force[k - 1]
        error = np.sign(wish) * (wish - made)
        whole = 1e-3 * error + integral * (sum_of_errors + error * DT)
        if 0.0 < whole < 1.2:
            sum_of_errors += error * DT
        sent.append(float(np.clip(1e-3 * error + integral * sum_of_errors, 0.0, 1.2)))
    np.testing.assert_allclose(case.command, sent, atol=1e-9)
    assert max(sent) > 0.05


def test_gains_answer_an_error_of_the_whole_reach_by_a_third_of_the_range() -> None:
    one = replace(monotone(), high=2.0)
    assert Gains().of(one, 500.0) == (pytest.approx(0.3 * 2.0 / 500.0), pytest.approx(0.3 * 2.0 / 500.0 / 0.005))
    assert Gains(proportional=1e-3).of(one, 500.0) == (1e-3, pytest.approx(0.2))
    assert Gains(integral=7.0).of(one, 500.0) == (pytest.approx(0.0012), 7.0)


def test_a_study_says_whether_its_plant_is_its_model_and_whose_errors_these_are() -> None:
    alone = track(monotone(), MOTION, "c=1e4", ["feedforward"])
    (said,) = alone.notes
    assert said.startswith("The plant is the model itself: errors are those of the scheme alone")
    other = track(monotone(), MOTION, "c=1e4", ["feedforward"], plant=monotone(**{"fy@1A": 700.0}))
    assert other.notes == [] and not other.lag_costs
    tested = replace(monotone(), tested=(("velocity", -0.01, 0.01),))
    assert any("velocity leaves what the damper was tested in" in text for text in track(tested, MOTION, "c=1e4").notes)
    assert len(alone.document.cases) == 1 and alone.to_frame()["scheme"].tolist() == ["feedforward"]
    with pytest.raises(ConfigError, match="--scheme takes feedforward, feedback, both, uninverted, not 'luck'"):
        track(monotone(), MOTION, "c=1e4", ["luck"])


def test_samples_are_free_when_nothing_out_of_reach_is_felt_any_more() -> None:
    found = inversion(monotone(), MOTION.channels, law_of("c=1e4").force(*list(MOTION.channels.values())[:2]), DT)
    flag, limited = np.full(MOTION.samples, REACHED).astype(np.int64), np.zeros(MOTION.samples, dtype=bool)
    flag[100], limited[200] = int(ABOVE), True
    prompt_one = replace(found, flag=flag, limited=limited, lasting=0.0)
    assert np.flatnonzero(~prompt_one.free).tolist() == [100, 200]
    # 9 ms are four and a half samples: five behind each are felt, and those before the first sample made no such force
    late = replace(prompt_one, lasting=0.009)
    assert np.flatnonzero(~late.free).tolist() == [*range(5), *range(100, 106), *range(200, 206)]
    row = late.summary
    assert row.limited == pytest.approx(1 / MOTION.samples)
    assert row.shares["above reach"] == pytest.approx(1 / MOTION.samples) and sum(row.shares.values()) == pytest.approx(
        1
    )
    off = np.abs(late.force - late.desired)
    assert row.rms_error == pytest.approx(np.sqrt(np.mean(off**2)))
    assert row.rms_error_over_peak == pytest.approx(row.rms_error / np.abs(late.desired).max())
    assert row.greatest_error_where_reached == off[late.free].max()
    assert replace(prompt_one, limited=np.ones_like(limited)).summary.greatest_error_where_reached is None


def test_what_is_wanted_is_a_law_an_array_or_what_was_measured() -> None:
    one, measured = monotone(), np.linspace(0.0, 1.0, MOTION.samples)
    x, v, _ = MOTION.channels.values()
    np.testing.assert_allclose(wanted(one, MOTION, "k=5e4,c=1e4"), 1e4 * v + 5e4 * x)
    np.testing.assert_allclose(wanted(one, MOTION, Law("own", 2.0)), 2.0 * v)
    np.testing.assert_array_equal(wanted(one, MOTION, measured), measured)
    np.testing.assert_array_equal(wanted(one, replace(MOTION, force=measured), None), measured)
    with pytest.raises(DataError, match="no force was measured to be wanted again"):
        wanted(one, MOTION, None)
    for wrong in (measured[1:], np.where(measured > 0.5, np.nan, 0.0)):
        with pytest.raises(DataError, match=f"{MOTION.samples} finite forces are needed"):
            wanted(one, MOTION, wrong)


def test_motions_are_taken_as_they_are_and_none_is_refused() -> None:
    other = Motion("m", DT, MOTION.channels)
    assert as_motions(MOTION, monotone()) == [MOTION] and as_motions(iter([other, MOTION]), monotone()) == [
        other,
        MOTION,
    ]
    with pytest.raises(ConfigError, match="there is no motion; give a log or"):
        as_motions([], monotone())
