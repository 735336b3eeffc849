"""``mrfit measure``: what logs show without a model, as lag behind a command or a quasi-static test."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from mrfit.cli import console
from mrfit.cli.apply import read_logs
from mrfit.cli.options import CommandAnswer, Only, ReadLogs, options
from mrfit.cli.sheet import sheet
from mrfit.cli.watch import watch
from mrfit.core.counting import number_of
from mrfit.errors import DataError
from mrfit.settings import ingest
from mrfit.settings import sheet as sheet_settings

if TYPE_CHECKING:
    from mrfit.core.recording import Recording
    from mrfit.core.specs import Array
    from mrfit.measure.command_lag import CommandLag
    from mrfit.measure.quasi_static import QuasiStatic

app = typer.Typer(
    no_args_is_help=True, help="Read off logs: test sheet, lag behind a command, slow test, when a test may stop."
)
app.command()(sheet)
app.command()(watch)

Reading = Annotated[ingest.Settings, Only(("map",))]


@app.command()
@options(plugins=False)
def lag(
    logs: ReadLogs,
    command: Annotated[str, typer.Option("--command", help="Channel of the command.", show_default=False)],
    actual: Annotated[str, typer.Option("--actual", help="Channel that follows it.")] = "displacement",
    *,
    reading: Reading,
) -> CommandAnswer:
    """Measure the lag of a channel behind its command, and its time to 95 % of a step.

    Example: mrfit measure lag logs/steps.csv --command current_command --actual current
    """
    from mrfit.measure.command_lag import command_lag

    found = []
    for record in read_logs(logs, reading.map):
        followed, following = channel(record, command), channel(record, actual)
        found.append(command_lag(record.id, followed, following, record.dt))
    return CommandAnswer(found, _print_lags, command, actual)


def _print_lags(found: "Sequence[CommandLag]", command: str, actual: str) -> None:
    columns = ("log", "lag (ms)", "dead time (ms)", "time constant (ms)", "95 % (ms)", "95 %, of steps (ms)", "steps")
    rows = [
        [
            row.recording,
            *(
                "not told" if value is None else 1e3 * value
                for value in (row.lag, row.dead_time, row.time_constant, row.response_time)
            ),
            "–" if row.measured_response is None else 1e3 * row.measured_response,
            row.steps,
            row.gain,
            row.error,
        ]
        for row in found
    ]
    console.print_table(f"{actual} behind {command}", [*columns, "gain", "error"], rows)
    if any(row.dead_time is None for row in found):
        console.say("  not told: a pure dead time and a pure lag fit alike; a command with steps tells them apart")
    lags = _ends([1e3 * row.lag for row in found])
    console.conclude(f"Lag of {actual} behind {command} in {number_of('log', len(found))}: {lags} ms")


def _ends(values: "Sequence[float]") -> str:
    """Return the one value, or the least and greatest of several."""
    return " to ".join(dict.fromkeys(f"{value:.4g}" for value in (min(values), max(values))))


@app.command("quasi-static")
@options(plugins=False)
def quasi_static(logs: ReadLogs, *, reading: Reading) -> CommandAnswer:
    """Read stiffness, friction and work lost off slow cycles of a damper.

    Example: mrfit measure quasi-static logs/slow.csv
    """
    from mrfit.measure.quasi_static import quasi_static as measured

    found = [
        measured(record.id, channel(record, "displacement"), channel(record, "force"), record.dt)
        for record in read_logs(logs, reading.map)
    ]
    return CommandAnswer(found, _print_quasi_static)


def _print_quasi_static(found: "Sequence[QuasiStatic]") -> None:
    names = ("stiffness (N/m)", "friction (N)", "offset (N)", "loss (J)", "peak speed (m/s)", "ways", "spread (N)")
    console.print_table("Quasi-static test", ("log", *names), [list(asdict(row).values()) for row in found])
    slow = sheet_settings.Settings().slow
    for row in found:
        if row.peak_speed > slow:
            speed, limit = 1e3 * row.peak_speed, 1e3 * slow
            console.note(
                f"{row.recording}: {speed:.3g} mm/s is no slow test (above {limit:g} mm/s): what the fluid takes "
                "counts as stiffness and friction; `mrfit measure sheet` measures it"
            )
    stiffness, friction = _ends([row.stiffness for row in found]), _ends([row.friction for row in found])
    console.conclude(
        f"Quasi-static test of {number_of('log', len(found))}: stiffness {stiffness} N/m, friction {friction} N"
    )


def channel(record: "Recording", name: str) -> "Array":
    """Return a channel of a recording.

    Raises
    ------
    DataError
        If it has none of this name.
    """
    if name not in record.channels:
        there = ", ".join(record.channels)
        raise DataError(f"{record.source}: no channel '{name}'; there are {there}; a channel map can name a column so")
    return record.channels[name]
