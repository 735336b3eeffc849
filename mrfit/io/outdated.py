"""Whether what a workspace holds was made from what is here now, by this code; and if not, why."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Protocol, cast

from mrfit.core import registry
from mrfit.core.built_in import Kind
from mrfit.core.counting import few
from mrfit.core.recording import Segment
from mrfit.errors import DataError
from mrfit.io.keys import PLUGIN, code_version, digest_of, fit_key, flux_key, law_code, segment_key, segments_digest
from mrfit.io.schemas.fit import Fit

if TYPE_CHECKING:
    from mrfit.io.schemas.stages import FluxFile, SegmentsFile
    from mrfit.io.workspace import Workspace

# Names written out in a reason
SHOWN_RECORDINGS = 5
_NOT_NAMED = "not here, which --plugin names"
UNKNOWN_REASON = "made from other data, or by other code, than are here now"


def flux_reason(workspace: Workspace) -> str:
    """Return the reason for which the flux linkage is out of date; empty where it is not, or there is none.

    Raises
    ------
    DataError
        If flux.json or a recording is damaged.
    """
    flux = workspace.flux_file()
    if flux is None or not workspace.ingest_json.is_file():
        return ""
    return _reason(flux, flux_key, workspace.contents(workspace.identifiers), "flux")


def segment_reason(workspace: Workspace) -> str:
    """Return the reason for which the segments are out of date; empty where they are not, or there are none.

    Raises
    ------
    DataError
        If their file or a recording is damaged.
    """
    cut = workspace.segments_summary()
    if cut is None or not workspace.ingest_json.is_file():
        return ""
    return _reason(cut, segment_key, workspace.contents(workspace.identifiers, workspace.latest), "segment")


def _reason(made: FluxFile | SegmentsFile, key: Callable[..., str], contents: Mapping[str, str], stage: str) -> str:
    """Return the reason for which a stage is out of date whose recordings have these contents now."""
    settings = asdict(made.settings)
    if made.key == key(settings, contents):
        return ""
    if made.code and made.key == key(settings, contents, made.code):
        return other_code(made.code, stage)
    return _other_recordings(made.code, [r.id for r in made.recordings], contents)


class DatedResult(Protocol):
    """A result that says what it was made from; ``code`` and the hashes are empty where it does not say."""

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

    @property
    def segments_sha256(self) -> str:
        """Hash of the segments."""


class Inputs:
    """Inputs that fits and discoveries would have now; read once for any number of them.

    Parameters
    ----------
    workspace
        Where they lie.
    """

    def __init__(self, workspace: Workspace) -> None:
        self.fault, self.contents, self.segments = "", dict[str, str](), list[Segment]()
        self.flux = False
        """Whether there is a flux linkage, which a damper has not."""
        try:
            self.flux = workspace.flux_file() is not None
            self.contents, self.segments = workspace.made_from(workspace.segments())
            if why := flux_reason(workspace):
                self.fault = f"the flux linkage is out of date: {why}"
            elif why := segment_reason(workspace):
                self.fault = f"the segments are out of date: {why}"
        except DataError as error:
            # pages say it too, which are the same bytes wherever the workspace is
            root = str(workspace.root)
            self.fault = str(error).replace(f"{root}{os.sep}", "").replace(root, "WORK")

    def of_fits(self, fits: Iterable[Fit]) -> dict[str, str]:
        """Return the reasons for which fits are out of date, by their names; a fit without a key states none."""
        return {fit.name: why for fit in fits if fit.key and (why := self.reason(fit))}

    def reason(self, result: DatedResult, key: Callable[..., str] = fit_key, stage: str = "fit") -> str:
        """Return the reason for which a result is out of date; empty where it is not.

        Parameters
        ----------
        result
            What is judged.
        key
            Computes what its key would be now.
        stage
            What made it, as in ``code_version``.
        """
        law = law_reason(result) if isinstance(result, Fit) else ""
        if self.fault:
            return "; ".join(filter(None, (self.fault, law)))
        if result.key == key(result.settings, self.contents, self.segments):
            return ""
        if not result.code:
            return UNKNOWN_REASON
        if not law and result.key == key(result.settings, self.contents, self.segments, result.code):
            return other_code(result.code, stage)
        if result.data_sha256 != digest_of(self.contents):
            data = f"its recordings{', or their flux linkage,' * self.flux} have changed since"
        elif not result.segments_sha256 and not law:
            data = "the segments, or a plug-in that it was made with, have changed since"
        else:
            same = result.segments_sha256 in ("", segments_digest(self.segments))
            data = "" if same else "the segments have changed since"
        return "; ".join(filter(None, (data, law))) or "a plug-in that it was made with has changed since"


def law_reason(fit: Fit) -> str:
    """Return the code of a fit's law that has changed since the fit; empty where all is, or the fit does not say."""
    now = law_code(fit.model) if fit.law else {}
    if gone := _without_plugin(fit, now):
        return gone
    changed = [_called(name) for name in sorted({*fit.law, *now}) if fit.law.get(name) != now.get(name)]
    return f"{', '.join(changed)} {'has' if len(changed) == 1 else 'have'} changed since" if changed else ""


