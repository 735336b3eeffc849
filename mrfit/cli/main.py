"""The command line: parse, call one stage, print. Heavy imports stay inside commands, so that --help is quick."""

from pathlib import Path
from typing import Annotated

import typer

from mrfit.cli import console
from mrfit.cli.export import export
from mrfit.cli.options import (
    CORES,
    WEIGHTS,
    WORK,
    Bounds,
    Budget,
    Catalog,
    CurrentOrder,
    DataSet,
    Fix,
    Folder,
    Jobs,
    Json,
    Logs,
    Map,
    MaxMemory,
    Only,
    OptSet,
    Pattern,
    Plugins,
    Resistance,
    Seconds,
    Seed,
    Stall,
    Start,
    Weight,
    Work,
    choice,
    constants,
    limits,
    numbers,
    ohms,
)
from mrfit.errors import ConfigError

app = typer.Typer(
    name="mrfit",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="From laboratory logs of magnetorheological dampers and their coils to identified models and error reports.",
)


@app.callback(invoke_without_command=True)
def root(
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show a traceback with an error.")] = False,
) -> None:
    """Identify hysteresis models from logs: ingest, flux, segment, fit, discover, report."""
    if version:
        from importlib.metadata import version as installed

        typer.echo(installed("mrfit"))
        raise typer.Exit


