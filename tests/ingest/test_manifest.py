"""Earlier logs are known by path, key and content; logs of the same bytes are read once, or twice for a reason."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.ingest.manifest import Manifest
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.reading import LogItem
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import part_duplicates
from mrfit.io.schemas.stages import About, Copy, IngestFile, Refused
from mrfit.io.workspace import Workspace, write_json

SAME = "ab" * 32


def recording(name: str, source: str, sha256: str = SAME) -> Recording:
    return Recording(name, source, sha256, "csv", 1e-3, 0.0, {"force": np.arange(5.0)}, {"force": "N"})


def item(path: str, sha256: str = SAME, rules: Rules = Rules()) -> LogItem:  # noqa: B008
    return LogItem(((Path(path), sha256),), "delimited", rules)


@pytest.fixture
def work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    monkeypatch.chdir(tmp_path)
    return Workspace(Path("w"))


def ingested(work: Workspace, *recordings: Recording, **given: Any) -> Manifest:
    for one in recordings:
        work.write_recording(one)
    about = {"recordings": [About.of(r) for r in recordings], "refused": [], "base": ".."}
    write_json(work.ingest_json, IngestFile(**{**about, **given}))
    return Manifest(work)


def test_a_new_workspace_knows_nothing_and_takes_the_present_folder_as_base(work: Workspace) -> None:
    new = Manifest(work)
    assert new.name("logs/a.csv") == "logs/a.csv" and new.ids("logs/a.csv") == [] and new.copies == []
    assert new.base_of(["logs/a.csv"]) == ".." and new.base_of(["/abs/a.csv"]) is None
    assert not new.holds(item("logs/a.csv"), "k") and new.same_refusals([])


def test_a_path_is_spelt_as_the_first_call_spelt_it_from_anywhere(work: Workspace, tmp_path: Path) -> None:
    known = ingested(work, recording("a", "logs/a.csv"), sources={"logs/a.csv": "k"})
    assert known.name(str(tmp_path / "logs" / "a.csv")) == "logs/a.csv" == known.source(item("logs/../logs/a.csv"))
    (tmp_path / "inner").mkdir()
    os.chdir(tmp_path / "inner")
    there = Manifest(Workspace(Path("../w")))
    assert there.name("../logs/a.csv") == "logs/a.csv" and there.name("b.csv") == "inner/b.csv"


def test_an_item_is_held_by_its_key_as_long_as_its_recordings_are_whole(work: Workspace) -> None:
    known = ingested(work, recording("a", "a.csv"), sources={"a.csv": "k"})
    assert known.holds(item("a.csv"), "k") and not known.holds(item("a.csv"), "other")
    assert not known.holds(item("b.csv"), "k")
    work.recording_file("a").unlink()
    assert not Manifest(work).holds(item("a.csv"), "k")


@pytest.mark.parametrize(
    ("sha256", "key", "said"),
    [
        ("cd" * 32, "k", "has changed since it was last read"),
        (SAME, "k", "its recordings were damaged, changed or missing"),
        (SAME, "other", "its channel map, the options, its reader or mrfit itself has changed"),
    ],
)
def test_why_a_log_is_read_again(sha256: str, key: str, said: str, work: Workspace) -> None:
    known = ingested(work, recording("a", "a.csv"), sources={"a.csv": "k"})
    assert said in known.reason("a.csv", sha256, key)


def test_refusals_are_the_same_by_path_and_reason(work: Workspace) -> None:
    row = Refused(source="a.csv", reason="empty", remedy="copy it", kept=True)
    known = ingested(work, refused=[row], sources={"a.csv": "k"})
    (back,) = known.refusals("a.csv")
    assert (back.reason, back.remedy) == ("empty", "copy it") and known.refusals("b.csv") == []
    assert known.orphans == {"a.csv"} and known.same_refusals([Refusal(Path("a.csv"), "empty", "other remedy")])
    assert not known.same_refusals([Refusal(Path("a.csv"), "damaged", "copy it")])
    assert not known.same_refusals([Refusal(Path("b.csv"), "empty", "copy it")])


def parted(known: Manifest, *plan: tuple[LogItem, str]) -> tuple[list[tuple[str, str, bool]], list[str]]:
    copies, left = part_duplicates(list(plan), known)
    return [(c.source, c.of, c.read) for c in copies], [i.source for i, _ in left]


def test_the_same_bytes_are_read_once_and_other_bytes_each(work: Workspace) -> None:
    known = Manifest(work)
    assert parted(known, (item("a.csv"), "k"), (item("b.csv"), "k")) == ([("b.csv", "a.csv", False)], ["a.csv"])
    assert parted(known, (item("a.csv"), "k"), (item("b.csv", "cd" * 32), "k")) == ([], ["a.csv", "b.csv"])


def test_a_name_that_states_another_condition_makes_another_test_of_it(work: Workspace) -> None:
    rules = Rules(pattern="{current}A")
    copies, left = parted(Manifest(work), (item("1A.csv", rules=rules), "k"), (item("2A.csv", rules=rules), "k"))
    assert copies == [("2A.csv", "1A.csv", True)] and left == ["1A.csv", "2A.csv"]


def test_other_settings_make_another_test_of_it_and_another_map_of_the_same_content_does_not(work: Workspace) -> None:
    first, known = item("a.csv"), Manifest(work)
    other = item("b.csv", rules=Rules(resistance=2.0))
    assert parted(known, (first, "k"), (other, "l"))[0] == [("b.csv", "a.csv", True)]
    moved = item("b.csv", rules=Rules(where="elsewhere.toml"))
    assert parted(known, (first, "k"), (moved, "l"))[0] == [("b.csv", "a.csv", False)]


def test_what_the_workspace_knows_stays_the_one_that_is_read(work: Workspace) -> None:
    known = ingested(work, recording("z", "z.csv"), sources={"z.csv": "k"})
    assert parted(known, (item("a.csv"), "k"), (item("z.csv"), "k")) == ([("a.csv", "z.csv", False)], ["z.csv"])
    assert parted(known, (item("a.csv"), "k")) == ([("a.csv", "z.csv", False)], [])


def test_a_copy_that_was_known_stays_one_until_its_log_changes(work: Workspace) -> None:
    copy = Copy(source="b.csv", of="a.csv", read=False)
    known = ingested(work, recording("a", "a.csv"), sources={"a.csv": "k"}, copies=[copy])
    assert parted(known, (item("a.csv"), "k"))[0] == [("b.csv", "a.csv", False)]
    assert parted(known, (item("a.csv", "cd" * 32), "new"))[0] == []
    assert known.copies == [copy] and replace(copy, read=True) != copy
