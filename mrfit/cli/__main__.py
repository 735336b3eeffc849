"""The command line as a process: the script ``mrfit`` and ``python -m mrfit.cli``."""

import atexit
import os
import sys

from mrfit.core import current_folder

# before anything is imported that may lie there
current_folder.leave_out()

from mrfit.cli.main import main as run


class _End:
    """The end of the process, once everything that asked for it has been told and has cleaned up.

    Python would then free every object of every library, a quarter of the processor time of a short command. The
    system frees a process's memory at once.
    """

    def __init__(self) -> None:
        self.code: int | None = None
        # what is registered first is called last
        atexit.register(self.at_once)

    def at_once(self) -> None:
        """End, unless the command has not, or what it printed cannot be written, which Python then says."""
        if self.code is None:
            return
        try:
            sys.stdout.flush()
            sys.stderr.flush()
        except (OSError, ValueError):
            return
        os._exit(self.code)


def main() -> None:
    """Run the command line and end the process."""
    end = _End()
    try:
        run()
    except SystemExit as left:
        end.code = left.code if isinstance(left.code, int) else None
        raise


if __name__ == "__main__":
    main()
