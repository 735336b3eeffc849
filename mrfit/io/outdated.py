"""Whether what a workspace holds was made from what is here now, by this code; and if not, why."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Protocol

from mrfit.core.recording import Segment
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
    flux = workspace.flux_file()
    if flux is None or not workspace.ingest_json.is_file():
        return ""
    settings, contents = asdict(flux.settings), workspace.contents(workspace.identifiers)
    if flux.key == flux_key(settings, contents):
        return ""
    if flux.code and flux.key == flux_key(settings, contents, flux.code):
        return other_code(flux.code, "flux")
    return _other_recordings(flux.code, [r.id for r in flux.recordings], contents)


def segment_reason(workspace: Workspace) -> str:
    """Return why the segments are out of date; empty where they are not, or there are none.

    Raises
    ------
    DataError
        If their file or a recording is damaged.
    """
    cut = workspace.segments_summary()
    if cut is None or not workspace.ingest_json.is_file():
        return ""
    settings, contents = asdict(cut.settings), workspace.contents(workspace.identifiers, workspace.latest)
    if cut.key == segment_key(settings, contents):
        return ""
    if cut.code and cut.key == segment_key(settings, contents, cut.code):
        return other_code(cut.code, "segment")
    return _other_recordings(cut.code, [r.id for r in cut.recordings], contents)


class Stamped(Protocol):
    """A result that says what it was made from; ``code`` and ``data_sha256`` are empty where it does not say."""

    @property
    def key(self) -> str:
        """Hash of all that made it."""

    @property
    def settings(self) -> Mapping[str, Any]:
        """Settings of its stage."""

    @property
    def code(self) -> str:
        """Version of the code."""

    @property
    def data_sha256(self) -> str:
        """Hash of the recordings."""


class Inputs:
    """What fits and discoveries would be made from now; read once for any number of them.

    Parameters
    ----------
    workspace
        Where they lie.
    """

    def __init__(self, workspace: Workspace) -> None:
        self.fault, self.contents, self.segments = "", dict[str, str](), list[Segment]()
        try:
            self.contents, self.segments = workspace.made_from(workspace.segments())
            if why := flux_reason(workspace):
                self.fault = f"the flux linkage is out of date: {why}"
            elif why := segment_reason(workspace):
                self.fault = f"the segments are out of date: {why}"
        except DataError as error:
            self.fault = str(error)

    def reason(self, result: Stamped, key: Callable[..., str] = fit_key, stage: str = "fit") -> str:
        """Return why a result is out of date; empty where it is not.

        Parameters
        ----------
        result
            What is judged.
        key
            Computes what its key would be now.
        stage
            What made it, as in ``code_version``.
        """
        if self.fault:
            return self.fault
        if result.key == key(result.settings, self.contents, self.segments):
            return ""
        if not result.code:
            return UNKNOWN
        if result.key == key(result.settings, self.contents, self.segments, result.code):
            return other_code(result.code, stage)
        if result.data_sha256 == digest_of(self.contents):
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
