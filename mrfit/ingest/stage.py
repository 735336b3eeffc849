"""The ingest stage: log files to recordings in the workspace.

Logs that hold the same bytes under several names: one log, unless name or settings make another test of it.
"""

import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from os import getpid
from pathlib import Path

from mrfit.core import temporary
from mrfit.core.counting import number_of
from mrfit.core.grouping import grouped
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording
from mrfit.core.workers import in_order
from mrfit.errors import ConfigError, DataError
from mrfit.ingest.dispatch import expand, look, part_of
from mrfit.ingest.elsewhere import in_memory, outcomes
from mrfit.ingest.hashes import hash_of
from mrfit.ingest.low_pass import checked
from mrfit.ingest.manifest import Manifest
from mrfit.ingest.meaning.channel_map import FILE_NAME, MapFile, Rules, load_map, rules_for
from mrfit.ingest.meaning.conditions import condition_words, from_name, name_expression
from mrfit.ingest.reading import BlockReading, LogItem, LogOutcome, look_into
from mrfit.ingest.refusal import Refusal, TransientRefusal
from mrfit.io.atomic import accessing
from mrfit.io.keys import code_version, file_digest, key_of, plugins_used
from mrfit.io.schemas.stages import About, Copy, IngestFile, Refused
from mrfit.io.workspace import Workspace, recording_id, write_json
from mrfit.settings.ingest import Settings as Settings

# Items to read, each with the key of all that determines its recordings
ReadingPlan = Sequence[tuple[LogItem, str]]


@dataclass(frozen=True, slots=True)
class _Log:
    """A log with the key of all that determines its recordings, and its rules where this call gives them."""

    source: str
    key: str | None
    rules: Rules | None = None


def part_duplicates(
    plan: Sequence[tuple[LogItem, str]], before: Manifest
) -> tuple[list[Copy], list[tuple[LogItem, str]]]:
    """Return the logs that hold the bytes of another one, of this call or in the workspace, and the items to read.

    Of a copy are said ``source``, ``of``, and whether it is ``read`` all the same, because its name states another
    condition or it is read with other settings.
    """
    here = {before.source(item) for item, _ in plan}
    elsewhere = [row for row in before.summary.recordings if row.source not in here]
    logs = grouped((row.sha256, _Log(row.source, before.keys.get(row.source))) for row in elsewhere)
    copies, changed = [], set()
    # what the workspace knows already stays the one that is read
    for item, key in sorted(plan, key=lambda pair: not before.ids(before.source(pair[0]))):
        log, others = _Log(before.source(item), key, item.rules), logs.setdefault(item.sha256, [])
        same = next((o for o in others if _same_test(log, o, item.rules)), None)
        if others:
            copies.append(Copy(source=log.source, of=(same or others[0]).source, read=same is None))
        if same is None:
            others.append(log)
        if before.keys.get(log.source) != key:
            changed.add(log.source)
    copies += [c for c in before.copies if c.source not in here and c.of not in changed]
    dropped = {c.source for c in copies if not c.read}
    copies.sort(key=lambda c: c.source)
    return copies, [(item, key) for item, key in plan if before.source(item) not in dropped]


def _same_test(log: _Log, other: _Log, rules: Rules) -> bool:
    alike = log.key == other.key or (other.rules and replace(other.rules, where="") == replace(rules, where=""))
    names = [from_name(Path(o.source).stem, rules.pattern) if rules.pattern else {} for o in (log, other)]
    return bool(alike) and names[0] == names[1]


def run(paths: Sequence[Path], settings: Settings, workspace: Workspace, progress: Progress = silent) -> IngestFile:
    """Read logs into the workspace and return the content of ingest.json with what this call changed.

    Parameters
    ----------
    paths
        Files and folders.
    settings
        How to read them.
    workspace
        Where the recordings go; recordings of other sources stay.
    progress
        Called after every file, and while a long one is read.

    Returns
    -------
    IngestFile
        Recordings, refused logs and copies (see ``part_duplicates``); of this call the sources added, replaced (and
        why) and unchanged.

    Raises
    ------
    ConfigError
        If the settings or a channel map are wrong.
    DataError
        If no file could be read; the workspace is then as it was.
    """
    plan, refusals = plan_items(paths, settings, lambda path: hash_of(path, progress))
    if any(Path(p).is_dir() and Path(p).resolve() == workspace.root.resolve() for p in paths):
        raise ConfigError(f"--work {workspace.root} is the folder of the logs: name another, for what mrfit writes")
    before = Manifest(workspace)
    copies, plan = part_duplicates(plan, before)
    fresh = [(item, key) for item, key in plan if not before.holds(item, key)]
    held = [before.source(item) for item, key in plan if before.holds(item, key)]
    kept = [s for s in held if before.ids(s)]
    restored = {s for s in held if s in before.orphans}
    refusals += [r for s in held if s not in restored for r in before.refusals(s)]
    held_once = [c.of for c in copies if not c.read and before.ids(c.of)]
    if not fresh and not restored and before.same_refusals(refusals) and copies == before.copies:
        _check_any([*kept, *held_once], refusals)
        return replace(before.summary, skipped=True, unchanged=kept)
    with _staging(workspace) as staging:
        staged = _read_all(fresh, before, staging, (settings, progress))
        staged.files |= restored
        read = [s for s, rows in staged.recordings.items() if rows]
        staged.refusals = [*refusals, *staged.refusals]
        _check_any([*kept, *held_once, *read], staged.refusals)
        return _commit(workspace, staging, before, staged, kept, copies)


