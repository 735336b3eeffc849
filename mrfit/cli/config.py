"""Pipeline files: one TOML file says which logs, which model, which optimizer and what is reported."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import AliasChoices, BaseModel, BeforeValidator, ConfigDict, Field, create_model, model_validator

import mrfit.settings.compare
import mrfit.settings.discover
import mrfit.settings.export
import mrfit.settings.figure
import mrfit.settings.fit
import mrfit.settings.flux
import mrfit.settings.ingest
import mrfit.settings.report
import mrfit.settings.segment
import mrfit.settings.sheet
from mrfit.core.setting import UNSET, Setting, SettingField, defined, flag_of, key_of
from mrfit.errors import ConfigError
from mrfit.io.toml_file import TomlTable, read_tables

Made = TypeVar("Made")


class SettingsTable(TomlTable):
    """A table of settings: TOML has infinities, and no setting takes one."""

    model_config = ConfigDict(allow_inf_nan=False)


def table_of(kind: type[Any], /, **more: Any) -> type[TomlTable]:
    """Return the table of a pipeline file that holds settings of a kind, with more keys before those of its fields."""
    keys: dict[str, Any] = {**more, **{key_of(f): _key(f) for f in _written(kind)}}
    return create_model(kind.__module__.rpartition(".")[2], __base__=SettingsTable, **keys)


def made_of(kind: type[Made], table: BaseModel, **decided: object) -> Made:
    """Return settings of a kind, of the keys that a table has; the others are at their defaults."""
    fields = [f for f in _written(kind) if key_of(f) in table.model_fields_set]
    return kind(**{f.name: _loaded(f, getattr(table, key_of(f))) for f in fields}, **decided)


def _written(kind: type[Any]) -> list[SettingField]:
    """Return the fields of settings that a pipeline file may have."""
    return [f for f in defined(kind) if f.setting and f.setting.in_file and f.setting.changes_result]


def _key(field: SettingField) -> tuple[Any, Any]:
    setting = field.setting or Setting("")
    limits = {"ge": setting.low, "le": setting.high, "gt": setting.above}
    given: dict[str, Any] = {name: limit for name, limit in limits.items() if limit is not None}
    kind = setting.form.key if setting.form else field.kind
    names = dict.fromkeys([key_of(field), flag_of(field), field.name])
    return kind, Field(... if field.default is UNSET else None, validation_alias=AliasChoices(*names), **given)


def _loaded(field: SettingField, value: object) -> object:
    form = field.setting.form if field.setting else None
    return form.load(value) if form else value


class _File(TomlTable):
    """The whole file; ``[ingest]`` and one of ``[[fit]]``, ``[discover]``, ``[compare]``, ``[sheet]`` must be there."""

    work: str = "mrfit-work"
    plugins: list[str] = []

    @model_validator(mode="after")
    def _something_to_do(self) -> Self:
        if not any(getattr(self, name, None) for name in ("fit", "discover", "compare", "sheet")):
            raise ValueError("add a [[fit]], a [discover], a [compare] or a [sheet] table")
        return self


_INGEST = table_of(mrfit.settings.ingest.Settings, logs=(list[str], Field(min_length=1)))
_FLUX, _SEGMENT = table_of(mrfit.settings.flux.Settings), table_of(mrfit.settings.segment.Settings)
_FIT, _DISCOVER = table_of(mrfit.settings.fit.Settings), table_of(mrfit.settings.discover.Settings)
_REPORT = table_of(mrfit.settings.report.Settings)
_COMPARE = table_of(mrfit.settings.compare.CompareOptions)
_PREDICT = table_of(
    mrfit.settings.ingest.Settings, fit=(str, ...), logs=(list[str], Field(min_length=1)), save=(str, "")
)
_FIGURE = table_of(mrfit.settings.figure.Settings, kind=(Literal[mrfit.settings.figure.FIGURE_KINDS], ...))
_EXPORT = table_of(
    mrfit.settings.export.Settings,
    fit=(str, ...),
    to=(list[str], Field(min_length=1)),
    condition=(str, ""),
    without=(list[str], []),
)
_SHEET = table_of(mrfit.settings.sheet.Settings, against=(list[str], []), pdf=(bool, False))


def _several(kind: Any) -> Any:
    """Return the type of tables of a kind; one alone may be written without the second brackets."""
    return Annotated[list[kind], BeforeValidator(lambda value: [value] if isinstance(value, dict) else value)]


_TABLES: dict[str, Any] = {
    "ingest": (_INGEST, ...),
    "flux": (_FLUX, _FLUX()),
    "segment": (_SEGMENT, _SEGMENT()),
    "fit": (list[_FIT], []),  # type: ignore[valid-type]
    "discover": (_DISCOVER | None, None),
    "compare": (_COMPARE | None, None),
    "report": (_REPORT, _REPORT()),
    "predict": (_several(_PREDICT), []),
    "figure": (_several(_FIGURE), []),
    "export": (_several(_EXPORT), []),
    "sheet": (_SHEET | None, None),
}
_WHOLE = create_model("pipeline", __base__=_File, **_TABLES)


@dataclass(frozen=True)
class PredictTable:
    """A fit to simulate on other logs, given as patterns, how these are read, and the name to keep it under."""

    fit: str
    logs: tuple[str, ...]
    save: str
    settings: mrfit.settings.ingest.Settings


@dataclass(frozen=True)
class FigureTable:
    """A figure to draw for print."""

    kind: str
    settings: mrfit.settings.figure.Settings


@dataclass(frozen=True)
class ExportTable:
    """A fit to write in formats, with the parameters of a condition, and without some effects."""

    fit: str
    to: tuple[str, ...]
    condition: str
    without: tuple[str, ...]
    settings: mrfit.settings.export.Settings


@dataclass(frozen=True)
class SheetTable:
    """A test sheet of the logs, beside others given as patterns, and whether it is printed, too."""

    against: tuple[str, ...]
    pdf: bool
    settings: mrfit.settings.sheet.Settings


@dataclass(frozen=True)
class PipelineFile:
    """Content of a pipeline file; its paths are relative to its folder, but for ``work``.

    Attributes
    ----------
    work
        Workspace folder.
    plugins
        Plug-in files.
    logs
        Patterns of log files.
    ingest, flux, segment, discover
        Settings of these stages; None where nothing is to be discovered.
    fit
        Settings of the fits.
    report
        Which of them the report shows; all where it names none.
    compare, predict, figure, export
        What is done with the fits.
    sheet
        Test sheet of the logs, without a model.
    """

    work: str
    plugins: tuple[str, ...]
    logs: tuple[str, ...]
    ingest: mrfit.settings.ingest.Settings
    flux: mrfit.settings.flux.Settings
    segment: mrfit.settings.segment.Settings
    fit: tuple[mrfit.settings.fit.Settings, ...]
    discover: mrfit.settings.discover.Settings | None
    report: mrfit.settings.report.Settings
    compare: mrfit.settings.compare.CompareOptions | None = None
    predict: tuple[PredictTable, ...] = ()
    figure: tuple[FigureTable, ...] = ()
    export: tuple[ExportTable, ...] = ()
    sheet: SheetTable | None = None


def read_pipeline(path: Path) -> PipelineFile:
    """Return a pipeline file, validated.

    Raises
    ------
    ConfigError
        If a key is unknown or a value is of the wrong kind; the message names the key and what it takes. If
        ``[report]`` names a fit that the file does not make.
    """
    file: Any = read_tables(path, _WHOLE, "a pipeline file")
    ingest = made_of(mrfit.settings.ingest.Settings, file.ingest)
    fits = tuple(made_of(mrfit.settings.fit.Settings, one) for one in file.fit)
    shown = made_of(mrfit.settings.report.Settings, file.report)
    for name in [s.fit_name for s in fits]:
        if [s.fit_name for s in fits].count(name) > 1:
            raise ConfigError(f"{path}: two [[fit]] would both be named '{name}'; give one of them another name")
    for name in shown.fits:
        if name not in (made := [s.fit_name for s in fits]):
            raise ConfigError(f"{path}: [report] fits: '{name}' is no fit of this file; it makes {', '.join(made)}")
    return PipelineFile(
        work=file.work,
        plugins=tuple(file.plugins),
        logs=tuple(file.ingest.logs),
        ingest=ingest,
        # one resistance for the recordings and their flux linkage
        flux=made_of(mrfit.settings.flux.Settings, file.flux, resistance=ingest.resistance),
        segment=made_of(mrfit.settings.segment.Settings, file.segment),
        fit=fits,
        discover=made_of(mrfit.settings.discover.Settings, file.discover) if file.discover else None,
        report=shown,
        compare=made_of(mrfit.settings.compare.CompareOptions, file.compare) if file.compare else None,
        predict=tuple(
            PredictTable(t.fit, tuple(t.logs), t.save, made_of(mrfit.settings.ingest.Settings, t)) for t in file.predict
        ),
        figure=tuple(FigureTable(t.kind, made_of(mrfit.settings.figure.Settings, t)) for t in file.figure),
        export=tuple(
            ExportTable(t.fit, tuple(t.to), t.condition, tuple(t.without), made_of(mrfit.settings.export.Settings, t))
            for t in file.export
        ),
        sheet=_sheet_of(file.sheet, path.parent) if file.sheet else None,
    )


def _sheet_of(table: Any, folder: Path) -> SheetTable:
    """Return the table ``[sheet]``; its file of limits is relative to the pipeline file's folder."""
    settings = made_of(mrfit.settings.sheet.Settings, table)
    if settings.limits:
        settings = replace(settings, limits=folder / settings.limits)
    return SheetTable(tuple(table.against), table.pdf, settings)
