"""Whether what a workspace holds was made from what is here now, by this code; and if not, why."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from mrfit.errors import DataError
from mrfit.io.keys import code_version, digest_of, fit_key, flux_key, segment_key

if TYPE_CHECKING:
    from mrfit.io.workspace import Workspace

# Names written out in a reason
SHOWN = 5
UNKNOWN = "made from other data, or by other code, than are here now"


def flux_reason(workspace: Workspace) -> str:
    """Return why the flux linkage is out of date; empty where it is not, or there is none.

    Raises
    ------
    DataError
        If flux.json or a recording is damaged.
    """
    flux = workspace.flux_file() or {}
    # what has no key does not say what it was made from
    if "key" not in flux or not workspace.ingest_json.is_file():
        return ""
    contents = workspace.contents(workspace.identifiers)
    if flux["key"] == flux_key(flux["settings"], contents):
        return ""
    if flux["code"] and flux["key"] == flux_key(flux["settings"], contents, flux["code"]):
        return other_code(flux["code"], "flux")
    return _other_recordings(flux["code"], [r["id"] for r in flux["recordings"]], contents)


def segment_reason(workspace: Workspace) -> str:
    """Return why the segments are out of date; empty where they are not, or there are none.

    Raises
    ------
    DataError
        If their file or a recording is damaged.
    """
    cut = workspace.segments_summary() or {}
    if "key" not in cut or not workspace.ingest_json.is_file():
        return ""
    contents = workspace.contents(workspace.identifiers, workspace.latest)
    if cut["key"] == segment_key(cut["settings"], contents):
        return ""
    if cut["code"] and cut["key"] == segment_key(cut["settings"], contents, cut["code"]):
        return other_code(cut["code"], "segment")
    return _other_recordings(cut["code"], [r["id"] for r in cut.get("recordings", [])], contents)


class Inputs:
    """What fits and discoveries would be made from now; read once for any number of them.

    Parameters
    ----------
    workspace
        Where they lie.
    """

    def __init__(self, workspace: Workspace) -> None:
        self.fault, self.contents, self.segments = "", dict[str, str](), list[dict[str, Any]]()
        try:
            self.contents, self.segments = workspace.made_from(workspace.read_segments()[0])
            if why := flux_reason(workspace):
                self.fault = f"the flux linkage is out of date: {why}"
            elif why := segment_reason(workspace):
                self.fault = f"the segments are out of date: {why}"
        except DataError as error:
            self.fault = str(error)

    def reason(self, result: Mapping[str, Any], key: Callable[..., str] = fit_key, stage: str = "fit") -> str:
        """Return why a result is out of date; empty where it is not.

        Parameters
        ----------
        result
            Its ``key`` and ``settings``, and where it has them ``code`` and ``data_sha256``.
        key
            Computes what its key would be now.
        stage
            What made it, as in ``code_version``.
        """
        if self.fault:
            return self.fault
        if result["key"] == key(result["settings"], self.contents, self.segments):
            return ""
        code, data = result.get("code"), result.get("data_sha256")
        if not code:
            return UNKNOWN
        if result["key"] == key(result["settings"], self.contents, self.segments, code):
            return other_code(code, stage)
        if data == digest_of(self.contents):
            return "the segments have changed since"
        return "its recordings, or their flux linkage, have changed since"


def other_code(code: str, stage: str) -> str:
    """Return that one version of the code made something and another one is here."""
    return f"made by other code ({code[:8]}) than this ({code_version(stage)[:8]})"


def _other_recordings(code: str, then: Iterable[str], now: Iterable[str]) -> str:
    """Return how the recordings differ from those of then, made by this code."""
    gone, new = sorted({*then} - {*now}), sorted({*now} - {*then})
    told = [f"{_named(ids)} {how}" for ids, how in ((new, "new"), (gone, "gone")) if ids]
    if not (code or told):
        return UNKNOWN
    return f"the recordings have changed since{': ' if told else ''}{', '.join(told)}"


def _named(names: list[str]) -> str:
    more = len(names) - SHOWN
    return " ".join(names[:SHOWN]) + (f" and {more} more" if more > 0 else "")