@contextmanager
def _staging(workspace: Workspace) -> Iterator[Workspace]:
    """Give a folder inside the workspace to write in, and leave no trace of it."""
    new = not workspace.root.exists()
    for left in workspace.root.glob(".ingest-*"):
        if left.name.removeprefix(".ingest-").isdecimal():
            shutil.rmtree(left, ignore_errors=True)  # of a run that was killed
    staging = Workspace(workspace.root / f".ingest-{getpid()}")
    with accessing(workspace.root, what="cannot write here"):
        staging.root.mkdir(parents=True)
    try:
        yield staging
    finally:
        shutil.rmtree(staging.root, ignore_errors=True)
        if new and not any(workspace.root.iterdir()):
            workspace.root.rmdir()


@dataclass(frozen=True, kw_only=True)
class Preview:
    """Preview of a recording, in words; of a refused file only source, reader, oddities and remedy."""

    source: str
    reader: str
    channels: str = ""
    rate: str = ""
    rows: int | str = ""
    refused: int | str = ""
    start: float | str = ""
    condition: str = ""
    oddities: str
    remedy: str = ""


def preview(paths: Sequence[Path], settings: Settings) -> list[Preview]:
    """Return a preview as rows for a table, one per recording or refused file, and write nothing.

    Of a log longer than eight blocks only the first is read, and its row says so.

    Raises
    ------
    ConfigError, DataError
        If the settings are wrong or a path does not exist.
    """
    plan, refusals = plan_items(paths, settings, lambda _: "")
    rows = []
    with temporary.folder("ingest") as place:
        pieces = BlockReading(place, settings.block)
        looks = in_order(lambda item: look_into(item, pieces), [item for item, _ in plan], settings.jobs)
        for outcome, times_longer in looks:
            refusals += outcome.refusals
            rows += [_preview_row(r, times_longer) for r in outcome.recordings]
    for refusal in refusals:
        told = {"oddities": refusal.reason, "remedy": refusal.remedy}
        rows.append(Preview(source=refusal.path, reader="refused", **told))
    return sorted(rows, key=lambda row: row.source)


@dataclass(frozen=True, slots=True)
class Logs:
    """Result of reading logs: their recordings, sorted by id, and the files that could not be read."""

    recordings: tuple[Recording, ...]
    refusals: tuple[Refusal, ...]


def read(paths: Sequence[Path], settings: Settings, progress: Progress = silent) -> Logs:
    """Read logs into memory, as ``run`` reads them into an empty workspace.

    Raises
    ------
    ConfigError
        If the settings or a channel map are wrong.
    DataError
        If no file could be read.
    """
    plan, refusals = plan_items(paths, settings, lambda path: hash_of(path, progress))
    recordings: list[Recording] = []
    taken: set[str] = set()
    with temporary.folder("ingest") as place:
        # numbers of a log longer than eight blocks lie there meanwhile
        pieces = BlockReading(place, settings.block, progress)
        plan = part_duplicates(plan, Manifest(Workspace(place)))[1]
        for number, outcome in enumerate(outcomes([item for item, _ in plan], pieces, settings.jobs), start=1):
            refusals += outcome.refusals
            recordings += [in_memory(r) for r in _named(outcome, outcome.item.source, taken)]
            progress("ingest", number, len(plan))
    _check_any([r.source for r in recordings], refusals)
    return Logs(tuple(sorted(recordings, key=lambda r: r.id)), tuple(refusals))


KEPT_BEFORE = " (the recordings read from it before are kept)"


def _preview_row(recording: Recording, times_longer: float) -> Preview:
    oddities = [f.text for f in recording.findings]
    rows: int | str = recording.rows_kept
    if times_longer > 1.0:
        seen = f"only its first {recording.rows_kept + recording.rows_refused} rows were looked at"
        oddities = [seen, *oddities]
        rows = f"about {times_longer * recording.rows_kept:.2g}".replace("e+0", "e")
    channels = (f"{n} ({recording.units[n]})" if recording.units[n] else n for n in recording.channels)
    return Preview(
        source=recording.source,
        reader=recording.reader,
        channels=", ".join(channels),
        rate=f"{1.0 / recording.dt:.6g} Hz",
        rows=rows,
        refused=recording.rows_refused,
        start=recording.start,
        condition=condition_words(recording.condition, recording.channels),
        oddities="; ".join(oddities),
    )


