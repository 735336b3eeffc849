"""The command ``mrfit advise``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.cli import console
from mrfit.cli.options import CommandAnswer, Work, options
from mrfit.core.progress import Progress
from mrfit.settings.advise import Settings

if TYPE_CHECKING:
    from mrfit.io.schemas.advice import AdviceFile, AdvisedTest

# What follows a discovery's own advice where no rig is stated
NO_RIG = (
    "The test that tells most in the least time is computed from what the rig can do. Copy these lines into a file, "
    "put the rig's numbers in place of those of the logs, and run"
)


@options()
def advise(settings: Settings, work: Work, progress: Progress) -> CommandAnswer:
    """Choose the test that separates most, per second, what the last discovery left open, within the rig's limits.

    Example: mrfit advise --rig press.toml
    """
    from mrfit.cli import pipeline

    made = computed(work, settings, progress)
    if made is not None:
        return CommandAnswer(made, _say, work)
    return CommandAnswer(pipeline.advise(work), _say_words, work)


def _say_words(words: dict[str, Any], work: Path) -> None:
    from mrfit.cli import output, pipeline

    output.advise(words)
    # the last line is the one of a quiet command, and the rig's lines are no answer
    if words["advice"] and words["verdict"] != "insufficient-data" and not console.VERBOSITY.quiet:
        console.say(f"{NO_RIG} mrfit advise --rig FILE --work {work}")
        console.say_each(pipeline.rig_lines(work))


def computed(work: Path, settings: Settings, progress: Progress) -> AdviceFile | None:
    """Return the next test; None where no rig is stated, so that a discovery's own words are all there is to say."""
    from mrfit.advise import stage
    from mrfit.cli import pipeline
    from mrfit.io.workspace import Workspace

    workspace, on_rivals = Workspace(work), settings.goal == "rivals"
    reason = pipeline.advise(work)["reason"] if on_rivals else ""
    if on_rivals and not stage.has_rig(workspace, settings):
        return None
    with workspace.locked():
        made = stage.run(workspace, settings, progress)
    return replace(made, outdated=True, reason=reason) if reason else made


def _say(made: AdviceFile, work: Path) -> None:
    if made.outdated:
        again = "" if made.goal == "parameters" else "discover again"
        console.say(f"  {console.outdated_line(made.reason, again)}")
    for line in made.text:
        console.say(line)
    apart = [k for k, pair in enumerate(made.pairs) if pair.separable]
    tests = [*made.tests, *([made.companion] if made.companion else [])]
    last = "least distance, standard errors" if apart else "gain (1/s)"
    rows = [_row(t, apart) for t in tests]
    if rows:
        console.print_table("Tests", ("test", "length (s)", "waiting (s)", last, "drive"), rows)
    if made.widths:
        shown = [[w.name, w.unit, w.value, w.before, w.after] for w in made.widths]
        console.print_table("Half-widths of 95 % intervals", ("parameter", "unit", "value", "now", "expected"), shown)
    if rows:
        console.say(f"Drives{' and loops' if made.goal == 'rivals' else ''}: {work / 'advise'}")


def _row(test: AdvisedTest, apart: list[int]) -> list[object]:
    worth = min(test.distances[k] for k in apart) if apart else test.worth
    return [test.text, test.seconds, test.waiting, worth, test.drive]
