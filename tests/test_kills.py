"""A kill at any moment of any stage costs the time, nothing else."""

import pytest

from tests.kills import campaign


# kills of `mrfit run` are in tests/cli/test_pipeline.py: test_a_kill_at_any_moment_...
def test_two_kills() -> None:
    stages = campaign(2, seed=1, wanted=("predict",))
    assert not [b for s in stages for b in s.broken]
    assert sum(s.killed for s in stages) >= 1


@pytest.mark.slow
def test_two_hundred_kills() -> None:
    stages = campaign(200, seed=0, wanted=("batch", "discover", "report", "export", "apply", "predict", "run"))
    assert not [b for s in stages for b in s.broken]
    assert sum(s.killed for s in stages) > 100


@pytest.mark.slow
def test_fifty_kills_of_every_step() -> None:
    stages = campaign(50, seed=2)
    assert not [b for s in stages for b in s.broken]
    assert sum(s.killed for s in stages) > 25
