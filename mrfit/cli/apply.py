"""``mrfit apply``: a fit put to use. The current for a force or of a flux, forces tracked, and the ride of a car."""

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mrfit.cli import console, names
from mrfit.cli.options import CommandAnswer, Only, Work, options
from mrfit.core.channels import unit_of
from mrfit.core.grouping import grouped
from mrfit.core.progress import Progress
from mrfit.errors import ConfigError
from mrfit.settings import forms, ingest, shared
from mrfit.settings.apply import Amplifier, CoilDrive

if TYPE_CHECKING:
    from mrfit.api.fitting import FitResult
    from mrfit.apply.coil import Coil
    from mrfit.apply.damper import Damper
    from mrfit.apply.motion import Motion
    from mrfit.core.recording import Recording
    from mrfit.io.schemas.apply import CurrentFile, FluxCommandFile, InvertFile, QuarterCarFile, TrackFile

app = typer.Typer(no_args_is_help=True, help="Put a fit to use: invert it, track forces with it, drive a car on it.")

Fit = Annotated[
    str, typer.Option("--fit", help="Name of a fit, one set of parameters for all currents.", autocompletion=names.fit)
]
CoilFit = Annotated[
    str, typer.Option("--fit", help="Name of a fit of flux, one set of parameters for all.", autocompletion=names.fit)
]
OptionalLogs = Annotated[list[Path] | None, typer.Argument(help="Logs whose motion is taken.", show_default=False)]
Sine = Annotated[
    str, typer.Option(help="Instead of logs a sine, Hz and m: 1:0.01.", metavar="HZ:M[:CYCLES]", show_default=False)
]
Step = Annotated[float, typer.Option("--dt", help="Sample interval of the sine in s.", min=1e-6, max=0.1)]
Reading = Annotated[ingest.Settings, Only(("map",))]


def damper_named(work: Path, name: str) -> "Damper":
    """Return the damper of a fit in a workspace."""
    from mrfit.api.kept_prediction import trained_on
    from mrfit.apply.damper import damper_of
    from mrfit.io.workspace import Workspace

    workspace, fit = Workspace(work), fit_named(work, name)
    known = (workspace.fit_folder(name) / "residuals.parquet").is_file() and workspace.segments_file.is_file()
    return damper_of(fit, tested=trained_on(workspace, fit.content) if known else {})


def coil_named(work: Path, name: str) -> "Coil":
    """Return the coil of a fit in a workspace."""
    from mrfit.apply.coil import coil_of

    return coil_of(fit_named(work, name))


def fit_named(work: Path, name: str) -> "FitResult":
    """Return a fit in a workspace, and say why it is out of date where it is."""
    from mrfit.api.fitting import FitResult
    from mrfit.fit.predict import read_fit
    from mrfit.io.workspace import Workspace

    fit = read_fit(Workspace(work), name, compare=True)
    note_outdated(fit.name, fit.outdated)
    return FitResult(fit)


def note_outdated(fit_name: str, reasons: Iterable[str]) -> None:
    """Print the reasons for which a fit is out of date, beside what is answered with it."""
    for reason in reasons:
        console.note(console.outdated_line(f"{fit_name}: {reason}"))


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
        raise ConfigError(f"give logs whose motion to take, or --sine HZ:M{', not both' if sine else ''}")
    if sine:
        frequency, amplitude, cycles = motion.written_sine(sine, "M")
        return [motion.sine(frequency, amplitude, cycles, dt, damper.output)]
    return motion.of_recordings(read_logs(logs or [], map_file), damper.assembly.spec.inputs, damper.output)


def read_logs(logs: list[Path], map_file: Path | None, pattern: str | None = None, jobs: int = 1) -> "list[Recording]":
    """Return recordings of logs; one that cannot be read is reported on standard error.

    Raises
    ------
    DataError
        If none can be read.
    """
    import warnings

    from mrfit.api.recordings import read

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = read(logs, map_file, pattern=pattern, jobs=jobs)
    for one in caught:
        console.note(str(one.message))
    return list(found)


def _conclude(summary: "CurrentFile | FluxCommandFile | InvertFile | TrackFile", *words: str) -> None:
    """Print what is said of a result, and where its page lies."""
    console.say_each((*words, *summary.notes, f"Page: {summary.page}"), "")