def _without_plugin(fit: Fit, now: Mapping[str, str]) -> str:
    """Return the plug-ins of a fit's law that are not in the code of now, in words; empty where all are."""
    gone = [name for name in sorted(fit.law) if name.startswith(PLUGIN) and name not in now]
    return f"the {' and the '.join(gone)} {'is' if len(gone) == 1 else 'are'} {_NOT_NAMED}" if gone else ""


def check_plugins(fit: Fit) -> None:
    """Refuse a fit whose plug-ins are not here.

    Raises
    ------
    DataError
        If one is not; its file need only be named.
    """
    if why := _without_plugin(fit, law_code(fit.model) if fit.law else {}):
        raise _unnamed(fit, why)


def _unnamed(fit: Fit, why: str) -> DataError:
    return DataError(f"the fit {fit.name}: {why}: {remedy(why)}")


def remedy(reason: str) -> str:
    """Return the remedy for a reason why a fit is out of date."""
    # a reason beside this one is one to fit again
    return "name its file" if reason.endswith(_NOT_NAMED) and "; " not in reason else "fit again"


def _called(name: str) -> str:
    """Return the name of a file of a law, of a plug-in with the file or package that it comes from."""
    if not name.startswith(PLUGIN):
        return name
    kind, _, item = name.removeprefix(PLUGIN).partition(" ")
    return f"the {name} ({os.path.basename(registry.where(cast(Kind, kind), item))})"


def check_law(fit: Fit) -> None:
    """Refuse a fit whose parameters are those of another law than the code here has.

    Raises
    ------
    DataError
        If a file or a plug-in of its law has changed.
    """
    why = law_reason(fit)
    if why.endswith(_NOT_NAMED):
        raise _unnamed(fit, why)
    if why:
        raise refusal(fit, f"{why}: its parameters are not those of this law")


def refusal(fit: Fit, why: str) -> DataError:
    """Return the error on a fit that must not be used, with the command that makes it right."""
    per = "all" if fit.per == "all" else "condition"
    command = f"mrfit fit --model {fit.model} --opt {fit.optimizer} --per {per}"
    return DataError(f"the fit {fit.name}: {why}; fit again: `{command}`")


def other_code(code: str, stage: str) -> str:
    """Return that one version of the code made something and another one is here."""
    return f"made by other code ({code[:8]}) than this ({code_version(stage)[:8]})"


def _other_recordings(code: str, then: Iterable[str], now: Iterable[str]) -> str:
    """Return the difference of the recordings from those of then, made by this code."""
    gone, new = sorted({*then} - {*now}), sorted({*now} - {*then})
    told = [f"{few(ids, SHOWN_RECORDINGS, ' ')} {how}" for ids, how in ((new, "new"), (gone, "gone")) if ids]
    if not (code or told):
        return UNKNOWN_REASON
    return f"the recordings have changed since{': ' if told else ''}{', '.join(told)}"
