"""Logs that hold the same bytes under several names: one log, unless name or settings make another test of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mrfit.ingest.manifest import Manifest
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.meaning.conditions import from_name
from mrfit.ingest.reading import LogItem
from mrfit.io.schemas.stages import Copy

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
    logs: dict[str, list[_Log]] = {}
    here = {before.source(item) for item, _ in plan}
    for row in before.summary.recordings:
        if row.source not in here:
            logs.setdefault(row.sha256, []).append(_Log(row.source, before.keys.get(row.source)))
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
