"""The command ``mrfit measure watch``."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mrfit.cli import console, names
from mrfit.cli.apply import read_logs
from mrfit.cli.options import CommandAnswer, Only, options
from mrfit.core.counting import few, number_of
from mrfit.errors import ConfigError, DataError
from mrfit.settings import ingest
from mrfit.settings.watch import Settings

if TYPE_CHECKING:
    from mrfit.core.recording import Recording
    from mrfit.track.watch import LookAtTest

LEFT_OUT_SHOWN = 4
POLL = 0.2
"""Seconds between two readings of a log that grows."""


@dataclass(frozen=True)
class WatchAnswer:
    """Looks at a test, and of a replayed one what its whole log says at the end."""

    log: str
    looks: "list[LookAtTest]"
    whole: "LookAtTest | None"

    @property
    def stopped(self) -> bool:
        """Whether the test has told enough."""
        return self.looks[-1].reached


@options()
def watch(
    log: Annotated[Path, typer.Argument(help="Log that an instrument writes, or wrote.", show_default=False)],
    model: Annotated[
        str, typer.Option("--model", help="Model to fit.", show_default=False, autocompletion=names.model)
    ],
    *,
    rule: Settings,
    follow: Annotated[
        bool, typer.Option("--follow", help="Follow a growing log; without it a log is replayed.")
    ] = False,
    patience: Annotated[
        float, typer.Option(help="Seconds without new rows after which a test is over.", min=0.1)
    ] = 30.0,
    reading: Annotated[ingest.Settings, Only(("map",))],
) -> CommandAnswer:
    """Say after each cycle of a test which intervals are reached, and end with code 0 when it may stop.

    Example: mrfit measure watch datasets/damper-sines/sine_1Hz_10mm_1A.csv --model tanh --parameters fy,c --within 5
    """
    from mrfit.track.watch import look, replayed, steady_cycles
    from mrfit.track.watch import watch as looks_at

    if follow and log.is_dir():
        raise ConfigError(f"{log} is a folder: --follow reads one log that grows; name its file")
    found = [] if follow else read_logs([log], reading.map)
    record = found[0] if found else None
    name = f"{found[0].id} of {log}" if len(found) > 1 else str(log)
    if len(found) > 1:
        left = few([one.id for one in found[1:]], LEFT_OUT_SHOWN)
        console.note(f"{name} is watched; left out: {left}; one test is watched at a time")
    records = _followed(log, reading, patience) if record is None else replayed(record)
    looks = []
    for made in looks_at(records, model, rule):
        looks.append(made)
        console.note(_line(made))
    if not looks:
        raise DataError(f"{name}: fewer than {rule.least_cycles} steady cycles; nothing was fitted")
    whole = look(record, steady_cycles(record)[0], model, rule) if record and looks[-1].reached else None
    return CommandAnswer(WatchAnswer(name, looks, whole), _show, check=_check)


def _followed(log: Path, settings: ingest.Settings, patience: float) -> "Iterator[Recording]":
    """Yield the record of a growing log whenever it has grown, until it rests."""
    from mrfit.ingest.growing import GrowingLog

    growing, last = GrowingLog(log, settings), time.monotonic()
    while time.monotonic() - last < patience:
        if not growing.grow():
            time.sleep(POLL)
            continue
        last = time.monotonic()
        if growing.record:
            yield growing.record


def _line(look: "LookAtTest") -> str:
    def half(low: float | None, high: float | None) -> str:
        return "open" if low is None or high is None else f"± {(high - low) / 2.0:.2g}"

    told = ", ".join(
        f"{v.name} {v.value:.5g} {half(v.low, v.high)} {v.unit}{' reached' if v.reached else ''}" for v in look.values
    )
    left = look.needed - look.cycles if look.needed else None
    more = "" if left is None else f"; about {number_of('more cycle', left)}" if left > 0 else "; the next look decides"
    return f"{number_of('cycle', look.cycles)}, {look.seconds:.3g} s: {told or 'nothing is determined'}" + (
        "" if look.reached else more
    )


def _show(answer: WatchAnswer) -> None:
    last = answer.looks[-1]
    rows = [[v.name, v.value, v.unit, v.low, v.high, "yes" if v.reached else "no"] for v in last.values]
    console.print_table(
        f"{answer.log} after {last.seconds:.3g} s", ("parameter", "value", "unit", "low", "high", "reached"), rows
    )
    if not answer.stopped:
        return
    saved = f"; {_of_whole(last, answer.whole)}" if answer.whole else ""
    console.conclude(f"Stop after {number_of('steady cycle', last.cycles)}{saved}")


def _of_whole(last: "LookAtTest", whole: "LookAtTest") -> str:
    """Return the share of a replayed log that the stop saves, and whether its values lie in the intervals then."""
    other = sorted(last.missed(whole))
    says = f"gives another {', '.join(other)}" if other else "agrees with the intervals"
    return f"{100.0 * (1.0 - last.seconds / whole.seconds):.0f} % of the log saved; the whole log {says}"


def _check(answer: WatchAnswer) -> None:
    if not answer.stopped:
        needed = answer.looks[-1].needed
        about = f"; about {number_of('cycle', needed)} would reach them" if needed else ""
        raise DataError(f"{answer.log}: the intervals are not reached in {answer.looks[-1].seconds:.3g} s{about}")
