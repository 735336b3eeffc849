"""Files are written whole or not at all, and what they replace is known."""

from pathlib import Path

import pytest

from mrfit.errors import DataError
from mrfit.io.atomic import refuse_link, write_atomic
from mrfit.io.replaced import replaced_files
from mrfit.io.unreadable import UNREADABLE, reading
from mrfit.io.workspace import write_text


def test_a_file_of_other_content_is_replaced_and_the_same_is_not(tmp_path: Path) -> None:
    changed, same, new = (tmp_path / name for name in ("changed", "same", "new"))
    write_text(changed, "old")
    write_text(same, "text")
    with replaced_files() as found:
        write_text(changed, "new")
        write_text(same, "text")
        write_text(new, "text")
    assert found == [changed] and changed.read_text() == "new"
    write_text(same, "other")
    assert found == [changed]


def test_collections_do_not_mix(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_text(path, "1")
    with replaced_files() as outer:
        with replaced_files() as inner:
            write_text(path, "2")
        assert (outer, inner) == ([], [path])
        write_text(path, "3")
    assert outer == [path]


def test_a_folder_is_made_and_a_link_of_the_temporary_name_is_not_followed(tmp_path: Path) -> None:
    target, other = tmp_path / "new" / "a.txt", tmp_path / "other"
    other.write_text("mine")
    target.parent.mkdir()
    written: list[Path] = []

    def write(path: Path) -> None:
        written.append(path)
        path.write_text("text")

    write_atomic(target, write)
    written[0].symlink_to(other)
    write_atomic(target, write)
    assert target.read_text() == "text" and other.read_text() == "mine"
    assert sorted(p.name for p in target.parent.iterdir()) == ["a.txt"]


@pytest.mark.parametrize("path", ["/", "."])
def test_what_names_no_file_is_refused(path: str) -> None:
    with pytest.raises(DataError, match="no name of a file"):
        write_atomic(Path(path), lambda p: p.write_text("x"))


def test_where_a_file_stands_for_the_folder_one_line_says_so(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("")
    with pytest.raises(DataError, match="cannot write .*; choose another folder"):
        write_text(tmp_path / "a" / "b", "x")


def test_a_link_is_refused_and_a_file_is_not(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    refuse_link(tmp_path / "file")
    refuse_link(tmp_path / "missing")
    with pytest.raises(DataError, match="a symbolic link"):
        refuse_link(tmp_path / "link")


def test_a_page_shows_control_characters_and_other_text_keeps_them(tmp_path: Path) -> None:
    for name, shown in (("page.html", "a\\x1bb"), ("file.txt", "a\x1bb")):
        write_text(tmp_path / name, "a\x1bb")
        assert (tmp_path / name).read_bytes().decode() == shown


@pytest.mark.parametrize("error", UNREADABLE)
def test_whatever_a_damaged_table_raises_names_the_file_and_the_remedy(error: type[Exception]) -> None:
    with pytest.raises(DataError) as found, reading(Path("a.parquet"), "run it again"):
        raise error("first line\nsecond")
    said = str(found.value)
    assert (
        said.startswith("a.parquet: missing (first line)") and said.endswith("; run it again") and "second" not in said
    )


def test_an_error_of_mrfit_passes_as_it_is() -> None:
    with pytest.raises(DataError, match=r"^as it is$"), reading(Path("a.parquet"), "run it again"):
        raise DataError("as it is")
