"""The next test, from what a discovery or a fit left open, for recordings in memory."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.advise import stage
from mrfit.advise.rig import Rig, read_rig, rig_of
from mrfit.api.discovery import Discovery
from mrfit.api.fitting import FitResult
from mrfit.api.preparing import Preparation, as_asked, prepared
from mrfit.api.recordings import PathText
from mrfit.api.threads import one_blas_thread
from mrfit.api.words import frame_of, text_table
from mrfit.core.arguments import check_arguments
from mrfit.core.recording import Recording
from mrfit.errors import DataError
from mrfit.io.bars import Heard, shown
from mrfit.io.schemas.advice import AdviceFile
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.io.workspace import plain

if TYPE_CHECKING:
    from pandas import DataFrame

ADVICE_COLUMNS = ("test", "kind", "seconds", "waiting", "least", "drive")
WIDTHS = ("parameter", "unit", "value", "before", "after")


@dataclass(frozen=True, repr=False, eq=False)
class Advice:
    """The next test.

    Attributes
    ----------
    content
        Content of advise.json, all there is to say.
    made
        The same with the drives and the figure.
    """

    content: AdviceFile
    made: stage.AdviceFiles

    @property
    def text(self) -> tuple[str, ...]:
        """Advice in sentences."""
        return self.content.text

    @property
    def tests(self) -> "DataFrame":
        """The best test of each kind, the best first, and the companion to be held out.

        ``least`` is the least distance of the rivals that the rig can separate, in standard errors.
        """
        apart = [k for k, pair in enumerate(self.content.pairs) if pair.separable]
        companion = (self.content.companion,) if self.content.companion else ()
        rows = [
            {"test": t.text, "least": min((t.distances[k] for k in apart), default=None), **vars(t)}
            for t in (*self.content.tests, *companion)
        ]
        return frame_of(rows, ADVICE_COLUMNS)

    @property
    def widths(self) -> "DataFrame":
        """Half-widths of a fit's 95 % intervals, and those expected after the best test."""
        rows = [{"parameter": w.name, **vars(w)} for w in self.content.widths]
        return frame_of(rows, WIDTHS, "parameter")

    @check_arguments
    def drive(self, name: str = "test-1.csv") -> "DataFrame":
        """Return the drive of a test as the press takes it: time, motion, velocity and current.

        Raises
        ------
        DataError
            If there is none of this name.
        """
        from pandas import read_csv

        if name not in self.made.drives:
            raise DataError(f"no drive '{name}'; there are {', '.join(self.made.drives) or 'none'}")
        return read_csv(StringIO(self.made.drives[name]))

    def to_json(self) -> dict[str, Any]:
        """Return the content of advise.json."""
        found: dict[str, Any] = plain(self.content)
        return found

    @check_arguments
    def save(self, folder: PathText) -> None:
        """Write advise.json, the drives and the figure into a folder."""
        stage.write(Path(folder), self.made)

    def __repr__(self) -> str:
        return "\n".join([*self.text, text_table(self.tests)])


@check_arguments
def advise(
    found: Discovery | FitResult,
    recordings: Recording | Iterable[Recording],
    rig: Rig | Mapping[str, Any] | PathText,
    *,
    seed: int = 0,
    progress: Heard = True,
) -> Advice:
    """Choose the test that separates most, per second, what a discovery left open, as ``mrfit advise`` does.

    Of a fit it is the test that narrows the intervals of its parameters most.

    Parameters
    ----------
    found
        A discovery or a fit.
    recordings
        What it was made of.
    rig
        Limits of the press or the amplifier, SI or with units: a table such as ``{"seconds": 10, "stroke": "50 mm",
        "speed": 0.2}``, or the path of a TOML file with the table ``[rig]``.
    seed
        Of every random choice.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.

    Raises
    ------
    ConfigError
        If the rig's limits are wrong or leave no test, or a rival needs a channel that the rig does not move.
    DataError
        If no rivals are left.
    """
    limits = rig if isinstance(rig, Rig) else rig_of(dict(rig)) if isinstance(rig, Mapping) else read_rig(Path(rig))
    how = found.preparation if isinstance(found, FitResult) else as_asked({})
    with one_blas_thread(), shown(progress) as told:
        data = prepared(recordings, Preparation(how.flux, how.segment), told).dataset
        if isinstance(found, FitResult):
            made = stage.of_fit(stage.bench_of(data, found.model), found.content, limits, seed, told)
        else:
            content = DiscoveryFile.of(found.to_json())
            made = stage.of_discovery(stage.bench_of(data, content.base_model), content, limits, seed, told)
    return Advice(made.content, made)
