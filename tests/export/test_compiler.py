"""The C compiler that is taken, what it refuses in one line, and programs that read rows and write answers."""

import sys
from pathlib import Path

import numpy as np
import pytest

from mrfit.errors import ConfigError, DataError
from mrfit.export.compiler import CompiledModel, compiler, fault, required


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that alone has programs."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    return tmp_path


def program(path: Path, text: str = "") -> str:
    path.write_text(f"#!{sys.executable}\n{text}")
    path.chmod(0o755)
    return str(path)


def test_gcc_comes_before_others_and_what_cc_names_before_all(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert compiler() is None
    clang = program(programs / "clang")
    assert compiler() == clang
    gcc = program(programs / "gcc")
    program(programs / "cc")
    assert compiler() == gcc
    monkeypatch.setenv("CC", " clang ")
    assert compiler() == required("--to c") == clang
    # one that is named and is not there is not replaced by another
    monkeypatch.setenv("CC", "icc")
    assert compiler() is None
    monkeypatch.setenv("CC", " ")
    assert compiler() == gcc


def test_without_a_compiler_it_is_said_what_was_tried(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError, match=r"^--to c needs a C compiler.*\(tried gcc, cc, clang\): install gcc, or set"):
        required("--to c")
    monkeypatch.setenv("CC", "icc")
    with pytest.raises(ConfigError, match=r"\(tried CC=icc\)"):
        required("--to c")


@pytest.mark.parametrize(
    ("printed", "line"),
    [
        (b"a.c: In function 'f':\n a.c:3:1: error: no ';'\n note\nerror: two", "a.c:3:1: error: no ';'"),
        (b"killed \xff", "killed \ufffd"),
        (b"", ""),
    ],
)
def test_the_fault_is_the_first_line_with_an_error(printed: bytes, line: str) -> None:
    assert fault(printed) == line


SUMS = """
import struct, sys
rows = struct.iter_unpack("3d", sys.stdin.buffer.read())
for dt, one, other in rows:
    sys.stdout.buffer.write(struct.pack("2d", dt, one - other))
"""


def test_a_program_gets_its_steps_before_its_inputs_and_gives_a_row_for_each(tmp_path: Path) -> None:
    run = CompiledModel(Path(program(tmp_path / "sums", SUMS)), 2).run
    inputs = np.array([[1.0, 2.0, 3.0], [0.5, 0.25, 0.0]])
    steps = np.array([0.1, 0.2, 0.3])
    np.testing.assert_array_equal(run(inputs, steps), [steps, [0.5, 1.75, 3.0]])
    np.testing.assert_array_equal(run(inputs, 0.5)[0], [0.5, 0.5, 0.5])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import sys; sys.exit('first\\nsecond')", "the exported program fails: first"),
        ("import sys; sys.exit(3)", "the exported program fails: 3"),
    ],
)
def test_a_program_that_fails_is_one_line(text: str, said: str, tmp_path: Path) -> None:
    failing = CompiledModel(Path(program(tmp_path / "failing", text)), 2)
    with pytest.raises(DataError) as raised:
        failing.run(np.zeros((1, 1)), 1.0)
    assert str(raised.value) == said
