"""What ingest makes of logs, in memory: no ids are given and nothing is written."""

from collections.abc import Sequence
from pathlib import Path

from mrfit.core.recording import Recording
from mrfit.core.workers import in_order
from mrfit.ingest.reading import read_item
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings, plan_items


def examine(paths: Sequence[Path], settings: Settings) -> tuple[list[Recording], list[Refusal]]:
    """Return the recordings and the refused files of ``paths``."""
    plan, refusals = plan_items(paths, settings)
    recordings: list[Recording] = []
    for outcome in in_order(read_item, [item for item, _ in plan], settings.jobs):
        recordings += outcome.recordings
        refusals += outcome.refusals
    return recordings, refusals
