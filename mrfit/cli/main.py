"""The command line: parse, call one stage, print. Heavy imports stay inside commands, so that --help is quick."""

import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

import mrfit.settings.compare
import mrfit.settings.discover
import mrfit.settings.fit
import mrfit.settings.flux
import mrfit.settings.ingest
import mrfit.settings.report
import mrfit.settings.segment
from mrfit.cli import apply, console, logbook, measure, names, project
from mrfit.cli import plot as signals
from mrfit.cli.advise import advise
from mrfit.cli.batch import batch
from mrfit.cli.drift import drift
from mrfit.cli.export import export
from mrfit.cli.figure import figure
from mrfit.cli.options import Catalog, CommandAnswer, DataSet, FinishedFit, Folder, Logs, Only, Work, options
from mrfit.cli.track import track_parameters
from mrfit.core.progress import Progress
from mrfit.settings.shared import Jobs, Resistance

app = typer.Typer(
    name="mrfit",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="From laboratory logs of magnetorheological dampers and their coils to identified models and error reports.",
)

app.add_typer(apply.app, name="apply")
app.add_typer(measure.app, name="measure")


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show a traceback with an error.")] = False,
) -> None:
    """Identify hysteresis models from logs: ingest, flux, segment, fit, discover, report."""
    if version:
        from importlib.metadata import version as installed

        typer.echo(installed("mrfit"))
        raise typer.Exit
    commands: dict[str, Any] = getattr(context.command, "commands", {})
    groups = {name: list(inner) for name, one in commands.items() if (inner := getattr(one, "commands", None))}
    context.default_map = project.defaults(commands, groups)


@app.command()
@options(sends=True)
def ingest(
    logs: Logs,
    settings: mrfit.settings.ingest.Settings,
    *,
    preview: Annotated[bool, typer.Option("--preview", help="Show what would be read; write nothing.")] = False,
    suggest_map: Annotated[
        bool,
        typer.Option("--suggest-map", help="Suggest a channel map: beside unknown logs, or into a pipe; read nothing."),
    ] = False,
    plot: Annotated[
        bool, typer.Option("--plot", help="Also draw them as recorded, into plot of the workspace.")
    ] = False,
    work: Work,
    progress: Progress,
) -> CommandAnswer:
    """Read logs into recordings.

    Example: mrfit ingest datasets/coil/*.csv
    """
    from mrfit.cli import output, pipeline
    from mrfit.ingest.stage import preview as preview_logs

    if suggest_map:
        from mrfit.ingest import suggestion

        if not (console.VERBOSITY.as_json or sys.stdout.isatty()):
            return CommandAnswer(suggestion.suggest(logs, settings), sys.stdout.write)
        return CommandAnswer({"map": str(suggestion.write(logs, settings))}, output.suggestion)
    if preview:
        return CommandAnswer(preview_logs(logs, settings), output.preview)
    if not settings.map and (text := project.unused_map(logs)):
        console.note(text)
    summary = pipeline.ingest(work, logs, settings, progress)
    files = pipeline.plot(work, progress) if plot else []
    return CommandAnswer(summary | ({"plot": [str(path) for path in files]} if plot else {}), output.ingest, work)


@app.command()
@options(plugins=False)
def flux(settings: mrfit.settings.flux.Settings, work: Work, progress: Progress) -> CommandAnswer:
    """Reconstruct flux linkage by integrating u − i·R.

    Example: mrfit flux --resistance 2.1
    """
    from mrfit.cli import output, pipeline

    return CommandAnswer(pipeline.flux(work, settings, progress), output.flux, work)


@app.command()
@options(plugins=False)
def segment(settings: mrfit.settings.segment.Settings, work: Work, progress: Progress) -> CommandAnswer:
    """Cut recordings into whole steady cycles by test condition.

    Example: mrfit segment --holdout 'sine-*-3A'
    """
    from mrfit.cli import output, pipeline

    return CommandAnswer(pipeline.segment(work, settings, progress), output.segment, work)


@app.command()
@options(sends=True)
def fit(
    settings: mrfit.settings.fit.Settings,
    *,
    resistance: Resistance = None,
    work: Work,
    progress: Progress,
) -> CommandAnswer:
    """Fit a model; runs flux and segment first where they are due.

    Example: mrfit fit --model boucwen-flux --opt pso-fmin
    """
    from mrfit.cli import output, pipeline

    return CommandAnswer(pipeline.fit(work, settings, resistance, progress), output.fit, work)


@app.command()
@options()
def predict(
    logs: Logs,
    fit_name: FinishedFit,
    settings: Annotated[mrfit.settings.ingest.Settings, Only(("map", "resistance", "pattern"))],
    *,
    save: Annotated[str, typer.Option(help="Keep series and figure as predict/NAME.parquet, or NAME.csv.")] = "",
    work: Work,
    progress: Progress,
) -> CommandAnswer:
    """Simulate a fitted model on other logs (free run), and report the errors where the output was measured.

    Example: mrfit predict --fit boucwen-flux.pso-fmin datasets/coil/coil_05Hz_3A.csv
    """
    from mrfit.cli import output, pipeline

    return CommandAnswer(
        pipeline.predict(work, pipeline.ToPredict(fit_name, save), logs, settings, progress), output.predict
    )


