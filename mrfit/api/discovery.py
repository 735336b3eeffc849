"""Discovery of the effect that a model lacks, for recordings in memory."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.api import drawing
from mrfit.api.options import check_names, settings_of, with_options
from mrfit.api.preparing import STAGE_SETTINGS, as_asked, on_disk, prepared
from mrfit.api.recordings import PathText
from mrfit.api.threads import one_blas_thread
from mrfit.api.words import PrintableResult, frame_of, text_table
from mrfit.core.arguments import check_arguments
from mrfit.core.recording import Recording
from mrfit.discover import stage as discover_stage
from mrfit.io.bars import Heard, shown
from mrfit.io.schemas.discovery import DiscoveryFile, FoundEffect, Gap, LawGap
from mrfit.io.workspace import write_json
from mrfit.report.explain import headline, next_step, sentences
from mrfit.report.law_words import other_law_sentences

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

OPENINGS = {"ambiguous": "to tell {} apart: ", "insufficient-data": "to reach a verdict: "}


@dataclass(frozen=True, repr=False, eq=False)
class Discovery(PrintableResult):
    """Effects that a model lacks, with the evidence for them.

    Attributes
    ----------
    content
        Content of discovery.json, all there is to say.
    """

    content: DiscoveryFile

    @property
    def verdict(self) -> str:
        """``none``, ``named``, ``ambiguous``, ``unexplained`` or ``insufficient-data``."""
        return self.content.verdict

    @property
    def effects(self) -> tuple[FoundEffect, ...]:
        """The effects that were named: parameters with intervals, and the error on held-out conditions (NRMSE)."""
        return self.content.effects

    @property
    def ambiguous_set(self) -> tuple[str, ...]:
        """Effects that these data cannot distinguish."""
        return self.content.ambiguous_set

    @property
    def advice(self) -> tuple[str, ...]:
        """Tests that would settle what is open."""
        return self.content.advice

    @property
    def augmented_model(self) -> str:
        """The model with the effects found; ``mrfit.fit`` takes it."""
        return self.content.augmented_model

    @property
    def candidates(self) -> "DataFrame":
        """Result of screening and refit for every effect of the library."""
        return frame_of(
            [c.model_dump() for c in self.content.candidates],
            ("name", "screen", "holdout_gain", "accepted", "reason"),
            "name",
        )

    @property
    def gap(self) -> Gap:
        """Noise floor, error before and after on held-out conditions (NRMSE), and the share that is closed."""
        return self.content.gap

    @property
    def law_gap(self) -> LawGap | None:
        """Error of the model's own law, without effects; None where it was taken as exact."""
        return self.content.law_gap

    @property
    def other_laws(self) -> "DataFrame":
        """Other models that take a share of the gap, alone and beside the effects that were named."""
        columns = ("model", "holdout_nrmse", "takes", "takes_beside", "floors", "command")
        return frame_of([law.model_dump() for law in self.content.other_laws], columns, "model")

    @property
    def confounded(self) -> "DataFrame":
        """Effects that the law could imitate on these data, why, and the test that would separate them."""
        return frame_of([vars(c) for c in self.content.confounded], ("name", "reason", "test"), "name")

    def plot(self) -> "Figure":
        """Return a figure: the error on held-out conditions without and with each effect, above the noise floor.

        Raises
        ------
        DataError
            If the data were too few to tell an error.
        """
        return drawing.gap_plot(self.content)

    def to_json(self) -> dict[str, Any]:
        """Return the content of discovery.json, as JSON has it."""
        return self.content.to_json()

    @check_arguments
    def save(self, path: PathText) -> None:
        """Write discovery.json."""
        write_json(Path(path), self.to_json())

    def __repr__(self) -> str:
        title, tables, said = self._parts()
        return "\n".join([title, *said, *map(text_table, tables)])

    def _parts(self) -> "tuple[str, list[DataFrame], list[str]]":
        found = self.content
        opening = OPENINGS.get(self.verdict, "").format(", ".join(self.ambiguous_set))
        # too few data: the sentences are the advice
        advice = [f"{opening}{text}" for text in self.advice] if self.verdict == "ambiguous" else []
        go_on = [f"go on with the model {self.augmented_model}"] if next_step(found) else []
        said = [*sentences(found), *other_law_sentences(found), *advice, *go_on]
        rows = [
            {"effect": e.name, "parameter": p.name, "value": p.value, "unit": p.unit, "low": p.low, "high": p.high}
            for e in self.effects
            for p in e.parameters
        ]
        tables = [frame_of(rows, ("effect", "parameter", "value", "unit", "low", "high"))] if rows else []
        return headline(found), tables, said


@check_arguments
def discover(
    recordings: Recording | Iterable[Recording], model: str, *, progress: Heard = True, **options: object
) -> Discovery:
    """Find the effects that a model lacks, as ``mrfit discover`` does.

    It keeps segments and refits in a temporary folder, which is removed at the end.

    Parameters
    ----------
    recordings
        One or several, of ``mrfit.read``, ``Recording.from_frame`` or ``Recording.from_arrays``.
    model
        Base model; effects written with it (``tanh+delay``) are part of it.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.
    **options
        Those of ``mrfit discover``, ``mrfit flux`` and ``mrfit segment``, see below.

    Raises
    ------
    ConfigError
        If a name or an option is wrong.
    DataError
        If the recordings lack what the model needs, or no segment is found.
    """
    kind = discover_stage.Settings
    check_names((kind, *STAGE_SETTINGS), options)
    settings = settings_of(kind, options, model=model)
    discover_stage.check(settings)
    with one_blas_thread(), shown(progress) as told:
        made = prepared(recordings, as_asked(options), told)
        with on_disk(made.dataset) as workspace:
            return Discovery(discover_stage.run(workspace, settings, told).found)


with_options(discover, (discover_stage.Settings, *STAGE_SETTINGS), ("model",))
