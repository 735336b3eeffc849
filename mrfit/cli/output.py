"""Output of each command for a person."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.cli import export, plot
from mrfit.cli import summary as in_one_line
from mrfit.cli.console import (
    VERBOSITY,
    WrittenNumber,
    conclude,
    numbers,
    outdated_line,
    print_table,
    say,
    say_each,
)
from mrfit.core.channels import CHANNELS, unit_of
from mrfit.core.counting import number_of
from mrfit.core.grouping import grouped
from mrfit.core.recording import RECORD_CONSTANTS
from mrfit.errors import ConfigError, near, unknown_name

if TYPE_CHECKING:
    from mrfit.ingest.stage import Preview

Summary = dict[str, Any]
PRINTED_METRICS = ("condition", "role", "samples", "rmse", "nrmse", "noise_floor", "esr", "fit_percent")
NUMBER = re.compile(r"[-+]?\d[\d.,e+-]*")
# Coefficients of which name and unit do not say enough: all but those of plain powers of the current
OTHER_COEFFICIENT = re.compile(r"coefficient of (?!i\^\d of [\w.]+$)")
# Characters for the columns of a table beside its first
ROOM = 110
# What stands behind a column's name: y for the unit of the output
METRIC_UNITS = {"rmse": "y", "nrmse": "%", "noise_floor": "y", "esr": "%", "fit_percent": "%"}


def _state(summary: Summary) -> str:
    return " (nothing had changed)" if summary.get("skipped") else ""


def ingest(summary: Summary, work: Path) -> None:
    """Print the recordings that were read and their oddities."""
    rows = [
        [r["id"], r["reader"], r["rows_kept"], r["rows_refused"], r["dt"], channels_text(r), condition_text(r)]
        for r in summary["recordings"]
    ]
    columns = ("recording", "reader", "rows", "refused", "dt (s)", "channels", "condition")
    print_table(f"Recordings in {work}{_state(summary)}", columns, rows)
    _say_once(f"{s}: {summary['reasons'][s]}; its recordings are replaced" for s in summary["replaced"])
    say_each(map(copy_text, summary.get("copies", [])))
    _say_once(f"{r['id']}: {finding['text']}" for r in summary["recordings"] for finding in r["findings"])
    _say_unnamed([(r["id"], [c["name"] for c in r["channels"]]) for r in summary["recordings"]])
    _refused(summary)
    conclude(in_one_line.ingest(summary, work))
    if "plot" in summary:
        plot.conclude(summary["plot"])


def _refused(summary: Summary) -> None:
    say_each(f"refused {r['source']}: {r['reason']}; {r['remedy']}" for r in summary["refused"])


def _say_once(findings: Iterable[str]) -> None:
    """Say each fault once, of findings ``LOG: TEXT``: the first log that has it, and how many more do."""
    faults = grouped((NUMBER.sub("#", f.partition(": ")[2] or f), f) for f in findings)
    for found in faults.values():
        log, colon, text = found[0].partition(": ")
        more = len({one.partition(": ")[0] for one in found}) - 1
        if len({one.partition(": ")[2] for one in found}) == 1:
            say(f"  {log}{f' and {more} more' if more else ''}{colon}{text}")
        else:
            others = f"in {more} more" if more else "once more" if len(found) == 2 else f"{len(found) - 1} times more"
            say(f"  {log}{colon}{text} (and the like, with other numbers, {others})")


def _say_unnamed(logs: Sequence[tuple[str, Sequence[str]]]) -> None:
    """Name the logs, of these with their channels, that hold no channel of a model."""
    unnamed = [log for log, channels in logs if not {*channels} & {*CHANNELS}]
    if unnamed:
        more = f" and {len(unnamed) - 1} more" if len(unnamed) > 1 else ""
        text = "no channel a model takes; `mrfit ingest LOGS --suggest-map` writes a channel map to name them in"
        say(f"  {unnamed[0]}{more}: {text}")


def copy_text(copy: Summary) -> str:
    """Return the treatment of a log that holds the same bytes as another one, in words."""
    if copy["read"]:
        why = "but its name or settings make another test of it: both are kept; if one is wrong, ingest without it"
        return f"{copy['source']}: the same bytes as {copy['of']}, {why} into another --work folder"
    return f"{copy['source']}: a copy of {copy['of']} (the same bytes): read once"


def suggestion(summary: Summary) -> None:
    """Print the path of a suggested channel map."""
    conclude(f"Channel map to start from: {summary['map']}; check every line of it, then run `mrfit ingest` again")


def channels_text(recording: Summary) -> str:
    """Return a recording's channels with their units in one line."""
    return ", ".join(f"{c['name']} ({c['unit']})" if c["unit"] else c["name"] for c in recording["channels"])


