"""Progress bars: who sees them, and what is left when the work is done."""

import io
import subprocess
import sys
import types
from typing import Any

import pytest

from mrfit.core.progress import silent
from mrfit.io import bars

SCRIPT = """
import sys, time
from mrfit.io.bars import shown
with shown(True) as told:
    for k in range(5):
        told("all  best 1.2 N", k, 5)
        time.sleep(0.2)
    told("all", 5, 5)
print("done")
"""


class Terminal(io.StringIO):
    """A stream that is a terminal."""

    def isatty(self) -> bool:
        return True


def test_a_script_without_a_terminal_hears_nothing() -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("done\n", "")


def test_a_terminal_has_a_bar_unless_it_is_not_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("TERM", "xterm")
    with bars.shown() as told:
        assert told is not silent
    with bars.shown(False) as told:
        assert told is silent
    with bars.shown(print) as told:
        assert told is print


def test_a_process_without_standard_error_hears_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    with bars.shown() as told:
        assert told is silent


class Shell:
    """What IPython calls itself in a notebook."""

    def __init__(self, kernel: bool) -> None:
        if kernel:
            self.kernel = object()


class Cell:
    """Display of a notebook."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def update(self, html: str) -> None:
        self.texts.append(html)


def notebook(monkeypatch: pytest.MonkeyPatch, kernel: bool) -> Cell:
    cell = Cell()

    def display(html: str, display_id: bool) -> Cell:
        assert display_id
        cell.texts.append(html)
        return cell

    modules: dict[str, dict[str, Any]] = {
        "IPython": {},
        "IPython.core": {},
        "IPython.core.getipython": {"get_ipython": lambda: Shell(kernel)},
        "IPython.display": {"HTML": str, "display": display},
    }
    for name, content in modules.items():
        module = types.ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    return cell


def test_a_notebook_shows_what_is_unfinished_and_nothing_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = notebook(monkeypatch, kernel=True)
    monkeypatch.setattr(bars, "BAR_PATIENCE", 0.0)
    monkeypatch.setattr(bars, "PAUSE", 0.0)
    with bars.shown() as told:
        told("one  best <b>", 1, 4)
        told("two", 1, 2)
        told("one", 4, 4)
    assert 'value="1" max="4"' in cell.texts[0] and "&lt;b&gt;" in cell.texts[0]
    assert cell.texts[1].count("<progress") == 2
    assert cell.texts[2].count("<progress") == 1 and "two" in cell.texts[2]
    assert cell.texts[-1] == ""


def test_a_notebook_shows_no_bar_of_a_short_call(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = notebook(monkeypatch, kernel=True)
    with bars.shown() as told:
        told("one", 1, 4)
    assert cell.texts == []


def test_ipython_without_a_kernel_is_a_terminal_like_another(monkeypatch: pytest.MonkeyPatch) -> None:
    notebook(monkeypatch, kernel=False)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with bars.shown() as told:
        assert told is silent
