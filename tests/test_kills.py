"""A kill at any moment of any stage costs the time, nothing else."""

from pathlib import Path

import pytest

from tests.kills import STAGES, Campaign


# kills of `mrfit run` are in tests/cli/test_pipeline.py: test_a_kill_at_any_moment_...
def test_two_kills_go_on_after_an_interruption(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    begun = Campaign(1, 1, ["ingest-damper"], tmp_path / "kills.jsonl")
    begun.run()
    gone_on = Campaign(2, 1, ["ingest-damper"], tmp_path / "kills.jsonl")
    assert gone_on.kills == begun.kills and begun.killed == 1
    gone_on.run()
    assert not gone_on.broken and gone_on.killed == 2
    assert capsys.readouterr().err.count("before its end, same bytes") == len(gone_on.kills)
    with pytest.raises(AssertionError, match="other stages"):
        Campaign(2, 1, ["ingest"], tmp_path / "kills.jsonl")


@pytest.mark.slow
@pytest.mark.parametrize(
    "stages", [("batch", "discover", "report", "export", "apply", "predict", "run"), tuple(STAGES)]
)
def test_kills_of_every_command(stages: tuple[str, ...]) -> None:
    campaign = Campaign(200 if len(stages) < len(STAGES) else 50, 0, stages)
    campaign.run()
    assert not campaign.broken and campaign.killed == campaign.count