def condition_text(recording: Summary) -> str:
    """Return the condition of the test in one line."""
    from mrfit.ingest.meaning.conditions import condition_words

    return condition_words(recording.get("condition", {}), [c["name"] for c in recording["channels"]])


def preview(rows: "Sequence[Preview]") -> None:
    """Print a preview: logs, their oddities, and the files that would be refused, each remedy once."""
    read = [r for r in rows if r.reader != "refused"]
    columns = ("source", "reader", "channels", "rate", "rows", "refused", "start", "condition")
    if read:
        print_table("What would be read", columns, [numbers(asdict(r), columns) for r in read])
    for row in read:
        if row.oddities:
            say(f"  {row.source}: {row.oddities}")
    _say_unnamed([(r.source, [c.split(" (")[0] for c in r.channels.split(", ")]) for r in read])
    remedies = grouped((row.remedy, row) for row in rows if row.reader == "refused")
    for remedy, refused in remedies.items():
        say_each(f"refused {row.source}: {row.oddities}" for row in refused)
        say(f"    to read {'it' if len(refused) == 1 else f'these {len(refused)}'}: {remedy}")
    conclude(in_one_line.preview(rows))


def flux(summary: Summary, work: Path) -> None:
    """Print the reconstruction of flux linkage."""
    names = ("id", "action", "resistance", "resistance_source", "offset_volt", "closure_rms", "loop_area")
    columns = ("recording", "what was done", "R (Ω)", "R from", "offset (V)", "closure (Wb)", "loop area (J)")
    rows = [numbers(r, names) for r in summary["recordings"]]
    print_table(f"Flux linkage in {work}{_state(summary)}", columns, rows)
    _say_once(summary.get("findings", []))
    say_each(summary.get("separation_text", []))
    _notes(summary)
    conclude(in_one_line.flux(summary, work))


def segment(summary: Summary, work: Path) -> None:
    """Print the segments found and what was cut."""
    names = ("recording", "condition", "waveform", "frequency", "amplitude", "offset", "cycles", "role")
    unit = ", ".join(sorted({unit_of(s["drive"]) for s in summary["segments"]}))
    columns = (*names[:3], "f (Hz)", f"amplitude ({unit})", f"offset ({unit})", *names[6:])
    print_table(f"Segments in {work}{_state(summary)}", columns, [numbers(s, names) for s in summary["segments"]])
    _say_once(summary.get("findings", []))
    _notes(summary)
    conclude(in_one_line.segment(summary, work))


def _notes(summary: Summary) -> None:
    say_each(summary.get("notes", ()))


def fit(summary: Summary, work: Path) -> None:
    """Print a fit's errors, its parameters (in full for one to three results) and the reasons to distrust it."""
    title = f"Fit {summary['name']}: {summary['model']} by {summary['optimizer']}, seed {summary['seed']}"
    _errors(title + _state(summary), summary)
    for result in summary["results"][: 3 if len(summary["results"]) <= 3 else 1]:
        rows = [_parameter(p) for p in [*result["parameters"], *result["derived"]]]
        columns = ("parameter", "value", "unit", "95 % low", "95 % high", "determined")
        print_table(f"Parameters, {result['condition']}", columns, rows)
        say_each(f"{q['name']}: {q['text']}" for q in result["derived"] if OTHER_COEFFICIENT.match(q["text"]))
        say_each(result.get("identifiability", []))
        for stage in result.get("stages", []):
            error = f", RMS error {stage['cost']:.4g}" if "cost" in stage else ""
            say(f"  stage {stage['stage']}: {number_of('segment', len(stage['segments']))}{error}")
    for choice in ("current_choice", "form_choice"):
        say_each((summary.get(choice) or {}).get("text", []))
    if len(summary["results"]) > 3:
        say(f"All {len(summary['results'])} sets of parameters: {work}/fits/{summary['name']}/parameters.csv")
    _notes(summary)
    warnings(summary)
    conclude(in_one_line.fit(summary, work))


def _parameter(row: Summary) -> list[object]:
    """Return the cells of a parameter: as many digits as its interval tells."""
    from mrfit.report.numbers import with_interval

    value, low, high = (WrittenNumber(t) or None for t in with_interval(row["value"], row.get("low"), row.get("high")))
    return [row["name"], value, row["unit"], low, high, row["determined"]]


