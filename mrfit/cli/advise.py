"""The command ``mrfit advise``."""

from pathlib import Path
from typing import Any

from mrfit.cli import console
from mrfit.cli.options import Json, Plugins, Work, options
from mrfit.core.progress import Progress
from mrfit.settings.advise import Settings

# Words before a discovery's own advice where no rig is stated
NO_RIG = "State the rig's limits in a table [rig] of mrfit.toml to have this test computed."


@options
def advise(settings: Settings, work: Work, plugins: Plugins, as_json: Json) -> None:
    """Choose the test that separates most, per second, what the last discovery left open, within the rig's limits.

    Example: mrfit advise --rig press.toml
    """
    with console.progress_bar() as progress:
        summary = advice(work, settings, progress)
    if as_json:
        return console.print_json(summary)
    return _in_words(summary) if "advice" in summary else _told(summary, work)


def advice(work: Path, settings: Settings, progress: Progress) -> dict[str, Any]:
    """Return the next test; the advice of the last discovery in words where no rig is stated."""
    from mrfit.advise import stage
    from mrfit.cli import pipeline
    from mrfit.io.workspace import Workspace

    workspace = Workspace(work)
    words = pipeline.advise(work) if settings.goal == "rivals" else {}
    if words and not stage.has_rig(workspace, settings):
        return words
    with workspace.locked():
        made = stage.run(workspace, settings, progress)
    return {**made.model_dump(mode="json"), "outdated": words.get("outdated", False)}


def _in_words(summary: dict[str, Any]) -> None:
    from mrfit.cli import output

    output.advise(summary)
    if summary["verdict"] == "ambiguous":
        console.say(NO_RIG)


def _told(summary: dict[str, Any], work: Path) -> None:
    from mrfit.cli.output import OUTDATED

    if summary["outdated"]:
        console.say(f"  warning outdated: {OUTDATED}: discover again")
    for line in summary["text"]:
        console.say(line)
    apart = [k for k, p in enumerate(summary["pairs"]) if p["separable"]]
    rows = [_row(t, [t["distances"][k] for k in apart]) for t in _tests(summary)]
    last = "least distance, standard errors" if summary["pairs"] else "gain per second"
    console.print_table("Tests", ("test", "seconds", "waiting", last, "drive"), rows)
    if summary["widths"]:
        shown = [[w["name"], w["unit"], w["value"], w["before"], w["after"]] for w in summary["widths"]]
        console.print_table("Half-widths of 95 % intervals", ("parameter", "unit", "value", "now", "expected"), shown)
    console.say(f"Drives{' and loops' if summary['pairs'] else ''}: {work / 'advise'}")


def _tests(summary: dict[str, Any]) -> list[dict[str, Any]]:
    return [*summary["tests"], *([summary["companion"]] if summary["companion"] else [])]


def _row(test: dict[str, Any], distances: list[float]) -> list[object]:
    worth = min(distances) if distances else test["worth"]
    return [test["text"], test["seconds"], test["waiting"], worth, test["drive"]]
