"""What others wrote is shown and not obeyed, in any locale: on the terminal, in JSON, in tables, in LaTeX."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.cli import console
from mrfit.errors import ConfigError
from mrfit.fit.stage import Settings, check
from mrfit.io.csv_table import csv_table
from mrfit.io.escapes import encodable, visible, visible_in_page, visible_json
from mrfit.io.schemas.stages import ReportFile
from mrfit.io.workspace import write_text
from mrfit.report.numbers import escape_latex, unit_latex
from mrfit.report.stage import publish
from mrfit.report.svg import style, to_svg
from tests import commands

NASTY = "\x1b]0;owned\x07\x1b[31mred\x9b2J\u202egnp.exe\nmrfit: all is well\r:warning: [bold]b[/bold]"
OBEYED = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


@given(st.text(st.characters(exclude_categories=())))
def test_no_text_holds_what_a_terminal_obeys(text: str) -> None:
    shown = visible(text)
    assert not OBEYED.search(shown) and "\n" not in shown
    shown.encode()
    plain = re.fullmatch(r"[ -~äöüßµΩ·²€]*", text)
    assert not plain or shown == text


@given(st.text(st.characters(exclude_categories=())))
def test_json_for_a_terminal_says_the_same(text: str) -> None:
    shown = visible_json(json.dumps({"a": encodable(text)}, ensure_ascii=False))
    assert not OBEYED.search(shown)
    assert json.loads(shown) == {"a": encodable(text)}


def test_bytes_of_a_name_that_are_no_text_are_shown_and_others_are_read() -> None:
    assert encodable(os.fsdecode(b"caf\xe9.csv")) == r"caf\xe9.csv"
    # as the name comes where the locale is C
    assert encodable("café.csv".encode().decode("ascii", "surrogateescape")) == "café.csv"
    assert encodable("\ud800") == r"\ud800"


def test_everything_printed_is_shown_and_not_obeyed(capsys: pytest.CaptureFixture[str]) -> None:
    console.say(NASTY)
    console.note(NASTY)
    console.print_table(NASTY, [NASTY, "n"], [[NASTY, 1.5]])
    console.print_json({NASTY: NASTY})
    printed = capsys.readouterr()
    for text in (printed.out, printed.err):
        assert not OBEYED.search(text)
    assert printed.out.splitlines()[0].startswith(r"\x1b]0;owned\x07\x1b[31mred\x9b2J")
    assert ":warning: [bold]b[/bold]" in printed.out
    assert "mrfit: all is well" not in [line.strip() for line in printed.out.splitlines()]


def run_plain(folder: Path, *arguments: object, **environment: str) -> "subprocess.CompletedProcess[bytes]":
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("LC_", "LANG", "PYTHONUTF8", "PYTHONIOENCODING"))}
    return commands.run(folder, *arguments, env={**kept, **environment})


def log(path: Path, force: str = "force (N)") -> None:
    rows = "\n".join(f"{k / 100},{k % 7}" for k in range(300))
    path.write_text(f"time,{force},displacement (mm)\n" + rows.replace("\n", ",1\n") + ",1\n", encoding="utf-8")


def test_an_error_on_a_hostile_name_is_one_line(tmp_path: Path) -> None:
    name = "a\x1b[31m\nmrfit: fine.csv"
    (tmp_path / name).write_bytes(b"\x00\x01")
    for more in ((), ("--debug",)):
        done = run_plain(tmp_path, *more, "ingest", name)
        assert done.returncode == 1 and b"\x1b" not in done.stderr and b"\nmrfit: fine" not in done.stderr
        assert rb"a\x1b[31m\nmrfit: fine.csv" in done.stderr


@pytest.mark.slow
def test_the_locale_changes_nothing(tmp_path: Path) -> None:
    said, locales = [], ({"LC_ALL": "C", "PYTHONUTF8": "0"}, {"LC_ALL": "C.UTF-8"})
    for number, locale in enumerate(locales):
        folder = tmp_path / str(number)
        folder.mkdir()
        log(folder / "größe_5Hz.csv", "Kraft (N)")
        (folder / "mrfit.toml").write_text('[channels]\nforce = {column = "Kraft"}\n# µ', encoding="utf-8")
        for arguments in (
            ("ingest", "größe_5Hz.csv"),
            ("ingest", "größe_5Hz.csv"),
            ("ingest", "größe.csv"),
            ("show", "lugre"),
        ):
            done = run_plain(folder, *arguments, **locale)
            assert done.returncode == (arguments[1] == "größe.csv"), done.stderr
            said.append((done.stdout.decode("utf-8"), done.stderr.decode("utf-8")))
        said.append((folder / "mrfit-work" / "ingest.json").read_text(encoding="utf-8"))
    assert said[:5] == said[5:]
    assert "nothing had changed" in said[1][0] and "größe.csv" in said[2][1] and not said[3][0].isascii()
    assert json.loads(said[4])["recordings"][0]["source"] == "größe_5Hz.csv"


def test_a_backend_that_there_is_not_changes_no_figure(tmp_path: Path) -> None:
    code = (
        "from mrfit.report import figures\n"
        "def drawn():\n"
        "    from matplotlib.figure import Figure\n"
        "    from mrfit.report.svg import to_svg\n"
        "    figure = Figure(); figure.subplots().plot([1, 2])\n"
        "    return to_svg(figure, 'x')\n"
        "print(len(figures.draw_all([drawn])[0]) > 1000)\n"
        "import os; print(os.environ['MPLBACKEND'])\n"
    )
    environment = {**os.environ, "MPLBACKEND": "nonsense"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert done.stdout.split() == ["True", "nonsense"], done.stderr


@pytest.mark.parametrize("name", ["a b", "=1+1", "-x", ".hidden", "a/b", "x\x1b[31m", "ä", "", "a" * 201, "a\n"])
def test_a_fit_is_named_by_a_plain_name_only(name: str) -> None:
    if not name:
        assert Settings("bingham", "lsq", name=name).fit_name == "bingham.lsq"
        return
    with pytest.raises(ConfigError, match="is no name for a file: give up to 200 letters, digits"):
        check(Settings("bingham", "lsq", name=name))
    check(Settings("bingham", "lsq", name="Run_2-b.all+x"))


def test_units_and_texts_of_others_are_escaped_for_latex() -> None:
    assert unit_latex(r"\input{/etc/passwd}%$&#_~") == escape_latex(r"\input{/etc/passwd}%$&#_~")
    assert "\\input" not in unit_latex(r"N*\input{x}")
    known = {"N*s/m": r"N\,s/m", "m/s**2": r"m/s$^{2}$", "m/s^2": r"m/s$^{2}$", "degC": r"$^\circ$C", "": "", "1": ""}
    known |= {
        "N*m*A**(-1)": r"N\,m\,A$^{-1}$",
        "ohm": r"$\Omega$",
        "s**-1": "s$^{-1}$",
        "H": "H",
        "m**0.5": "m$^{0.5}$",
    }
    assert {unit: unit_latex(unit) for unit in known} == known
    assert escape_latex("[3mm] a\nb\x1b") == r"{[}3mm{]} a\textbackslash{}nb\textbackslash{}x1b"


def test_control_characters_in_tables_are_shown() -> None:
    assert csv_table(("a",), [{"a": "x\x1b[31m\r=1"}]) == "a\n" + r"x\x1b[31m\r=1" + "\n"


@given(st.text(st.characters(exclude_categories=())))
def test_no_page_holds_what_a_terminal_obeys(text: str) -> None:
    shown = visible_in_page(text)
    assert not re.search("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", shown)
    assert visible_in_page(shown) == shown
    plain = re.fullmatch(r"[ -~äöüßµΩ·²€\n\t]*", text)
    assert not plain or shown == text


@pytest.mark.filterwarnings("ignore:Glyph")
def test_pages_and_figures_show_control_characters(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    write_text(page, f"<p>{NASTY}</p>\n")
    assert r"\x1b]0;owned\x07\x1b[31mred\x9b2J\u202egnp.exe" in page.read_text()
    publish(
        tmp_path / "report",
        {"index.html": f"<p>{NASTY}</p>\n"},
        ReportFile(key="k", fits=[], outdated=[], conditions=0, files=[]),
    )
    assert r"\x1b]0;owned\x07" in (tmp_path / "report" / "index.html").read_text()
    with style():
        from matplotlib.figure import Figure

        canvas = Figure()
        canvas.text(0.5, 0.5, "a\x07b\x1b[31m")
        drawn = to_svg(canvas, "t\x1b[2J")
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f]", drawn) and r"\x1b[31m" in drawn
