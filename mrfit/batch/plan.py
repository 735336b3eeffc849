"""Plan of a batch: its logs, each with the key of all that determines its result."""

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from mrfit.batch.log import Job, StageSettings, failed
from mrfit.core.counting import few
from mrfit.core.progress import Progress
from mrfit.errors import DataError
from mrfit.ingest.dispatch import expand
from mrfit.ingest.hashes import hash_of
from mrfit.ingest.reading import LogItem
from mrfit.ingest.stage import plan_files
from mrfit.io.keys import code_version, digest_of, fit_key
from mrfit.io.schemas.batch import LogRow


@dataclass(frozen=True)
class Plan:
    """The logs of a folder, sorted by name.

    Attributes
    ----------
    jobs
        Those that a reader takes.
    refused
        Rows of the others.
    """

    jobs: Sequence[Job]
    refused: Sequence[LogRow]


def plan(folder: Path, like: str, work: Path, asked: StageSettings, workspaces: bool, progress: Progress) -> Plan:
    """Return the logs of a folder.

    Parameters
    ----------
    folder
        Folder of logs, or one log.
    like
        Patterns on their names, by commas.
    work
        The batch's own folder, no log of which is one.
    asked
        What is done with each.
    workspaces
        Whether each has a workspace.
    progress
        Reports every log looked at.

    Raises
    ------
    ConfigError
        If a channel map is wrong.
    DataError
        If there is no log.
    """
    patterns = [p.strip().lower() for p in like.split(",")]
    own = os.path.abspath(work)
    there = [one for one in expand([folder]) if not os.path.abspath(one[0]).startswith(own + os.sep)]
    files = [
        (_from_here(file), _from_here(root))
        for file, root in there
        if any(fnmatchcase(file.name.lower(), p) for p in patterns)
    ]
    if not files:
        endings = [ending for ending, _ in Counter(f"*{file.suffix.lower()}" for file, _ in there).most_common()]
        remedy = f"give --like one of what is there, as {few(endings)}" if there else "name another"
        raise DataError(f"{folder}: no log like {like} in this folder; {remedy}")
    seen = 0

    def looked_at(path: Path) -> str:
        nonlocal seen
        seen += 1
        progress("looking at logs", min(seen, len(files) - 1), len(files))
        return hash_of(path)

    items, refusals = plan_files(files, asked.ingest, looked_at)
    progress("looking at logs", len(files), len(files))
    settings = _settings_key(asked)
    jobs = [_job(item, digest_of(key, settings), work if workspaces else None, asked) for item, key in items]
    return Plan(sorted(jobs, key=lambda j: j.name), [failed(str(r.path), "", r) for r in refusals])


def _job(item: LogItem, key: str, work: Path | None, asked: StageSettings) -> Job:
    name, where = item.source, item.rules.where
    workspace = _from_here(work / inside(name)) if work else None
    return Job(name, key, tuple(f for f, _ in item.files), Path(where) if where else None, workspace, asked)


def _settings_key(asked: StageSettings) -> str:
    """Return the key of what is the same for all logs: settings, and the code of the stages."""
    stages: Mapping[str, str] = {stage: code_version(stage) for stage in ("flux", "segment")}
    return digest_of(asdict(asked.flux), stages, fit_key(asdict(asked.fit), {}, []))


def _from_here(path: Path) -> Path:
    """Return a path relative to the current folder: it is the same wherever a worker lays the files."""
    try:
        return Path(os.path.relpath(path))
    except ValueError:  # another drive
        return path


def inside(name: str) -> Path:
    """Return the folder of a log's workspace below the batch's folder."""
    parts = [p for p in Path(name).parts if p not in (".", Path(name).anchor)]
    return Path(*("__" if p == ".." else p for p in parts))
