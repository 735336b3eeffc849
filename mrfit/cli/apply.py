"""``mrfit apply``: a fit put to use. The current for a force, how well forces are tracked, and the ride of a car."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mrfit.cli import console
from mrfit.cli.options import WORK, Json, Map, Plugins, Work, number
from mrfit.errors import ConfigError

if TYPE_CHECKING:
    from mrfit.apply.damper import Damper
    from mrfit.apply.inverse import Amplifier
    from mrfit.apply.motion import Motion

app = typer.Typer(no_args_is_help=True, help="Put a fit to use: invert it, track forces with it, drive a car on it.")

Fit = Annotated[str, typer.Option("--fit", help="Name of a fit, one set of parameters for all currents.")]
OptionalLogs = Annotated[list[Path] | None, typer.Argument(help="Logs whose motion is taken.", show_default=False)]
Sine = Annotated[
    str, typer.Option(help="Instead of logs a sine, Hz and m: 1:0.01.", metavar="HZ:M[:CYCLES]", show_default=False)
]
Step = Annotated[float, typer.Option("--dt", help="Sample interval of the sine in s.", min=1e-6, max=0.1)]
Most = Annotated[float, typer.Option(help="Greatest command over the greatest current tested.", min=1.0)]
Least = Annotated[float | None, typer.Option(help="Least command in A; default: the least current tested.")]
Rate = Annotated[float | None, typer.Option(help="Greatest change of the command in A/s.", min=1e-9)]
Voltage = Annotated[float | None, typer.Option(help="Greatest voltage in V; needs --inductance.", min=1e-9)]
Ohm = Annotated[float, typer.Option("--resistance", help="Coil resistance in ohm, with --voltage.", min=0.0)]
Henry = Annotated[float, typer.Option("--inductance", help="Coil inductance in H, with --voltage.", min=0.0)]


def damper_named(work: Path, name: str) -> "Damper":
    """Return the damper of a fit in a workspace."""
    from mrfit.apply.damper import damper_of
    from mrfit.api.fitting import FitResult
    from mrfit.fit.predict import read_fit
    from mrfit.io.workspace import Workspace

    return damper_of(FitResult(read_fit(Workspace(work), name)))


def motions_of(
    logs: list[Path] | None, sine: str, dt: float, map_file: Path | None, damper: "Damper"
) -> "list[Motion]":
    """Return the motions of logs, or of a written sine.

    Raises
    ------
    ConfigError
        If both or none are given, or the sine is malformed.
    """
    from mrfit.apply import motion

    if bool(logs) == bool(sine):
        raise ConfigError("give logs whose motion to take, or --sine HZ:M")
    if sine:
        numbers = [number("--sine", part) for part in sine.split(":")]
        if len(numbers) not in (2, 3):
            raise ConfigError(f"--sine takes HZ:M or HZ:M:CYCLES, not '{sine}'")
        return [motion.sine(*numbers, dt=dt, output=damper.output)]
    return motion.of_recordings(read_logs(logs or [], map_file), damper.assembly.spec.inputs, damper.output)


def read_logs(logs: list[Path], map_file: Path | None) -> list[Any]:
    """Return recordings of logs; one that cannot be read is said on standard error.

    Raises
    ------
    DataError
        If none can be read.
    """
    import warnings

    from mrfit.api.recordings import read

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = read(logs, map_file)
    for one in caught:
        console.note(str(one.message))
    return list(found)


def amplifier_of(
    most: float, least: float | None, rate: float | None, coil: tuple[float | None, float, float]
) -> "Amplifier":
    """Return the limits of the options."""
    from mrfit.apply.inverse import Amplifier

    voltage, ohm, henry = coil
    none = float("inf")
    return Amplifier(most, least, none if rate is None else rate, none if voltage is None else voltage, ohm, henry)


@app.command()
def invert(  # noqa: PLR0913
    fit: Fit,
    logs: OptionalLogs = None,
    sine: Sine = "",
    dt: Step = 1e-3,
    law: Annotated[str, typer.Option(help="Desired force: c=N*s/m, k=N/m,c=N*s/m, skyhook=N*s/m.")] = "",
    desired: Annotated[Path | None, typer.Option(help="File with the desired force over time.")] = None,
    most: Most = 1.2,
    least: Least = None,
    rate: Rate = None,
    voltage: Voltage = None,
    resistance: Ohm = 0.0,
    inductance: Henry = 0.0,
    map_file: Map = None,
    work: Work = WORK,
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """Find the current for a desired force; without --law and --desired, for the force that the log measured.

    Example: mrfit apply invert --fit tanh.auto --sine 1:0.01 --law c=2e4
    """
    from mrfit.apply import stage
    from mrfit.apply.calls import wanted
    from mrfit.apply.motion import desired_series
    from mrfit.apply.series import inversion

    if law and desired:
        raise ConfigError("give --law or --desired, not both")
    damper = damper_named(work, fit)
    amplifier = amplifier_of(most, least, rate, (voltage, resistance, inductance))
    motions = motions_of(logs, sine, dt, map_file, damper)
    found = []
    with console.progress_bar() as progress:
        for motion in motions:
            series = desired_series(read_logs([desired], None), motion, damper.output) if desired else law or None
            forces = wanted(damper, motion, series)
            found.append((motion, inversion(damper, motion.channels, forces, motion.dt, amplifier, progress)))
        summary = stage.invert(work, found)
    return console.print_json(summary) if as_json else _print_inversions(summary)


def _print_inversions(summary: dict[str, Any]) -> None:
    columns = ("motion", "samples", "reached", "above reach", "below reach", "limited", "greatest error", "rms error")
    rows = [
        [
            r["motion"],
            r["samples"],
            *(f"{100 * r['shares'][n]:.1f} %" for n in ("reached", "above reach", "below reach")),
            f"{100 * r['limited']:.1f} %",
            r["greatest_error_where_reached"],
            r["rms_error"],
        ]
        for r in summary["motions"]
    ]
    how = "in closed form" if summary["motions"][0]["explicit"] else "by search"
    console.print_table(
        f"Currents of {summary['fit']}, {how}; errors where reached and not limited, and of all", columns, rows
    )
    for line in (*summary["notes"], f"Page: {summary['page']}"):
        console.say(line)