@app.command()
@options()
def invert(
    fit: Fit,
    logs: OptionalLogs = None,
    sine: Sine = "",
    dt: Step = 1e-3,
    law: Annotated[str, typer.Option(help="Desired force: c=N*s/m, k=N/m,c=N*s/m, skyhook=N*s/m.")] = "",
    desired: Annotated[Path | None, typer.Option(help="File with the desired force over time.")] = None,
    *,
    amplifier: Amplifier,
    reading: Reading,
    work: Work,
    progress: Progress,
) -> CommandAnswer:
    """Find the current for a desired force; without --law and --desired, for the force that the log measured.

    Example: mrfit apply invert --fit tanh.auto.all --sine 1:0.01 --law c=2e4
    """
    from mrfit.apply import stage
    from mrfit.apply.calls import wanted
    from mrfit.apply.laws import law_words
    from mrfit.apply.motion import desired_series
    from mrfit.apply.series import inversion

    if law and desired:
        raise ConfigError("give --law or --desired, not both")
    damper = damper_named(work, fit)
    motions = motions_of(logs, sine, dt, reading.map, damper)
    found = []
    for motion in motions:
        series = desired_series(read_logs([desired], None), motion, damper.output) if desired else law or None
        forces = wanted(damper, motion, series)
        found.append((motion, inversion(damper, motion.channels, forces, motion.dt, amplifier, progress)))
    asked = f"{law}: {law_words(damper.output)}" if law else desired.name if desired else "as measured"
    summary = stage.invert(work, found, asked)
    return CommandAnswer(summary, partial(_print_inversions, unit_of(damper.output)))


def _print_inversions(unit: str, summary: "InvertFile") -> None:
    columns = ("motion", "samples", "reached", "above reach", "below reach", "limited")
    errors = (f"greatest error ({unit})", f"rms error ({unit})")
    rows = [
        [
            r.motion,
            r.samples,
            *(f"{100 * r.shares[n]:.1f} %" for n in ("reached", "above reach", "below reach")),
            f"{100 * r.limited:.1f} %",
            r.greatest_error_where_reached,
            r.rms_error,
        ]
        for r in summary.motions
    ]
    how = "in closed form" if summary.motions[0].explicit else "by search"
    console.print_table(
        f"Currents of {summary.fit}, {how}; greatest error where reached and not limited, rms error of all samples",
        (*columns, *errors),
        rows,
    )
    _conclude(summary)


@app.command()
@options()
def track(
    fit: Fit,
    logs: OptionalLogs = None,
    sine: Sine = "",
    dt: Step = 1e-3,
    law: Annotated[
        list[str] | None, typer.Option(help="Desired force: c=N*s/m, k=N/m,c=N*s/m, skyhook=N*s/m; may be repeated.")
    ] = None,
    desired: Annotated[Path | None, typer.Option(help="File with the desired force over time.")] = None,
    scheme: Annotated[
        str, typer.Option(help="By commas: feedforward, feedback, both, uninverted.")
    ] = "feedforward,feedback,both,uninverted",
    plant: Annotated[str, typer.Option(help="Fit that answers in the damper's place; default: the same.")] = "",
    proportional: Annotated[float | None, typer.Option(help="Gain of the feedback in A/N.", min=0.0)] = None,
    integral: Annotated[float | None, typer.Option(help="Gain of its integral in A/(N*s).", min=0.0)] = None,
    *,
    amplifier: Amplifier,
    reading: Reading,
    work: Work,
    progress: Progress,
) -> CommandAnswer:
    """Track desired forces by feedforward, feedback and both: errors, by region, and what the current's lag costs.

    Example: mrfit apply track --fit tanh.auto.all --sine 1:0.01 --law c=2e4 --law k=-1e5,c=1e4
    """
    from mrfit.apply import stage, tracking
    from mrfit.apply.laws import law_of
    from mrfit.apply.motion import desired_series

    if not law and not desired:
        raise ConfigError("give a desired force: --law c=2e4, or --desired FILE")
    laws = [law_of(text) for text in dict.fromkeys(law or [])]
    schemes = list(dict.fromkeys(forms.names(scheme) or [""]))
    damper = damper_named(work, fit)
    answers = damper_named(work, plant) if plant else damper
    motions = motions_of(logs, sine, dt, reading.map, damper)
    tasks = []
    for motion in motions:
        demands = tracking.demands_of(laws, motion, damper)
        if desired:
            series = desired_series(read_logs([desired], None), motion, damper.output)
            demands.append(tracking.Demand(desired.name, series))
        tasks.append((motion, demands))
    gains = tracking.Gains(proportional, integral)
    study = tracking.tracking(damper, answers, tasks, schemes, amplifier, gains, progress)
    summary = stage.track(work, study)
    return CommandAnswer(summary, _print_tracking)


