"""Which effect a model lacks, asked of recordings in memory."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from mrfit.api.options import check_names, settings_of, with_options
from mrfit.api.preparing import SETTINGS, as_asked, on_disk, prepared
from mrfit.api.recordings import PathText
from mrfit.api.threads import one_blas_thread
from mrfit.api.words import frame_of, html_page, html_table, text_table
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording
from mrfit.discover import stage as discover_stage
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.io.workspace import write_json
from mrfit.report.explain import headline, next_step, sentences

if TYPE_CHECKING:
    from pandas import DataFrame

OPENINGS = {"ambiguous": "to tell {} apart: ", "insufficient-data": "to reach a verdict: "}


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect, SI, with its 95 % interval; None where the data leave an end open."""

    name: str
    value: float
    unit: str
    low: float | None
    high: float | None

    @classmethod
    def of(cls, row: Mapping[str, Any]) -> Self:
        """Return a row of discovery.json."""
        return cls(*(row[k] for k in ("name", "value", "unit", "low", "high")))


@dataclass(frozen=True)
class Effect:
    """An effect that is missing, and the error on held-out conditions (NRMSE) without and with it."""

    name: str
    parameters: tuple[Parameter, ...]
    holdout_nrmse_before: float | None
    holdout_nrmse_after: float | None

    @classmethod
    def of(cls, row: Mapping[str, Any]) -> Self:
        """Return a row of discovery.json."""
        parameters = tuple(Parameter.of(p) for p in row["parameters"])
        return cls(row["name"], parameters, row["holdout_nrmse_before"], row["holdout_nrmse_after"])


@dataclass(frozen=True, repr=False, eq=False)
class Discovery:
    """What a model lacks.

    Attributes
    ----------
    content
        Content of discovery.json, all there is to say.
    """

    content: Mapping[str, Any]

    @property
    def verdict(self) -> str:
        """``none``, ``named``, ``ambiguous``, ``unexplained`` or ``insufficient-data``."""
        return str(self.content["verdict"])

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects that were named."""
        return tuple(Effect.of(e) for e in self.content["effects"])

    @property
    def ambiguous_set(self) -> tuple[str, ...]:
        """Effects of which these data cannot tell which one it is."""
        return tuple(self.content["ambiguous_set"])

    @property
    def advice(self) -> tuple[str, ...]:
        """Tests that would settle what is open."""
        return tuple(self.content["advice"])

    @property
    def augmented_model(self) -> str:
        """The model with the effects found; ``mrfit.fit`` takes it."""
        return str(self.content["augmented_model"])

    @property
    def candidates(self) -> "DataFrame":
        """What became of every effect of the library."""
        return frame_of(self.content["candidates"], ("name", "screen", "holdout_gain", "accepted", "reason"), "name")

    @property
    def gap(self) -> dict[str, float | None]:
        """Noise floor, error before and after on held-out conditions (NRMSE), and the share that is closed."""
        return dict(self.content["gap"])

    def to_json(self) -> dict[str, Any]:
        """Return the content of discovery.json."""
        return dict(self.content)

    def save(self, path: PathText) -> None:
        """Write discovery.json."""
        write_json(Path(path), self.to_json())

    def __repr__(self) -> str:
        table = [text_table(self._table)] if self.effects else []
        return "\n".join([headline(self.to_json()), *self._said, *table])

    def _repr_html_(self) -> str:
        tables = [html_table(self._table)] if self.effects else []
        return html_page(headline(self.to_json()), tables, self._said)

    @property
    def _said(self) -> list[str]:
        found = self.to_json()
        opening = OPENINGS.get(self.verdict, "").format(", ".join(self.ambiguous_set))
        # too few data: the sentences are the advice
        advice = [f"{opening}{text}" for text in self.advice] if self.verdict == "ambiguous" else []
        go_on = [f"go on with the model {self.augmented_model}"] if next_step(found) else []
        return [*sentences(found), *advice, *go_on]

    @property
    def _table(self) -> "DataFrame":
        rows = [
            {"effect": e.name, "parameter": p.name, "value": p.value, "unit": p.unit, "low": p.low, "high": p.high}
            for e in self.effects
            for p in e.parameters
        ]
        return frame_of(rows, ("effect", "parameter", "value", "unit", "low", "high"))


def discover(
    recordings: Recording | Iterable[Recording], model: str, *, progress: Progress = silent, **options: object
) -> Discovery:
    """Find which effect a model lacks, as ``mrfit discover`` does.

    It keeps segments and refits in a temporary folder, which is removed at the end.

    Parameters
    ----------
    recordings
        One or several, of ``mrfit.read``, ``Recording.from_frame`` or ``Recording.from_arrays``.
    model
        Base model; effects written with it (``tanh+delay``) are part of it.
    progress
        Called as ``progress(what, done, total)``.
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
    check_names((kind, *SETTINGS), options)
    settings = settings_of(kind, options, model=model)
    discover_stage.check(settings)
    with one_blas_thread():
        made = prepared(recordings, as_asked(options), progress)
        with on_disk(made.dataset) as workspace:
            found = discover_stage.run(workspace, settings, progress)
    DiscoveryFile.of(found)
    return Discovery({name: value for name, value in found.items() if name != "skipped"})


with_options(discover, (discover_stage.Settings, *SETTINGS), ("model",))
