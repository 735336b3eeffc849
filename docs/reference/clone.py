"""The folder in which a page's code runs."""

import os
import tempfile
from pathlib import Path

DATASETS = Path(__file__).parents[2] / "datasets"


def folder_with_datasets() -> None:
    """Go to a new folder that has ``datasets`` in it, as a clone of the repository has. Tables get 88 columns."""
    folder = Path(tempfile.mkdtemp(prefix="mrfit-docs-"))
    (folder / "datasets").symlink_to(DATASETS)
    os.chdir(folder)
    os.environ["COLUMNS"] = "88"
    # a kernel asks for colours, which are control characters on a page
    os.environ.pop("FORCE_COLOR", None)
    os.environ["TERM"] = "dumb"

    import matplotlib_inline.backend_inline as inline

    inline.set_matplotlib_formats("svg")
