"""A kill at any moment of any stage costs the time, nothing else."""

import pytest

from tests.kills import campaign


# the quick test of kills is in tests/cli/test_pipeline.py: test_a_kill_at_any_moment_...
@pytest.mark.slow
def test_five_kills() -> None:
    stages = campaign(5, seed=1)
    assert not [b for s in stages for b in s.broken]
    assert sum(s.killed for s in stages) >= 2


@pytest.mark.slow
def test_two_hundred_kills() -> None:
    stages = campaign(200, seed=0)
    assert not [b for s in stages for b in s.broken]
    assert sum(s.killed for s in stages) > 100
