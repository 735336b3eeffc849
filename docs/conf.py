"""Settings of Sphinx: ``make docs`` builds the pages, and runs those with code."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
# for the pages' code too, which runs in processes of its own
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])

from docs.reference.write import write

write()

project = "mrfit"
author = "the mrfit developers"
extensions = ["myst_nb", "docs.reference.mathml"]
html_math_renderer = "mathml"
html_theme = "furo"
html_title = "mrfit"
html_static_path = ["static"]
html_css_files = ["pages.css"]
html_copy_source = False
html_show_copyright = False
# the table of thresholds is part of another page
exclude_patterns = ["reference", "**/__pycache__", "build", "jupyter_execute", "generated/policy.md"]
# pages without code of their own are Markdown, not notebooks, by their heads
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}

myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3
highlight_language = "text"

nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True
nb_execution_show_tb = True
