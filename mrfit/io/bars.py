"""Progress bars: on standard error where that is a terminal, below the cell in a notebook."""

import html
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from mrfit.core.progress import Progress, on_compilation, silent
from mrfit.io.escapes import visible

BAR_PATIENCE = 0.5
"""Seconds that a call may take before a notebook shows a bar."""
PAUSE = 0.2
"""Seconds between two changes of what a notebook shows."""

Heard = Progress | bool
"""Who hears of progress: a function, True for a bar where someone can see it, False for nobody."""


@contextmanager
def shown(progress: Heard = True) -> Iterator[Progress]:
    """Give a progress listener: the function given, or a bar that is gone at the end; silent where nobody sees it."""
    with _listener(progress) as listen, on_compilation(listen):
        yield listen


@contextmanager
def _listener(progress: Heard) -> Iterator[Progress]:
    if callable(progress):
        yield progress
    elif progress and (show := _notebook()):
        cell = _Cell(show)
        try:
            yield cell
        finally:
            cell.clear()
    elif progress and sys.stderr is not None and sys.stderr.isatty():
        with terminal_bars() as listen:
            yield listen
    else:
        yield silent


@contextmanager
def terminal_bars() -> Iterator[Progress]:
    """Give a progress listener that draws one bar for each task on standard error."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    layout = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Bars(*layout, console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, Any] = {}

        def listen(what: str, done: int, total: int) -> None:
            # what changes within a task (best error so far) stands after two blanks
            what = visible(what)
            task = what.split("  ")[0]
            if task not in tasks:
                tasks[task] = bars.add_task(what, total=total)
            bars.update(tasks[task], description=what, completed=done, total=total, visible=done < total)

        yield listen


def _notebook() -> "Callable[[str], Callable[[str], None]] | None":
    """Return a function that shows HTML below the cell and returns its replacement; None outside a notebook."""
    # rich would need ipywidgets there
    if "IPython" not in sys.modules:
        return None
    from IPython.core.getipython import get_ipython

    if not hasattr(get_ipython(), "kernel"):
        return None
    from IPython.display import HTML, display

    def show(text: str) -> Callable[[str], None]:
        handle = display(HTML(text), display_id=True)
        return lambda later: handle.update(HTML(later))

    return show


class _Cell:
    """A progress listener that draws one bar for each unfinished task as HTML."""

    def __init__(self, show: Callable[[str], Callable[[str], None]]) -> None:
        self.show = show
        self.replace: Callable[[str], None] | None = None
        self.due = time.monotonic() + BAR_PATIENCE
        self.bars: dict[str, str] = {}

    def __call__(self, what: str, done: int, total: int) -> None:
        what = visible(what)
        task = what.split("  ")[0]
        if done >= total:
            self.bars.pop(task, None)
        else:
            bar = f'<progress value="{done}" max="{total}"></progress> {done}/{total} {html.escape(what)}'
            self.bars[task] = f"<div>{bar}</div>"
        now = time.monotonic()
        if now < self.due:
            return
        self.due = now + PAUSE
        text = "".join(self.bars.values())
        if self.replace is None:
            self.replace = self.show(text)
        else:
            self.replace(text)

    def clear(self) -> None:
        """Take the bars away."""
        if self.replace is not None:
            self.replace("")
