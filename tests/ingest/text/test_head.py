import codecs
from pathlib import Path

import pytest

from mrfit.ingest.refusal import Refusal
from mrfit.ingest.text.head import HEAD_BYTES, body_bytes, body_view, feeds, open_head

TEXT = "time (s),Température (°C)\n0.0,21.5\n0.1,21.6\n0.2,21.7\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1", "cp1252"])
def test_text_reads_the_same_in_every_encoding(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(TEXT.encode(encoding))
    head = open_head(path)
    assert head.lines[0] == "time (s),Température (°C)"
    assert body_bytes(head).split(b"\n")[1] == b"0.0,21.5"


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n"])
def test_line_numbers_agree_between_head_and_body(end: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(TEXT.replace("\n", end).encode())
    head = open_head(path)
    body = [line.rstrip(b"\r").decode() for line in body_bytes(head).split(b"\n")]
    assert list(head.lines) == body


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "empty file"),
        (codecs.BOM_UTF8, "byte-order mark and nothing else (3 bytes)"),
        (codecs.BOM_UTF16_LE, "byte-order mark and nothing else (2 bytes)"),
        (b"\0" * 500, "nothing but NUL bytes"),
        (b" \r\n\t\n", "nothing but blanks"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 5\n", "Git LFS pointer"),
        (b"PK\x03\x04rest of an archive", "ZIP"),
        (b"PK\x03\x04notes on x.npy", "ZIP"),
        (b"PK\x03\x04" + b"\0" * 22 + b"\x08\0\0\0time.npy\x93NUMPY\x01", "NumPy archive"),
        (b"\x1f\x8b\x08rest", "gzip"),
    ],
)
def test_files_without_data_are_refused_by_what_they_are(content: bytes, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    with pytest.raises(Refusal, match="log.csv") as error:
        open_head(path)
    assert reason in error.value.reason
    assert error.value.remedy


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(Refusal, match="nowhere.csv: no such file"):
        open_head(tmp_path / "nowhere.csv")


def test_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Refusal, match="cannot be opened"):
        open_head(tmp_path)


def test_binary_has_no_lines(tmp_path: Path) -> None:
    path = tmp_path / "blob"
    path.write_bytes(bytes(range(256)) * 4)
    assert open_head(path).encoding == ""
    assert open_head(path).lines == ()


def test_line_cut_by_the_end_of_the_head_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    path.write_bytes(b"0123456789\n" * 10000)
    head = open_head(path)
    assert len(head.raw) == HEAD_BYTES
    assert set(head.lines) == {"0123456789"}


def test_starts_ignores_case_and_blank_lines(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"\n\n  MODEL,MSO\n")
    assert open_head(path).starts("model,")


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_view_and_bytes_of_a_body_are_the_same(end: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes((TEXT * 5).replace("\n", end).encode(encoding))
    head = open_head(path)
    view = body_view(head)
    assert view[:] == body_bytes(head)
    assert feeds(view, 3, len(view)) == view[3:].count(b"\n")


def test_a_lone_return_past_the_head_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"0,1\r\n" * 300000 + b"2,3\r4,5\r\n")
    assert feeds(body_view(open_head(path)), 0, 10) == 2
    assert bytes(body_view(open_head(path))[-8:]) == b"2,3\n4,5\n"


@pytest.mark.parametrize(
    ("encoding", "header"),
    [
        ("gb18030", "时间(s),位移(mm),阻尼力(N)"),
        ("shift_jis", "時間(s),変位(mm),荷重(N)"),
        ("euc_kr", "시간(s),변위(mm),하중(N)"),
        ("cp1251", "Время (s);Перемещение (mm);Усилие (N)"),
        ("cp1252", "Zeit (s);Öltemperatur (°C);Größe (µm)"),
    ],
)
def test_names_of_channels_tell_the_encoding(encoding: str, header: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(f"{header}\n0,1,2\n".encode(encoding))
    assert open_head(path).lines[0] == header