def _errors(title: str, summary: Summary) -> None:
    units = {n: unit_of(summary["output"]) if u == "y" else u for n, u in METRIC_UNITS.items()}
    columns = [f"{n.removesuffix('_percent')} ({units[n]})" if units.get(n) else n for n in PRINTED_METRICS]
    rows = [{**m, "nrmse": _of_hundred(m.get("nrmse"))} for m in summary["metrics"]]
    print_table(title, columns, [numbers(m, PRINTED_METRICS) for m in rows])


def warnings(summary: Summary) -> None:
    """Print the warnings on a whole fit, and each kind of those on its conditions with how many it holds for.

    Where one condition has several of a kind, as on stages without a test, each is told.
    """
    _whole_warnings(summary)
    kinds: dict[tuple[str, int], list[tuple[str, str]]] = {}
    for result in summary["results"]:
        for place, warning in enumerate(result["warnings"]):
            earlier = sum(w["kind"] == warning["kind"] for w in result["warnings"][:place])
            kinds.setdefault((warning["kind"], earlier), []).append((result["condition"], warning["text"]))
    for (kind, _), found in kinds.items():
        condition, text = found[0]
        others = len(found) - 1
        more = f" (and {number_of('more condition', others)})" if others else ""
        say(f"  warning {kind}: {condition}{more}: {text}")


def _whole_warnings(summary: Summary) -> None:
    say_each(f"warning {w['kind']}: {w['text']}" for w in summary["warnings"])


def predict(summary: Summary) -> None:
    """Print the errors of a prediction and whose parameters it used."""
    if summary["metrics"]:
        _errors(f"Prediction by {summary['fit']}", summary)
    simulated = summary.get("simulated_only", [])
    if simulated:
        keep = "" if summary.get("files") else "; --save NAME keeps what was simulated"
        say(f"Simulated without a measured {summary['output']}: {', '.join(simulated)}{keep}")
    for segment_id, condition in summary["used"].items():
        own = summary["conditions"][segment_id]
        nearest = "" if condition in ("all", own) else f", the nearest to {own} that was fitted"
        say(f"  {segment_id}: parameters of {condition}{nearest}")
    say(f"95 % band: {summary['band']}")
    _say_once(summary["findings"])
    export.outdated({summary["fit"]: "; ".join(summary["reasons"])})
    _whole_warnings(summary)
    if summary.get("files"):
        say(f"Files: {', '.join(summary['files'])}")
    _refused(summary)
    conclude(in_one_line.predict(summary))


def compare_models(summary: Summary, work: Path) -> None:
    """Print models against conditions, output by output: errors over all conditions, the time of each fit, NRMSE."""
    from mrfit.compare.page import labels, together
    from mrfit.io.schemas.compare import LeftOut, ModelCaution, ModelRow

    names = ("parameters", "holdout_nrmse", "holdout_fit_percent", "train_nrmse", "train_fit_percent")
    errors = [f"{role} {name} (%)" for role in ("hold-out", "train") for name in ("NRMSE", "fit")]
    columns = ["model", "parameters", *errors, "time (s)"]
    found = {(m["fit"], m["role"], m["condition"]): m["nrmse"] for m in summary["metrics"]}
    called = labels([ModelRow(**m) for m in summary["models"]])
    for output in dict.fromkeys(m["output"] for m in summary["models"]):
        models = [m for m in summary["models"] if m["output"] == output]
        shares = [{**m, **{n: _of_hundred(m.get(n)) for n in names if n.endswith("_nrmse")}} for m in models]
        rows = [[called[m["fit"]], *numbers(m, names), summary["seconds"].get(m["fit"])] for m in shares]
        held = any(m.get("holdout_nrmse") is not None for m in models)
        order = f"by {'hold-out' if held else 'train'} NRMSE, those judged on fewer samples last"
        print_table(f"Models of {output} in {work}, {order}", columns, rows)
        shown = {m["fit"] for m in models}
        own = [m for m in summary["metrics"] if m["fit"] in shown]
        for role in dict.fromkeys(m["role"] for m in own):
            there = dict.fromkeys(m["condition"] for m in own if m["role"] == role and m["condition"] != "all")
            for some in _side_by_side(list(there)):
                per_condition = [
                    [called[m["fit"]], *(_percent(found.get((m["fit"], role, c))) for c in some)] for m in models
                ]
                print_table(f"NRMSE of {output} in percent, {role}", ("model", *some), per_condition)
    _notes(summary)
    cautions, left_out = [ModelCaution(**r) for r in summary["warnings"]], [LeftOut(**r) for r in summary["left_out"]]
    say_each(map(": ".join, together(cautions, "text")), "  warning recordings-left-out: ")
    say_each(map(": ".join, together(left_out, "reason")), "  left out ")
    if summary["kept"]:
        say(f"  of earlier comparisons, in the table as they were: {', '.join(summary['kept'])}")
    say_each(map(": ".join, summary["dropped"].items()), "  no longer in the table: ")
    say(f"Files: {work / 'compare'}/compare.html, compare.csv, compare.json")
    conclude(in_one_line.compare_models(summary))


