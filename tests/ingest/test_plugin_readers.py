"""Readers of plug-ins among mrfit's own: one that claims another's file, or fails, is named with its place."""

from pathlib import Path

import pytest

from mrfit.core import plugins
from mrfit.ingest.dispatch import reader_of
from mrfit.ingest.hashes import hash_of
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.reading import LogItem, read_item
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.text.head import open_head
from tests.ingest.samples import sample
from tests.plugin_files import EXAMPLE, acme_log

ACME = EXAMPLE / "mrfit_example" / "acme.py"
RIVAL = """
from mrfit.core.specs import ReaderSpec
SPEC = ReaderSpec("rival", "Claims what begins with a mark")
def sniff(head):
    {sniff}
def read(source):
    return 1 / 0
"""


@pytest.fixture(autouse=True)
def store(monkeypatch: pytest.MonkeyPatch) -> None:
    """No plug-ins but those of the test."""
    monkeypatch.setattr(plugins, "_store", plugins.Store())
    monkeypatch.setenv(plugins.VARIABLE, "")


def rival(folder: Path, sniff: str) -> Path:
    path = folder / "rival.py"
    path.write_text(RIVAL.format(sniff=sniff))
    plugins.use(path)
    return path


def test_two_plugin_readers_that_claim_a_file_are_both_named(tmp_path: Path) -> None:
    log = acme_log(tmp_path / "run1.log", seconds=1.0)
    plugins.use(ACME)
    assert reader_of(open_head(log)) == "acme"
    path = rival(tmp_path, "return head.lines[0].startswith('ACME')")
    with pytest.raises(Refusal) as error:
        reader_of(open_head(log))
    names = f"(acme of {ACME} and rival of {path})"
    told = f"{log}: it has the marks of more than one format {names}; let the plug-in's sniff ask for more, or leave"
    assert str(error.value).startswith(told)


def test_a_plugin_reader_that_claims_the_file_of_one_of_mrfits_own_is_named_with_it(tmp_path: Path) -> None:
    _, log = sample("rigol", tmp_path)
    path = rival(tmp_path, "return head.path.name.endswith('.csv')")
    with pytest.raises(Refusal, match=f"more than one format .rigol and rival of {path}."):
        reader_of(open_head(log))


def test_a_plugin_reader_beside_which_no_other_claims_a_file_is_no_trouble(tmp_path: Path) -> None:
    _, log = sample("rigol", tmp_path)
    rival(tmp_path, "return head.lines[0].startswith('OTHER')")
    assert reader_of(open_head(log)) == "rigol"


@pytest.mark.parametrize(
    ("sniff", "told"),
    [
        ("return 1 / 0", "the plug-in reader rival ({}) failed to tell whether it is its own (ZeroDivisionError: "),
        ("return True", "a fault in the plug-in reader rival ({}) (ZeroDivisionError: division by zero); mend the"),
    ],
)
def test_a_plugin_reader_that_fails_is_named_with_the_log(tmp_path: Path, sniff: str, told: str) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time (s),force (N)\n" + "".join(f"{k / 1000},{k % 7}\n" for k in range(500)))
    path = rival(tmp_path, sniff)
    try:
        outcome = read_item(LogItem(((log, hash_of(log)),), reader_of(open_head(log)), Rules()))
        (refusal,) = outcome.refusals
    except Refusal as error:
        refusal = error
    assert str(refusal).startswith(f"{log}: {told.format(path)}") and "\n" not in str(refusal)