def _print_tracking(summary: "TrackFile") -> None:
    from mrfit.apply.page import table_of
    from mrfit.apply.stage import lag_column

    columns = {
        "law": lambda c: c.law,
        "motion": lambda c: c.motion,
        "scheme": lambda c: c.scheme,
        **lag_column(bool(summary.lag_costs)),
        "error": lambda c: c.error,
        "region I": lambda c: c.regions[0].error,
        "II": lambda c: c.regions[1].error,
        "III": lambda c: c.regions[2].error,
        "Err_rms_f": lambda c: c.err_rms_f,
        "Err_energy": lambda c: c.err_energy,
    }
    table = table_of(f"Forces tracked by {summary.fit}: rms error over rms force", columns, summary.cases)
    console.print_table(table.caption, table.heads, table.rows)
    _conclude(summary, *_lag_words(summary))


def _lag_words(summary: "TrackFile") -> list[str]:
    costs = ((r.scheme, r.error, r.without_lag) for r in summary.lag_costs)
    by_scheme = grouped((name, (a, b)) for name, a, b in costs if a is not None and b is not None)
    return [
        f"The lag costs {name}: rms error {sum(a for a, _ in some) / len(some):.3g} of the force, mean of all laws, "
        f"{sum(b for _, b in some) / len(some):.3g} without lag"
        for name, some in by_scheme.items()
    ]