def _side_by_side(names: Sequence[str]) -> list[list[str]]:
    """Return columns' names in groups that stand side by side in one table without being cut."""
    groups: list[list[str]] = [[]]
    for name in names:
        if sum(len(n) + 3 for n in [*groups[-1], name]) > ROOM and groups[-1]:
            groups.append([])
        groups[-1].append(name)
    return groups


def _of_hundred(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _percent(share: float | None) -> float | None:
    value = _of_hundred(share)
    return None if value is None else round(value, 2)


def compare_optimizers(summary: Summary, work: Path) -> None:
    """Print best, median and worst cost of every optimizer."""
    names = ("condition", "optimizer", "best", "median", "worst", "unit", "evaluations", "seconds")
    settings = summary["settings"]
    title = f"Optimizers on {settings['model']}, {settings['seeds']} seeds: RMS error"
    print_table(title, names, [numbers(r, names) for r in summary["rows"]])
    _notes(summary)
    _whole_warnings(summary)
    say(f"Files: {work / 'compare'}/optimizers.html, optimizers.csv, optimizers.json")
    conclude(in_one_line.compare_optimizers(summary))


def discover(summary: Summary, work: Path) -> None:
    """Print a discovery: verdict in words, where the error sits, effects, errors on held-out data, candidates."""
    from mrfit.io.schemas.discovery import DiscoveryFile
    from mrfit.report.explain import headline, next_step, parameter_rows, sentences, takes_of
    from mrfit.report.law_words import other_law_sentences
    from mrfit.report.numbers import percent

    found = DiscoveryFile.of(summary)
    conclude(f"{headline(found)}{_state(summary)}")
    _notes(summary)
    for line in other_law_sentences(found):
        say(f"  Nearer: {line} --work {work}" if "mrfit discover" in line else f"  {line}")
    say_each([*sentences(found), *found.where_text[1:]])
    shown = [
        [e.name, p.name, p.value, p.interval, percent(e.holdout_nrmse_before), percent(e.holdout_nrmse_after)]
        for e in found.effects
        for p in parameter_rows(e)
    ]
    if shown:
        print_table(
            "Effects", ("effect", "parameter", "value", "95 % interval", "hold-out NRMSE without", "with"), shown
        )
    if summary["candidates"]:
        columns = ("candidate", "takes (%)", "judged", "accepted", "reason")
        rows = [[c.name, *takes_of(found, c)[1:], c.accepted, c.reason] for c in found.candidates]
        print_table("Candidates", columns, rows)
    if summary["verdict"] == "ambiguous":
        advise(summary)
    if next_step(found):
        say(f"Go on with: {next_step(found)} --work {work}")
    say(f"Page: {summary['page']}")


def advise(summary: Summary) -> None:
    """Print the tests that would settle what a discovery left open."""
    if summary.get("outdated"):
        say(f"  {outdated_line(summary['reason'], 'discover again')}")
    if not summary["advice"]:
        say(f"Nothing to settle: the last discovery on {summary['base_model']} ended with '{summary['verdict']}'.")
        return
    opening = {
        "ambiguous": f"To tell {', '.join(summary['ambiguous_set'])} apart:",
        "insufficient-data": "To reach a verdict:",
    }
    say(opening.get(summary["verdict"], "What would help:"))
    say_each(summary["advice"])


def report(summary: Summary, work: Path) -> None:
    """Print the path of the report, and those of its fits that are older than the data."""
    export.outdated(summary["reasons"])
    _notes(summary)
    conclude(f"Report{_state(summary)}: {summary['index']}")


def status(summary: Summary) -> None:
    """Print the steps of a workspace: result, settings, and the reason where one is out of date."""
    rows = [
        [s["step"], s["name"], s["holds"], settings_text(s["settings"]), s["code"][:8] or None, not s["outdated"]]
        for s in summary["steps"]
    ]
    columns = ("step", "name", "what there is", "made with", "code", "up to date")
    print_table(f"Workspace {summary['work']}", columns, rows)
    for step in summary["steps"]:
        if step["outdated"]:
            say(f"  out of date: {' '.join(filter(None, (step['step'], step['name'])))}: {step['outdated']}")
    conclude(in_one_line.status(summary))


def settings_text(settings: Summary) -> str:
    """Return settings in one line, without those that are empty and what the other columns say."""
    told = {k: v for k, v in settings.items() if k not in ("model", "optimizer", "name", "fits", "jobs")}
    return ", ".join(f"{k} {_setting(v)}" for k, v in told.items() if v not in (None, "", [], {}))


def _setting(value: object) -> str:
    """Return a setting's value as a person would write it: NAME=VALUE and NAME=LOW:HIGH of a list of them."""
    if isinstance(value, list):
        return " ".join(f"{v[0]}={':'.join(map(_setting, v[1:]))}" if isinstance(v, list) else str(v) for v in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def remove(summary: Summary) -> None:
    """Print the fits that were taken out, and those that are left."""
    done = "Would be removed from" if summary["dry_run"] else "Removed from"
    say(f"Fits left: {', '.join(summary['left']) or 'none'}")
    conclude(f"{done} {summary['work']}: {', '.join(summary['removed'])}")


def run(summary: Summary) -> None:
    """Print the outcome of a whole pipeline: each fit's errors, what is missing, and where the pages lie."""
    work = Path(summary["work"])
    _notes(summary)
    if "sheet" in summary:
        from mrfit.cli import sheet
        from mrfit.io.schemas.reading import of_row
        from mrfit.io.schemas.sheet import SheetFile

        sheet.show(of_row(SheetFile, summary["sheet"]))
    if "discovery" in summary:
        discover(summary["discovery"], work)
    for done in summary["fits"]:
        fit(done, work)
    if "compare" in summary:
        shown = compare_models if "models" in summary["compare"] else compare_optimizers
        shown(summary["compare"], work)
    for done in summary.get("predict", ()):
        predict(done)
    if "report" in summary:
        report({"notes": [], **summary["report"]}, work)
    for done in summary.get("figure", ()):
        figure(done)
    for done in summary.get("export", ()):
        export.show(done)


def check_exports(summary: Summary) -> None:
    """Raise the DataError of the first export of a pipeline in which some formats could not be made."""
    for made in summary.get("export", ()):
        export.check_all_made(made)


def figure(summary: Summary) -> None:
    """Print the place of a figure, the conditions not in it, and why its fits are out of date."""
    export.outdated(summary["outdated"])
    if left_out := summary["left_out"]:
        say(
            f"{summary['conditions']} of {summary['conditions'] + len(left_out)} conditions are drawn, not "
            f"{', '.join(left_out)}: name them with --condition, or put conditions on shared axes with "
            "--overlay conditions"
        )
    conclude(f"Figure of {summary['kind']}, {summary['width']} wide: {', '.join(summary['files'])}")


def datasets(rows: Sequence[Summary]) -> None:
    """Print the catalog of public data."""
    _names_where_quiet(rows)
    names = ("name", "title", "files", "size", "licence", "cite")
    print_table("Public data", names, [numbers({**r, "size": _megabytes(r["bytes"])}, names) for r in rows])
    say("Fetch one, checked against its SHA-256, with `mrfit datasets NAME`")


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.2f} MB"


def dataset(summary: Summary) -> None:
    """Print folder, citation and next command of a data set."""
    names = ("name", "size", "state", "sha256")
    shown = [numbers({**f, "size": _megabytes(f["bytes"])}, names) for f in summary["files"]]
    print_table(f"{summary['name']} in {summary['folder']}", ("file", "size", "what was done", "SHA-256"), shown)
    say_each(summary["notes"])
    say(f"Licence: {summary['licence']}. Cite: {summary['cite']}")
    say(f"Next: {summary['next']}")


def registry_rows(kind: str) -> list[dict[str, str]]:
    """Return name and title of every item of a kind, given in the singular or plural.

    Raises
    ------
    ConfigError
        If there is no such kind.
    """
    from mrfit.core import registry

    singular = kind.removesuffix("s")
    if singular not in registry.KINDS:
        known = [f"{k}s" for k in registry.KINDS]
        raise ConfigError(f"there are no '{kind}' to list; choose one of {', '.join(known)}{near(kind, known)}")
    if singular == "optimizer":
        from mrfit.search import strategies

        return [{"name": n, "title": spec.title} for n, spec in strategies.specs().items()]
    if singular == "model":
        models = {n: registry.load("model", n).SPEC for n in registry.names("model")}
        return [{"name": n, "title": spec.title, "predicts": spec.output} for n, spec in models.items()]
    return [{"name": n, "title": registry.load(singular, n).SPEC.title} for n in registry.names(singular)]


def _names_where_quiet(rows: Sequence[Summary]) -> None:
    if VERBOSITY.quiet:
        for row in rows:
            conclude(row["name"])


def registry_table(rows: Sequence[dict[str, str]], kind: str) -> None:
    """Print names and titles, names alone where little is wanted."""
    _names_where_quiet(rows)
    columns = tuple(rows[0]) if rows else ("name", "title")
    print_table(kind, columns, [list(r.values()) for r in rows])


def item(name: str) -> Summary:
    """Return everything an item's SPEC says.

    Raises
    ------
    ConfigError
        If no registry holds the name.
    """
    import inspect
    from dataclasses import asdict

    from mrfit.core import registry
    from mrfit.search import strategies

    for kind in registry.KINDS:
        if name in registry.names(kind):
            module = registry.load(kind, name)
            spec = {k: v for k, v in asdict(module.SPEC).items() if not callable(v)}
            return {"kind": kind, **spec, "text": inspect.getdoc(module) or spec.get("equation", "")}
    if own := strategies.REGISTERED_STRATEGIES.get(name):
        spec = {k: v for k, v in asdict(own.spec).items() if not callable(v)}
        return {"kind": "optimizer", **spec, "text": inspect.getdoc(own.module) or ""}
    known = [n for kind in registry.KINDS for n in registry.names(kind)]
    singular = name.removesuffix("s")
    if singular in registry.KINDS:
        raise ConfigError(f"'{name}' is a kind of item: `mrfit list {singular}s` lists them")
    model = name.partition(".")[0].partition("+")[0]
    if singular in ("fit", "report", "segment", "recording") or (model != name and model in known):
        look = f"; `mrfit show {model}` says what its model is" if model in known else ""
        raise ConfigError(f"'{name}' belongs to a workspace: `mrfit status` lists what is in one{look}")
    raise unknown_name("model", name, [*known, *strategies.REGISTERED_STRATEGIES])


def show(found: Summary) -> None:
    """Print an item's title, text and parameters, and what an effect is mistaken for."""
    conclude(f"{found['name']} ({found['kind']}): {found['title']}")
    say_each(("", *found["text"].split("\n"), "") if found["text"] else (), "")
    if "params" in found:
        takes, neutral = ", ".join(n for n in found["inputs"] if n not in RECORD_CONSTANTS), found.get("neutral")
        if neutral is None:
            say(f"{takes} -> {found['output']}")
        else:
            say(f"acts on {', '.join(found['outputs'])} in the slot '{found['slot']}'; needs {takes or 'nothing else'}")
        names = ["name", "unit", "low", "high", "start", "scale", "text"]
        columns = ["parameter", "unit", "low", "high", "start", "scale", "meaning"]
        rows = [numbers(p, names) for p in found["params"]]
        if neutral is not None:
            columns.insert(5, "neutral")
            rows = [[*row[:5], value, *row[5:]] for row, value in zip(rows, neutral, strict=True)]
        print_table("Parameters", columns, rows)
        for param in found["params"]:
            if param["fixed"]:
                say(f"  {param['name']} is held at what the logs give, not fitted; --bounds or --start frees it")
        for quantity in found.get("derived", ()):
            say(f"  derived: {quantity['name']} ({quantity['unit']}) {quantity['text']}")
    if found.get("options"):
        names = ["name", "default", "low", "high", "text"]
        columns = ["option", "default", "least", "most", "meaning"]
        print_table("Options: --opt-set NAME=VALUE", columns, [numbers(o, names) for o in found["options"]])
    if found.get("aliases"):
        say(f"Mistaken for: {', '.join(found['aliases'])}")
    if found.get("experiment"):
        say(f"Told apart by: {found['experiment']}")
    if found.get("reference"):
        say(f"Source: {found['reference']}")