@app.command()
def ingest(
    logs: Logs,
    map_file: Map = None,
    resistance: Resistance = None,
    pattern: Pattern = None,
    preview: Annotated[bool, typer.Option("--preview", help="Show what would be read; write nothing.")] = False,
    max_memory: MaxMemory = None,
    jobs: Jobs = CORES,
    work: Work = WORK,
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """Read logs into recordings.

    Example: mrfit ingest datasets/coil/*.csv
    """
    from mrfit.cli import output, pipeline
    from mrfit.ingest.containers.memory import size_of
    from mrfit.ingest.stage import Settings
    from mrfit.ingest.stage import preview as preview_logs

    most = None if max_memory is None else size_of(max_memory)
    settings = Settings(map_file, ohms(resistance), pattern, jobs, max_memory=most)
    if preview:
        rows = preview_logs(logs, settings)
        return console.print_json(rows) if as_json else output.preview(rows)
    with console.progress_bar() as progress:
        summary = pipeline.ingest(work, logs, settings, progress)
    return console.print_json(summary) if as_json else output.ingest(summary, work)


@app.command()
def flux(
    resistance: Resistance = None,
    drift: Annotated[str, typer.Option(help="How drift is removed: cycle, linear or none.")] = "cycle",
    rule: Annotated[str, typer.Option(help="Integration rule: trapezoid or simpson.")] = "trapezoid",
    work: Work = WORK,
    as_json: Json = False,
) -> None:
    """Reconstruct flux linkage by integrating u − i·R.

    Example: mrfit flux --resistance 2.1
    """
    from mrfit.cli import output, pipeline
    from mrfit.flux.stage import Settings

    with console.progress_bar() as progress:
        summary = pipeline.flux(work, Settings(resistance=ohms(resistance), drift=drift, rule=rule), progress)
    return console.print_json(summary) if as_json else output.flux(summary, work)


@app.command()
def segment(
    drive: Annotated[str | None, typer.Option(help="Channel that defines the condition; default: found.")] = None,
    min_cycles: Annotated[int, typer.Option(min=1, help="Fewest steady cycles; a test of fewer is one stretch.")] = 2,
    holdout: Annotated[
        str,
        typer.Option(help="Held out: auto, none, conditions by current=3 or a pattern on names, or after=SECONDS."),
    ] = "auto",
    work: Work = WORK,
    as_json: Json = False,
) -> None:
    """Cut recordings into whole steady cycles by test condition.

    Example: mrfit segment --holdout 'sine-*-3A'
    """
    from mrfit.cli import output, pipeline
    from mrfit.segment.stage import Settings

    with console.progress_bar() as progress:
        settings = Settings(drive=drive, min_cycles=min_cycles, holdout=holdout)
        summary = pipeline.segment(work, settings, progress)
    return console.print_json(summary) if as_json else output.segment(summary, work)


@app.command()
def fit(
    model: Annotated[str, typer.Option(help="Model; `mrfit list models` shows all.")],
    opt: Annotated[str, typer.Option(help="Optimizer or chain, as in pso-fmin.")] = "auto",
    opt_set: OptSet = None,
    per: Annotated[str, typer.Option(help="Parameters per condition, or one set for all.")] = "condition",
    name: Annotated[str, typer.Option(help="Name of the fit; default MODEL.OPT.", show_default=False)] = "",
    seed: Seed = 0,
    budget: Budget = None,
    seconds: Seconds = None,
    stall: Stall = 0.5,
    weight: Weight = "none",
    bounds: Bounds = None,
    start: Start = None,
    fix: Fix = None,
    current_order: CurrentOrder = "auto",
    only: Only = "",
    intervals: Annotated[str, typer.Option(help="Of parameters: hac, bootstrap or profile.")] = "hac",
    resistance: Resistance = None,
    jobs: Jobs = CORES,
    work: Work = WORK,
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """Fit a model; runs flux and segment first where they are due.

    Example: mrfit fit --model boucwen-flux --opt pso-fmin
    """
    from mrfit.cli import output, pipeline
    from mrfit.fit.stage import Settings

    settings = Settings(
        model=model,
        optimizer=opt,
        options=constants(opt_set),
        per=choice("--per", per, ("condition", "all")),  # type: ignore[arg-type]
        name=name,
        seed=seed,
        budget=budget,
        seconds=seconds,
        stall=stall,
        weight=choice("--weight", weight, WEIGHTS),  # type: ignore[arg-type]
        bounds=limits(bounds),
        start=numbers("--start", start),
        fixed=numbers("--fix", fix),
        current_order=current_order,
        only=only,
        intervals=choice("--intervals", intervals, ("hac", "bootstrap", "profile")),  # type: ignore[arg-type]
        jobs=jobs,
    )
    with console.progress_bar() as progress:
        summary = pipeline.fit(work, settings, ohms(resistance), progress)
    return console.print_json(summary) if as_json else output.fit(summary, work)


@app.command()
def predict(
    logs: Logs,
    fit_name: Annotated[str, typer.Option("--fit", help="Name of a finished fit.")],
    map_file: Map = None,
    resistance: Resistance = None,
    pattern: Pattern = None,
    work: Work = WORK,
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """Simulate a fitted model on other logs (free run) and report the errors there.

    Example: mrfit predict --fit boucwen-flux.pso-fmin datasets/coil/coil_05Hz_3A.csv
    """
    from mrfit.cli import output, pipeline
    from mrfit.ingest.stage import Settings

    settings = Settings(map=map_file, resistance=ohms(resistance), pattern=pattern)
    with console.progress_bar() as progress:
        summary = pipeline.predict(work, fit_name, logs, settings, progress)
    return console.print_json(summary) if as_json else output.predict(summary)


@app.command()
def report(
    fits: Annotated[list[str] | None, typer.Option("--fit", help="Fit to report; default: all.")] = None,
    jobs: Jobs = CORES,
    work: Work = WORK,
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """Write tables (CSV, LaTeX), figures (SVG) and one HTML file.

    Example: mrfit report
    """
    from mrfit.cli import output, pipeline
    from mrfit.report.stage import Settings

    with console.progress_bar() as progress:
        summary = pipeline.report(work, Settings(tuple(fits or ()), jobs), progress)
    return console.print_json(summary) if as_json else output.report(summary, work)


@app.command()
def run(
    file: Annotated[Path, typer.Argument(help="Pipeline file (TOML).", show_default=False)],
    logs: Annotated[list[Path] | None, typer.Option("--log", help="Log or folder instead of the file's.")] = None,
    work: Annotated[Path | None, typer.Option(help="Workspace folder instead of the file's.")] = None,
    jobs: Jobs = CORES,
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """Run every stage of a pipeline file in order.

    Example: mrfit run pipelines/coil-flux.toml
    """
    from mrfit.cli import output, pipeline
    from mrfit.cli.config import read_pipeline

    config = read_pipeline(file)
    with console.progress_bar() as progress:
        summary = pipeline.run(config, file.parent, pipeline.Overrides(logs, work, jobs), progress)
    return console.print_json(summary) if as_json else output.run(summary)


@app.command()
def discover(
    model: Annotated[str, typer.Option(help="Base model; effects written with it (tanh+delay) are part of it.")],
    start: Start = None,
    seed: Seed = 0,
    current_order: CurrentOrder = "auto",
    resistance: Resistance = None,
    work: Work = WORK,
    jobs: Jobs = CORES,
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """Find where a model is wrong and which effect it lacks; runs flux and segment first where they are due.

    Example: mrfit discover --model boucwen-flux
    """
    from mrfit.cli import output, pipeline
    from mrfit.discover.stage import Settings

    settings = Settings(model, current_order, numbers("--start", start), seed, jobs)
    with console.progress_bar() as progress:
        summary = pipeline.discover(work, settings, ohms(resistance), progress)
    return console.print_json(summary) if as_json else output.discover(summary, work)


@app.command()
def advise(work: Work = WORK, plugins: Plugins = None, as_json: Json = False) -> None:
    """Say which test would settle what the last discovery left open.

    Example: mrfit advise
    """
    from mrfit.cli import output, pipeline

    summary = pipeline.advise(work)
    return console.print_json(summary) if as_json else output.advise(summary)


@app.command()
def compare(
    models: Annotated[str, typer.Option(help="Models by commas, or all.", show_default=False)] = "",
    optimizers: Annotated[str, typer.Option(help="Instead: optimizers by commas, on one --model.")] = "",
    model: Annotated[str, typer.Option(help="Model on which optimizers are compared.", show_default=False)] = "",
    seeds: Annotated[int, typer.Option(min=1, help="Runs of each optimizer, from different starts.")] = 5,
    opt: Annotated[str, typer.Option(help="Optimizer with which models are compared.")] = "auto",
    opt_set: OptSet = None,
    per: Annotated[str, typer.Option(help="Parameters per condition, or one set for all.")] = "all",
    seed: Seed = 0,
    budget: Budget = None,
    seconds: Seconds = None,
    stall: Stall = 0.5,
    weight: Weight = "none",
    bounds: Bounds = None,
    start: Start = None,
    fix: Fix = None,
    current_order: CurrentOrder = "auto",
    only: Only = "",
    jobs: Jobs = CORES,
    work: Work = WORK,
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """Compare models on all conditions, or optimizers on one model.

    Example: mrfit compare --models all
    """
    from mrfit.cli import output, pipeline

    options: dict[str, object] = {"options": constants(opt_set), "stall": stall}
    options |= {"budget": budget, "seconds": seconds, "current_order": current_order, "only": only, "jobs": jobs}
    options |= {"per": choice("--per", per, ("condition", "all")), "weight": choice("--weight", weight, WEIGHTS)}
    if bool(models) == bool(optimizers) or bool(optimizers) != bool(model):
        raise ConfigError("compare takes --models NAMES, or --optimizers NAMES together with --model NAME")
    own = {"bounds": limits(bounds), "start": numbers("--start", start), "fixed": numbers("--fix", fix)}
    if models and any(own.values()):
        raise ConfigError("--bounds, --start and --fix go with --optimizers: models have parameters of their own")
    with console.progress_bar() as progress:
        if models:
            chosen = tuple(n.strip() for n in models.split(","))
            summary = pipeline.compare_models(work, chosen, {**options, "optimizer": opt, "seed": seed}, progress)
        else:
            tried = tuple(n.strip() for n in optimizers.split(","))
            summary = pipeline.compare_optimizers(work, tried, {**options, **own, "model": model}, seeds, progress)
    if as_json:
        return console.print_json(summary)
    return output.compare_models(summary, work) if models else output.compare_optimizers(summary, work)


@app.command()
def status(work: Work = WORK, plugins: Plugins = None, as_json: Json = False) -> None:
    """Show what the workspace holds, what each step used, and what is out of date and why.

    Example: mrfit status
    """
    from mrfit.cli import output, pipeline

    with console.progress_bar() as progress:
        summary = pipeline.status(work, progress)
    return console.print_json(summary) if as_json else output.status(summary)


@app.command()
def remove(
    fits: Annotated[list[str], typer.Argument(help="Names of fits.", metavar="FIT...", show_default=False)],
    work: Work = WORK,
    as_json: Json = False,
) -> None:
    """Take fits out of the workspace; a report that shows them is made anew by `mrfit report`.

    Example: mrfit remove boucwen-flux.pso-fmin
    """
    from mrfit.cli import output, pipeline

    summary = pipeline.remove(work, fits)
    return console.print_json(summary) if as_json else output.remove(summary)


@app.command()
def datasets(name: DataSet = "", to: Folder = None, catalog_file: Catalog = None, as_json: Json = False) -> None:
    """List public data sets, or fetch one: every file is checked against its SHA-256.

    Example: mrfit datasets mr_damper_utfsm
    """
    from mrfit.cli import catalog, output

    sets = catalog.read_catalog(catalog_file)
    if not name:
        rows = catalog.rows(sets)
        return console.print_json(rows) if as_json else output.datasets(rows)
    with console.progress_bar() as progress:
        summary = catalog.fetch(sets, name, to, progress)
    return console.print_json(summary) if as_json else output.dataset(summary)


@app.command("list")
def list_names(
    kind: Annotated[str, typer.Argument(help="models, effects, optimizers or readers.")] = "models",
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """List what there is of a kind, with its title.

    Example: mrfit list models
    """
    from mrfit.cli import output

    rows = output.registry_rows(kind)
    return console.print_json(rows) if as_json else output.registry_table(kind, rows)


@app.command()
def show(
    name: Annotated[str, typer.Argument(help="Model, effect, optimizer or reader.", show_default=False)],
    plugins: Plugins = None,
    as_json: Json = False,
) -> None:
    """Show one item: equation, parameters with units and bounds, source; of an effect what it is mistaken for.

    Example: mrfit show current-lag
    """
    from mrfit.cli import output

    item = output.item(name)
    return console.print_json(item) if as_json else output.show(item)


app.command()(export)


def main() -> None:
    """Run the command line."""
    console.run(app)


if __name__ == "__main__":
    main()
