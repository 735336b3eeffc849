"""The advise stage: the next test, from what a discovery or a fit left open and from what the rig can do."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mrfit.advise import drawing, words
from mrfit.advise.choose import ScoredTest, TestChoice
from mrfit.advise.parameters import known_of, narrow, widths
from mrfit.advise.readings import ReadingSet
from mrfit.advise.rig import Rig, read_rig, rig_beside
from mrfit.advise.rivalry import separate
from mrfit.advise.specimen import Specimen, rigged_of
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Mask
from mrfit.discover.evidence.bench import Bench, build_bench, effects_for
from mrfit.errors import ConfigError
from mrfit.fit.predict import read_fit
from mrfit.fit.select import read_dataset
from mrfit.io.atomic import write_atomic
from mrfit.io.dataset import Dataset
from mrfit.io.keys import code_version
from mrfit.io.schemas.advice import AdviceFile, AdvisedTest, Pair
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.io.schemas.fit import Fit
from mrfit.io.workspace import Workspace, write_json, write_text
from mrfit.settings.advise import Settings
from mrfit.simulate.assembly import assemble

FOLDER, JSON = "advise", "advise.json"


@dataclass(frozen=True)
class AdviceFiles:
    """An advice with the files that go with it.

    Attributes
    ----------
    content
        What advise.json holds.
    drives
        File name -> text of each drive.
    figure
        The rivals' predicted loops on the first test, as SVG and PNG; None of an advice on parameters or readings, or
        without a test.
    """

    content: AdviceFile
    drives: dict[str, str]
    figure: drawing.Loops | None = None


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> AdviceFile:
    """Choose the next test and write ``advise/``.

    Parameters
    ----------
    workspace
        Holds recordings, segments, and a discovery or a fit.
    settings
        What to advise on.
    progress
        Reports every step.

    Raises
    ------
    ConfigError
        If the rig's limits are missing, wrong or leave no test, or a rival needs a channel that the rig cannot move.
    DataError
        If there is no discovery or fit, or it left no rivals.
    """
    made = advised(workspace, rig_for(workspace, settings), settings, progress)
    write(workspace.root / FOLDER, made)
    return made.content


def write(folder: Path, made: AdviceFiles) -> None:
    """Write an advice: advise.json, the drives, the figure."""
    # a kill from here on must not leave the drives of one advice beside the words of another
    (folder / JSON).unlink(missing_ok=True)
    kept = {*made.drives, *(("loops.svg", "loops.png") if made.figure else ())}
    for old in (*folder.glob("*.csv"), *folder.glob("loops.*")):
        if old.name not in kept:
            old.unlink()
    for name, text in made.drives.items():
        write_text(folder / name, text)
    if made.figure is not None:
        png = made.figure.png
        write_text(folder / "loops.svg", made.figure.svg)
        write_atomic(folder / "loops.png", lambda path: path.write_bytes(png))
    write_json(folder / JSON, made.content)


def rig_for(workspace: Workspace, settings: Settings) -> Rig:
    """Return the limits that settings name, or that stand beside the logs.

    Raises
    ------
    ConfigError
        If there are none.
    """
    path = settings.rig or rig_beside(_sources(workspace))
    if path is None:
        raise ConfigError("no rig: state its limits in a table [rig] of mrfit.toml, or in a file that --rig names")
    return read_rig(Path(path))


def has_rig(workspace: Workspace, settings: Settings) -> bool:
    """Return whether limits of a rig are named or stand beside the logs."""
    return settings.rig is not None or rig_beside(_sources(workspace)) is not None


def _sources(workspace: Workspace) -> list[str]:
    segments = workspace.read_segments()
    return [workspace.read_recording(i, streamed=True).source for i in dict.fromkeys(s.recording for s in segments)]


def advised(workspace: Workspace, rig: Rig, settings: Settings, progress: Progress = silent) -> AdviceFiles:
    """Return the advice on a workspace for a rig, nothing written."""
    data = read_dataset(workspace)
    if settings.goal == "parameters":
        if not settings.fit:
            raise ConfigError("--goal parameters needs --fit NAME, the fit whose intervals are to be narrower")
        fit = read_fit(workspace, settings.fit)
        return of_fit(bench_of(data, fit.model), fit, rig, settings.seed, progress)
    if settings.fit:
        raise ConfigError("--fit needs --goal parameters")
    found = workspace.discovery()
    return of_discovery(bench_of(data, found.base_model), found, rig, settings.seed, progress)


def bench_of(data: Dataset, model: str) -> Bench:
    """Return data as a discovery takes them, for a base model with or without effects."""
    base = assemble(model.partition("+")[0])
    return build_bench(data.segments, data.recordings, base, effects_for(base.spec.output))


def of_discovery(bench: Bench, found: DiscoveryFile, rig: Rig, seed: int, progress: Progress = silent) -> AdviceFiles:
    """Return the tests that separate what a discovery left standing."""
    advice = separate(bench, found, rig, seed, progress)
    contest, chosen = advice.contest, advice.chosen
    pairs = tuple(
        Pair(names=n, before=float(b), separable=bool(o))
        for n, b, o in zip(advice.pairs, advice.before, advice.open, strict=True)
    )
    drives: dict[str, str] = {}
    # a test that separates nothing is none to run
    told = chosen.tests if advice.open.any() else ()
    tests = tuple(_row(t, f"test-{k}.csv", contest.specimen, advice.open, drives) for k, t in enumerate(told, start=1))
    other = advice.companion
    second = None if other is None else _row(other, "companion.csv", contest.specimen, advice.open, drives)
    content = AdviceFile(
        goal="readings" if isinstance(contest, ReadingSet) else "rivals",
        model=found.base_model,
        rivals=advice.rivals,
        pairs=pairs,
        text=tuple(words.of_rivals(pairs, tests, second)),
        tests=tests,
        companion=second,
        rig=rig.model_dump(),
        looked_at=chosen.looked_at,
        refused=chosen.refused,
        noise=contest.noise,
        seed=seed,
        code=code_version("advise"),
    )
    if isinstance(contest, ReadingSet) or not tests:
        return AdviceFiles(content, drives)
    return AdviceFiles(content, drives, drawing.loops(contest, chosen.tests[0].test, tests[0].text))


def _row(judged: ScoredTest, name: str, specimen: Specimen, wanted: Mask, drives: dict[str, str]) -> AdvisedTest:
    test = judged.test
    drives[name] = words.drive_csv(test, specimen.channels, specimen.driven(test))
    return AdvisedTest(
        kind=test.kind,
        text=words.test_words(test, specimen.channels),
        numbers={k: float(v) for k, v in test.numbers.items()},
        seconds=test.seconds,
        waiting=test.waiting,
        distances=tuple(map(float, judged.amounts)),
        worth=judged.worth(wanted),
        drive=name,
    )


def of_fit(bench: Bench, fit: Fit, rig: Rig, seed: int, progress: Progress = silent) -> AdviceFiles:
    """Return the tests that narrow the intervals of a fit."""
    known = known_of(bench, fit)
    specimen = Specimen.of(bench, known.assembly, rig)
    chosen: TestChoice = narrow(known, specimen, rigged_of(bench, specimen.channels, rig), seed, progress)
    if not chosen.tests:
        raise ConfigError("no test within [rig] can be simulated or keeps its force; give wider limits")
    drives: dict[str, str] = {}
    mask = np.ones(1, dtype=np.bool_)
    rows = [_row(t, f"test-{k}.csv", specimen, mask, drives) for k, t in enumerate(chosen.tests, start=1)]
    # of parameters there are no distances
    tests = tuple(replace(row, distances=()) for row in rows)
    narrower = widths(known, fit, chosen.tests[0].test, specimen)
    content = AdviceFile(
        goal="parameters",
        model=fit.model,
        text=tuple(words.of_parameters(narrower, tests[0])),
        tests=tests,
        widths=narrower,
        rig=rig.model_dump(),
        looked_at=chosen.looked_at,
        refused=chosen.refused,
        noise=known.noise,
        seed=seed,
        code=code_version("advise"),
        outdated=bool(fit.outdated),
        reason="; ".join(fit.outdated),
    )
    return AdviceFiles(content, drives)
