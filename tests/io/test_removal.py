"""Fits are taken out of a workspace all or none."""

from pathlib import Path

import pytest

from mrfit.errors import ConfigError, DataError
from mrfit.io.removal import check_fits, remove_fits
from mrfit.io.workspace import Workspace


def with_fits(root: Path, *names: str) -> Workspace:
    workspace = Workspace(root)
    for name in names:
        folder = workspace.fit_folder(name)
        folder.mkdir(parents=True)
        (folder / "fit.json").write_text("{}")
    return workspace


def test_fits_that_are_named_are_gone_and_others_stay(tmp_path: Path) -> None:
    workspace = with_fits(tmp_path, "a", "b", "c")
    assert remove_fits(workspace, ["c", "a", "c"]) == ["c", "a"]
    assert workspace.fit_names() == ["b"]
    assert [p.name for p in tmp_path.iterdir()] == ["fits"]


def test_an_unfinished_fit_can_be_removed(tmp_path: Path) -> None:
    workspace = with_fits(tmp_path, "a")
    (workspace.fit_folder("a") / "fit.json").unlink()
    assert workspace.fit_names() == [] and remove_fits(workspace, ["a"]) == ["a"]
    assert workspace.fit_folders() == []


@pytest.mark.parametrize(
    ("there", "named", "said"),
    [
        ((), "tanh", "no fit named 'tanh'; there is none"),
        (("bingham", "tanh.auto"), "zzz", "no fit named 'zzz'; choose from bingham, tanh.auto"),
        (("bingham", "tanh.auto"), "tanh.aut", "did you mean tanh.auto?"),
    ],
)
def test_a_fit_that_is_not_there_is_named_and_none_is_removed(
    there: tuple[str, ...], named: str, said: str, tmp_path: Path
) -> None:
    workspace = with_fits(tmp_path, *there)
    with pytest.raises(DataError, match="no fit named") as found:
        remove_fits(workspace, [*there, named])
    assert said in str(found.value) and workspace.fit_names() == list(there)


def test_a_name_that_leads_elsewhere_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no name for a file"):
        check_fits(with_fits(tmp_path, "a"), ["../a"])


def test_a_folder_that_cannot_be_moved_leaves_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    workspace, moved = with_fits(tmp_path, "a", "b"), Path.replace

    def fails_at_b(path: Path, to: Path) -> Path:
        if path == workspace.fit_folder("b"):
            raise PermissionError(13, "Permission denied")
        return moved(path, to)

    monkeypatch.setattr(Path, "replace", fails_at_b)
    with pytest.raises(DataError, match=r"cannot remove fits \(Permission denied\)"):
        remove_fits(workspace, ["a", "b"])
    assert workspace.fit_names() == ["a", "b"]
    assert [p.name for p in tmp_path.iterdir()] == ["fits"]
