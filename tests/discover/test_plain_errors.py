"""One error for one thing: a discovery and a fit state the same of the same base and data."""

import json
import re
from pathlib import Path

import pytest

from benchmarks.second_rig.specimen import make_specimen
from tests import commands
from tests.fit.test_real_dampers import press as press
from tests.fit.test_real_dampers import read as read

LIMIT = 900.0


def stated(folder: Path, model: str) -> tuple[str, str]:
    """Return the held-out errors of a base as `mrfit discover` and `mrfit fit` print them."""
    found = commands.run(folder, "discover", "--model", model, timeout=LIMIT)
    assert found.returncode == 0, found.stderr.decode()
    plain = re.search(
        rf"Plain errors.*?held out, {re.escape(model)} leaves (\S+) %", " ".join(found.stdout.decode().split())
    )
    fitted = commands.run(folder, "fit", "--model", model, "--per", "all", timeout=LIMIT)
    own = re.search(r"NRMSE (\S+) % held out", fitted.stdout.decode())
    assert plain and own, (found.stdout + fitted.stdout).decode()
    return plain.group(1), own.group(1)


@pytest.mark.slow
def test_both_print_the_same_of_the_press(press: Path) -> None:
    discovered, fitted = stated(press, "guo")
    assert discovered == fitted


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "index"), [("friction", 1), ("warm-up", 0)])
def test_both_print_the_same_of_specimens_of_the_rig(tmp_path: Path, kind: str, index: int) -> None:
    make_specimen(1, kind, index).write(tmp_path)
    assert commands.run(tmp_path, "ingest", "logs").returncode == 0
    discovered, fitted = stated(tmp_path, json.loads((tmp_path / "truth.json").read_text())["base"])
    assert discovered == fitted