def plan_items(
    paths: Sequence[Path], settings: Settings, hashed: Callable[[Path], str] = hash_of
) -> tuple[list[tuple[LogItem, str]], list[Refusal]]:
    """Return the records to read, each with the key of all that determines it, and the files no reader takes.

    Raises
    ------
    ConfigError
        If the settings or a channel map are wrong.
    DataError
        If there is no such path.
    """
    return plan_files(expand([Path(p) for p in paths]), settings, hashed)


def plan_files(
    files: Iterable[tuple[Path, Path]], settings: Settings, hashed: Callable[[Path], str] = hash_of
) -> tuple[list[tuple[LogItem, str]], list[Refusal]]:
    """Return the plan, as of ``plan_items``, of files, each with the folder up to which a channel map is looked for.

    Raises
    ------
    ConfigError
        If the settings or a channel map are wrong.
    """
    _check_settings(settings)
    maps = _Maps(settings)
    groups: dict[tuple[str, str], list[tuple[Path, str]]] = {}
    rules: dict[tuple[str, str], Rules] = {}
    refusals = []
    for file, root in files:
        try:
            head, reader = look(file)
            digest = hashed(file)
        except Refusal as refusal:
            refusals.append(refusal)
            continue
        own = maps.rules(file, root)
        group = reader, f"{own.where} {own.join}" if own.join else part_of(head, reader) or str(file)
        groups.setdefault(group, []).append((file, digest))
        rules.setdefault(group, own)
    items = [LogItem(tuple(sorted(files)), g[0], rules[g], settings.max_memory) for g, files in groups.items()]
    return [(item, _key(item)) for item in items], refusals


def maps_of(paths: Sequence[Path], settings: Settings) -> list[Path]:
    """Return the channel maps by which logs are read, each once: the one given, else those beside them."""
    if settings.map:
        return [settings.map]
    beside = (_map_beside(file, root) for file, root in expand([Path(p) for p in paths]))
    return list(dict.fromkeys(path for path in beside if path))


def _key(item: LogItem) -> str:
    """Return the key of all that determines the recordings of an item."""
    plugins = plugins_used([("reader", item.reader)])
    return key_of([d for _, d in item.files], item.reader, asdict(item.rules), *plugins, stage="ingest")


def _check_settings(settings: Settings) -> None:
    ohm = settings.resistance
    if isinstance(ohm, (int, float)) and not 0.0 < ohm < float("inf"):
        raise ConfigError(f"resistance {ohm:g} ohm is impossible; give a positive number or `auto`")
    if settings.pattern is not None:
        name_expression(settings.pattern)
    checked(settings.low_pass)


class _Maps:
    """The channel maps met so far, and what each says of a file."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.loaded: dict[Path, MapFile] = {}

    def rules(self, file: Path, root: Path) -> Rules:
        path = self.settings.map or _map_beside(file, root)
        if path is not None and path not in self.loaded:
            self.loaded[path] = load_map(path)
        rules = rules_for(file, self.loaded[path] if path else None, str(path or ""))
        if rules.pattern and not self.settings.pattern:
            name_expression(rules.pattern)
        ohm = self.settings.resistance
        return replace(
            rules,
            pattern=self.settings.pattern or rules.pattern,
            low_pass={**rules.low_pass, **checked(self.settings.low_pass)},
            resistance=float(ohm) if isinstance(ohm, (int, float)) else rules.resistance,
        )


def _map_beside(file: Path, root: Path) -> Path | None:
    for folder in (file.parent, *file.parent.parents):
        if (folder / FILE_NAME).is_file():
            return folder / FILE_NAME
        if folder == root or root not in folder.parents:
            return None
    return None


@dataclass(slots=True)
class _StageResults:
    """Results of this call: rows of ingest.json and keys by source, refusals, and all files looked at."""

    recordings: dict[str, list[About]]
    keys: dict[str, str]
    refusals: list[Refusal]
    files: set[str]


def _read_all(
    fresh: list[tuple[LogItem, str]],
    before: Manifest,
    staging: Workspace,
    how: tuple[Settings, Progress],
) -> _StageResults:
    """Read the items and write their recordings to the staging folder."""
    settings, progress = how
    staged = _StageResults({}, {}, [], {before.name(str(file)) for item, _ in fresh for file, _ in item.files})
    taken = {r.id.lower() for r in before.summary.recordings}
    keys = {item.source: key for item, key in fresh}
    pieces = BlockReading(staging.root / "numbers", settings.block, progress)
    for number, outcome in enumerate(outcomes([i for i, _ in fresh], pieces, settings.jobs), start=1):
        source = before.source(outcome.item)
        staged.refusals += outcome.refusals
        if outcome.recordings or not before.ids(source):
            taken -= {i.lower() for i in before.ids(source)}
            staged.recordings[source] = []
            if not any(isinstance(r, TransientRefusal) for r in outcome.refusals):
                staged.keys[source] = keys[outcome.item.source]
        for recording in _named(outcome, source, taken):
            staging.write_recording(recording)
            staged.recordings[source].append(About.of(recording))
        progress("ingest", number, len(fresh))
    return staged


def _named(outcome: LogOutcome, source: str, taken: set[str]) -> Iterator[Recording]:
    """Give recordings their ids: the file's stem, numbered from 1 where a file holds several."""
    if not outcome.recordings:
        return
    base = recording_id(Path(source), taken)
    several = len(outcome.recordings) > 1
    for number, recording in enumerate(outcome.recordings, start=1):
        name = recording_id(Path(f"{base}-{number}.x"), taken) if several else base
        yield replace(recording, id=name, source=source)