@app.command()
@options()
def report(settings: mrfit.settings.report.Settings, work: Work, progress: Progress) -> CommandAnswer:
    """Write tables (CSV, LaTeX), figures (SVG) and one HTML file.

    Example: mrfit report
    """
    from mrfit.cli import output, pipeline

    return CommandAnswer(pipeline.report(work, settings, progress), output.report, work)


@app.command()
@options(sends=True)
def run(
    file: Annotated[Path, typer.Argument(help="Pipeline file (TOML).", show_default=False)],
    *,
    logs: Annotated[list[Path] | None, typer.Option("--log", help="Log or folder instead of the file's.")] = None,
    work: Annotated[Path | None, typer.Option(help="Workspace folder instead of the file's.")] = None,
    jobs: Jobs,
    progress: Progress,
) -> CommandAnswer:
    """Run every stage of a pipeline file in order.

    Example: mrfit run pipelines/coil-flux.toml
    """
    from mrfit.cli import output, pipeline
    from mrfit.cli.config import read_pipeline

    config = read_pipeline(file)
    started = time.monotonic()
    summary = pipeline.run(config, file.parent, pipeline.Overrides(logs, work, jobs), progress)
    # the file names the workspace
    logbook.append(Path(summary["work"]), time.monotonic() - started)
    return CommandAnswer(summary, output.run, check=output.check_exports)


@app.command()
@options(sends=True)
def discover(
    settings: mrfit.settings.discover.Settings,
    *,
    resistance: Resistance = None,
    work: Work,
    progress: Progress,
) -> CommandAnswer:
    """Find where a model is wrong and which effect it lacks; runs flux and segment first where they are due.

    Example: mrfit discover --model boucwen-flux
    """
    from mrfit.cli import output, pipeline

    return CommandAnswer(pipeline.discover(work, settings, resistance, progress), output.discover, work)


app.command()(advise)
app.command()(figure)
app.command()(signals.plot)


@app.command()
@options(sends=True)
def compare(
    settings: mrfit.settings.compare.CompareOptions,
    *,
    work: Work,
    progress: Progress,
) -> CommandAnswer:
    """Compare models on all conditions, or optimizers on one model.

    Example: mrfit compare --models all
    """
    from mrfit.cli import output, pipeline

    if settings.models:
        models = pipeline.compare_models(work, settings.of_models, progress)
        return CommandAnswer(models, output.compare_models, work)
    return CommandAnswer(
        pipeline.compare_optimizers(work, settings.of_optimizers, progress), output.compare_optimizers, work
    )


@app.command()
@options()
def status(work: Work, progress: Progress) -> CommandAnswer:
    """Show what the workspace holds, what each step used, and what is out of date and why.

    Example: mrfit status
    """
    from mrfit.cli import output, pipeline

    return CommandAnswer(pipeline.status(work, progress), output.status)


@app.command()
@options(plugins=False)
def remove(
    fits: Annotated[
        list[str],
        typer.Argument(help="Names of fits.", metavar="FIT...", show_default=False, autocompletion=names.fit),
    ],
    *,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would be removed, and stop.")] = False,
    work: Work,
) -> CommandAnswer:
    """Take fits out of the workspace; `mrfit report` updates a report that shows them.

    Example: mrfit remove boucwen-flux.pso-fmin
    """
    from mrfit.cli import output, pipeline

    return CommandAnswer(pipeline.remove(work, fits, dry_run), output.remove)


@app.command()
@options(plugins=False)
def datasets(
    *, name: DataSet = "", to: Folder = None, catalog_file: Catalog = None, progress: Progress
) -> CommandAnswer:
    """List public data sets, or fetch one: every file is checked against its SHA-256.

    Example: mrfit datasets mr_damper_utfsm
    """
    from mrfit.cli import catalog, output

    sets = catalog.read_catalog(catalog_file)
    if not name:
        return CommandAnswer(catalog.rows(sets), output.datasets)
    return CommandAnswer(catalog.fetch(sets, name, to, progress), output.dataset)


@app.command("list")
@options()
def list_names(
    *,
    kind: Annotated[str, typer.Argument(help="models, effects, optimizers or readers.")] = "models",
) -> CommandAnswer:
    """List all items of a kind, with their titles.

    Example: mrfit list models
    """
    from mrfit.cli import output

    return CommandAnswer(output.registry_rows(kind), output.registry_table, kind)


@app.command()
@options()
def show(
    name: Annotated[
        str,
        typer.Argument(help="Model, effect, optimizer or reader.", show_default=False, autocompletion=names.item),
    ],
) -> CommandAnswer:
    """Show one item: equation, parameters with units and bounds, source; of an effect what it is mistaken for.

    Example: mrfit show current-lag
    """
    from mrfit.cli import output

    return CommandAnswer(output.item(name), output.show)


app.command()(export)
app.command()(batch)
app.command()(drift)
app.command("track-parameters")(track_parameters)


def main() -> None:
    """Run the command line."""
    console.run(app)


if __name__ == "__main__":
    main()
