"""Preparation of recordings in memory: flux linkage and segments, as the commands do it."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import mrfit.flux.stage
import mrfit.segment.stage
from mrfit.api.options import Options, settings_of
from mrfit.api.recordings import several
from mrfit.core import temporary
from mrfit.core.progress import Progress
from mrfit.core.recording import Recording
from mrfit.io.dataset import Dataset
from mrfit.io.workspace import Workspace

STAGE_SETTINGS = (mrfit.flux.stage.Settings, mrfit.segment.stage.Settings)


@dataclass(frozen=True)
class Preparation:
    """Preparation of recordings for a fit.

    Attributes
    ----------
    flux, segment
        Settings of flux reconstruction and of segmentation.
    resistance
        Coil resistance in Ω by which flux linkage was reconstructed (the median, if logs differ), or None.
    """

    flux: mrfit.flux.stage.Settings = field(default_factory=mrfit.flux.stage.Settings)
    segment: mrfit.segment.stage.Settings = field(default_factory=mrfit.segment.stage.Settings)
    resistance: float | None = None

    def to_predict(self, resistance: float | str | None) -> "Preparation":
        """Return the preparation of logs that the fit predicts: as its own, but nothing is held out."""
        flux = mrfit.flux.stage.to_predict(self.flux, self.resistance, resistance)
        return Preparation(flux, replace(self.segment, holdout="none"))


@dataclass(frozen=True)
class PreparedSegments:
    """Segments, how they were made, and what was odd."""

    dataset: Dataset
    preparation: Preparation
    findings: tuple[str, ...]


def as_asked(options: Options) -> Preparation:
    """Return the preparation of recordings by the options of a call."""
    flux, segment = (settings_of(kind, options) for kind in STAGE_SETTINGS)
    return Preparation(flux, segment)  # type: ignore[arg-type]


def prepared(recordings: Recording | Iterable[Recording], how: Preparation, progress: Progress) -> PreparedSegments:
    """Return the segments of recordings, with flux linkage where coil voltage and current are there.

    Raises
    ------
    ConfigError, DataError
        As the flux and segment stages do.
    """
    found, resistance = mrfit.flux.stage.reconstruct(several(recordings), how.flux)
    segments, detections = mrfit.segment.stage.cut(found, len(found), how.segment, progress)
    findings = tuple(f for d in detections for f in d.findings)
    dataset = Dataset(segments, {r.id: r for r in found})
    return PreparedSegments(dataset, replace(how, resistance=resistance), findings)


@contextmanager
def on_disk(dataset: Dataset) -> Iterator[Workspace]:
    """Give a workspace that holds segments and recordings, for the time of one call, and leave no trace of it."""
    with temporary.folder("call") as folder:
        workspace = Workspace(folder)
        for recording in dataset.recordings.values():
            workspace.write_recording(recording)
        workspace.write_segments(dataset.segments, {})
        yield workspace