def _check_any(read: list[str], refusals: list[Refusal]) -> None:
    if read:
        return
    if not refusals:
        raise ConfigError("there are no logs; give files, folders or patterns as logs/*.csv")
    if len(refusals) == 1:
        raise refusals[0]
    first = refusals[0]
    raise DataError(f"none of {number_of('file', len(refusals))} can be read; first {first}")


def _commit(
    workspace: Workspace,
    staging: Workspace,
    before: Manifest,
    staged: _StageResults,
    kept: list[str],
    copies: list[Copy],
) -> IngestFile:
    """Move the staged recordings into place, write ingest.json, remove what they replace.

    ``kept`` are the sources that were not read again.
    """
    dropped = {c.source for c in copies if not c.read}
    refused = [_refused_row(r, kept, staged, before) for r in staged.refusals]
    old = [r for r in before.summary.recordings if r.source not in dropped | staged.recordings.keys()]
    new = [r for rows in staged.recordings.values() for r in rows]
    for row in new:
        target = workspace.recording_file(row.id)
        with accessing(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            staging.recording_file(row.id).replace(target)
    heard = {r.source for r in refused} | set(staged.recordings) | staged.files | dropped
    refused += [r for r in before.summary.refused if r.source not in heard]
    unheld = {r.source for r in refused if not before.ids(r.source)} - set(staged.recordings)
    keys = {s: k for s, k in before.keys.items() if s not in unheld | dropped} | staged.keys
    read = [s for s, rows in staged.recordings.items() if rows]
    replaced = [s for s in read if before.ids(s)]
    recordings = sorted([*old, *new], key=lambda r: r.id)
    files = {r.id: before.summary.files[r.id] for r in old if r.id in before.summary.files}
    files |= {r.id: file_digest(workspace.recording_file(r.id)) for r in new}
    summary = IngestFile(
        recordings=recordings,
        refused=sorted(refused, key=lambda r: r.source),
        copies=copies,
        sources=dict(sorted(keys.items())),
        files=dict(sorted(files.items())),
        key=key_of(sorted(keys.items()), stage="ingest"),
        code=_code(before, bool(old)),
        base=before.base_of([*keys, *(r.source for r in refused), *(c.source for c in copies)]),
        added=[s for s in read if s not in replaced],
        replaced=replaced,
        unchanged=kept,
        reasons={s: before.reason(s, staged.recordings[s][0].sha256, staged.keys[s]) for s in replaced},
    )
    write_json(workspace.ingest_json, summary)
    _remove_stale(workspace, before, {r.id for r in summary.recordings})
    return summary


def _code(before: Manifest, older: bool) -> str:
    """Return the version of the code that read all there is; empty where some of it is ``older``, read by another."""
    this = code_version("ingest")
    return this if not older or before.summary.code == this else ""


def _refused_row(refusal: Refusal, kept: Iterable[str], staged: _StageResults, before: Manifest) -> Refused:
    """Return a refusal for ingest.json; a log that can no longer be read keeps the recordings made of it before."""
    source = before.name(refusal.path)
    row = Refused(source=source, reason=refusal.reason, remedy=refusal.remedy)
    if source in staged.recordings or source in kept or not before.ids(source):
        return row
    return replace(row, remedy=refusal.remedy.removesuffix(KEPT_BEFORE) + KEPT_BEFORE, kept=True)


def _remove_stale(workspace: Workspace, before: Manifest, ids: set[str]) -> None:
    for row in before.summary.recordings:
        if row.id not in ids:
            workspace.recording_file(row.id).unlink(missing_ok=True)
