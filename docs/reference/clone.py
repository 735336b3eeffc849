"""The folder in which a page's code runs, and its ``%%sh`` cells."""

import os
import subprocess
import tempfile
from pathlib import Path

DATASETS = Path(__file__).parents[2] / "datasets"


def folder_with_datasets() -> None:
    """Go to a new folder that has ``datasets`` in it, as a clone of the repository has. Tables get 88 columns."""
    folder = Path(tempfile.mkdtemp(prefix="mrfit-docs-"))
    (folder / "datasets").symlink_to(DATASETS)
    os.chdir(folder)
    os.environ["MRFIT_COLUMNS"] = "88"
    # a kernel asks for colours, which are control characters on a page
    os.environ.pop("FORCE_COLOR", None)
    os.environ["TERM"] = "dumb"

    import matplotlib_inline.backend_inline as inline
    from IPython import get_ipython

    inline.set_matplotlib_formats("svg")
    # IPython's own gives the output in pieces, wherever a read ended
    get_ipython().register_magic_function(_sh, "cell", "sh")


def _sh(line: str, cell: str) -> None:
    """Run commands of a shell, print what they print, and fail where they do."""
    done = subprocess.run(["sh", "-ec", cell], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(done.stdout, end="")
    done.check_returncode()