@app.command("quarter-car")
@options()
def quarter_car(
    fit: Fit,
    sprung: Annotated[float, typer.Option(help="Sprung mass in kg.")] = 400.0,
    unsprung: Annotated[float, typer.Option(help="Unsprung mass in kg; 0: a rigid wheel.")] = 40.0,
    spring: Annotated[float, typer.Option(help="Spring in N/m.")] = 20e3,
    tyre: Annotated[float, typer.Option(help="Tyre in N/m.")] = 180e3,
    tyre_damping: Annotated[float, typer.Option(help="Tyre's damping in N*s/m.")] = 0.0,
    road: Annotated[
        str, typer.Option(help="Roads by commas: bump, A, B, C, D (ISO 8608), sweep.")
    ] = "bump,A,B,C,D,sweep",
    speed: Annotated[
        float | None, typer.Option(help="Speed in m/s; default: 15 km/h on the bump, 20 m/s else.", min=0.1, max=200.0)
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Of each road in s; default: 3 on the bump, 10 else.", min=1.0, max=300.0)
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of random roads.", min=0)] = 0,
    control: Annotated[str, typer.Option(help="Controls by commas; default: all.")] = "",
    damping: Annotated[
        float, typer.Option(help="Desired damping of skyhook, groundhook and hybrid in N*s/m.", min=0.0)
    ] = 2000.0,
    share: Annotated[float, typer.Option(help="Of skyhook in the hybrid.", min=0.0, max=1.0)] = 0.5,
    sample: Annotated[float, typer.Option(help="Sample time of the control in s.")] = 1e-3,
    steps: Annotated[int, typer.Option(help="Steps of the simulation in it.")] = 2,
    check: Annotated[bool, typer.Option(help="Simulate the first road adaptively too.")] = True,
    *,
    amplifier: Amplifier,
    work: Work,
    progress: Progress,
) -> CommandAnswer:
    """Drive a quarter car on the damper: comfort, tyre load and travel of passive and controlled rides, and chatter.

    Example: mrfit apply quarter-car --fit tanh.auto.all --road bump,C
    """
    from mrfit.apply import ride, stage
    from mrfit.apply.car import CONTROLS, Car, Control, Timing
    from mrfit.apply.roads import road as road_of

    controls = [Control(n, damping, share) for n in dict.fromkeys(forms.names(control) or CONTROLS)]
    roads = [road_of(n, speed, duration, seed) for n in dict.fromkeys(forms.names(road) or [""])]
    car, timing = Car(sprung, unsprung, spring, tyre, tyre_damping), Timing(sample, steps)
    damper = damper_named(work, fit)
    study = ride.quarter_car(damper, car, controls, roads, timing, amplifier, check, progress)
    summary = stage.quarter_car(work, study)
    return CommandAnswer(summary, _print_rides)


def _print_rides(summary: "QuarterCarFile") -> None:
    from mrfit.apply.page import table_of
    from mrfit.apply.stage import lag_column

    columns = {
        "road": lambda r: r.road,
        "control": lambda r: r.control,
        **lag_column(any(not r.lag for r in summary.rows)),
        "rms acceleration": lambda r: r.acceleration,
        "tyre load": lambda r: r.tyre_load,
        "least load": lambda r: r.least_load,
        "rms travel": lambda r: r.travel,
        "chatter": lambda r: r.chatter.cause or "–",
    }
    title = f"Quarter car on {summary.fit}: acceleration in m/s², tyre load over the static one, travel in m"
    table = table_of(title, columns, summary.rows)
    console.print_table(table.caption, table.heads, table.rows)
    console.say_each((*summary.findings, f"Page: {summary.page}"), "")


@app.command()
@options()
def current(
    fit: CoilFit,
    logs: Annotated[list[Path], typer.Argument(help="Logs with flux linkage, or coil voltage and current.")],
    known: Annotated[
        float, typer.Option(help="Time in s from the first sample over which the current is known.", min=0.0)
    ] = 0.0,
    resistance: shared.Resistance = None,
    *,
    reading: Reading,
    work: Work,
) -> CommandAnswer:
    """Find the current of a flux linkage, by a model that gives it or by a flux model inverted.

    Example: mrfit apply current --fit stop-mmf.lsq.all --known 0.2 datasets/coil/coil_05Hz_3A.csv
    """
    import mrfit.flux.stage
    from mrfit.apply import coil_stage
    from mrfit.cli.pipeline import flux_to_predict
    from mrfit.io.workspace import Workspace

    coil = coil_named(work, fit)
    how = flux_to_predict(Workspace(work), resistance)
    recordings, _ = mrfit.flux.stage.reconstruct(read_logs(logs, reading.map), how)
    found = [coil_stage.inverted_log(coil, recording, known) for recording in recordings]
    return CommandAnswer(coil_stage.currents(work, coil, found), _print_currents)


def _print_currents(summary: "CurrentFile") -> None:
    columns = ("log", "samples", "known samples", "range (A)", "rms error (A)", "over the range")
    rows = [
        [r.log, r.samples, r.known, r.range, r.rms_error, "–" if r.error is None else f"{100.0 * r.error:.3g} %"]
        for r in summary.logs
    ]
    console.print_table(f"Currents of the flux of {summary.fit}; errors behind the known beginning", columns, rows)
    _conclude(summary)


@app.command("flux-command")
@options()
def flux_command(
    fit: CoilFit,
    sine: Annotated[
        str, typer.Option(help="Wanted flux: a sine, Hz and Wb: 5:0.04.", metavar="HZ:WB[:CYCLES]", show_default=False)
    ] = "",
    desired: Annotated[Path | None, typer.Option(help="File with the wanted flux over time.")] = None,
    dt: Step = 1e-3,
    plant: Annotated[str, typer.Option(help="Fit that answers in the coil's place; default: the same.")] = "",
    *,
    drive: CoilDrive,
    work: Work,
) -> CommandAnswer:
    """Find the voltage for a wanted flux linkage of a coil, within limits, and the flux under it.

    Example: mrfit apply flux-command --fit stop-mmf.lsq.all --sine 5:0.04 --resistance 2.1 --voltage 12
    """
    from mrfit.apply import coil_stage
    from mrfit.apply.coil import flux_command as commanded

    if bool(sine) == bool(desired):
        raise ConfigError("give a wanted flux: --sine HZ:WB or --desired FILE")
    coil = coil_named(work, fit)
    answering = coil_named(work, plant) if plant else coil
    if desired:
        wanted, dt = coil_stage.wanted_flux(read_logs([desired], None))
        name = desired.name
    else:
        name, wanted = coil_stage.wanted_sine(sine, dt)
    found = commanded(coil, wanted, dt, drive, answering)
    return CommandAnswer(coil_stage.flux_command(work, coil, answering, drive, name, found), _print_flux_command)


def _print_flux_command(summary: "FluxCommandFile") -> None:
    from mrfit.apply.coil_stage import percent_text

    heads = ("wanted", "samples", "range (Wb)", "greatest error", "rms error", "limited", "voltage (V)", "current (A)")
    shares = map(percent_text, (summary.error, summary.rms_error, summary.limited))
    row = [summary.wanted, summary.samples, summary.range, *shares, summary.greatest_voltage, summary.greatest_current]
    console.print_table(f"Voltage for a flux of {summary.fit}; errors over the range", heads, [row])
    _conclude(summary)
