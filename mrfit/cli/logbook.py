"""The commands that made a workspace: a line for each in ``commands.log``."""

import contextlib
import os
import shlex
import sys
from datetime import UTC, datetime
from pathlib import Path

from mrfit.io.atomic import opened_to_append
from mrfit.io.escapes import visible

LOGBOOK_NAME = "commands.log"
# Functions of the commands that write into a workspace, ``predict`` with --save alone
WRITING = set(
    "advise compare discover export figure fit flux ingest invert predict quarter_car remove report segment track "
    "track_parameters".split()
)
# Those of which another run may write files of the same names
COMMANDS_NAMED = {"advise", "export", "figure", "invert", "predict", "quarter_car", "track", "track_parameters"}


def append(work: Path, seconds: float) -> None:
    """Add the command that runs to the log of a workspace: when it ended, how it was written, how long it took.

    A workspace that cannot be written, or in which the log is a link, is left as it is: the results are there.
    """
    if not work.is_dir():
        return
    line = (
        f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ} {visible(shlex.join(['mrfit', *sys.argv[1:]]))}  # {seconds:.1f} s\n"
    )
    # one call: commands that end together do not mix their lines
    with contextlib.suppress(OSError), opened_to_append(work / LOGBOOK_NAME) as handle:
        os.write(handle.fileno(), line.encode("utf-8", "backslashreplace"))
