"""Logs in memory: read from files, or made of arrays and of data frames."""

import glob
import html
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

import mrfit.ingest.stage
from mrfit.api.frame_index import index_times, seconds_of
from mrfit.api.options import check_names, settings_of, with_options
from mrfit.core import recording as core
from mrfit.core.arguments import check_arguments, one_line
from mrfit.core.channels import CHANNELS, MOTION, unit_of
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.ingest.build import LogOrigin, build
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.table import Column, Table
from mrfit.ingest.text.layout import is_called_time, name_and_unit
from mrfit.io.bars import Heard, shown
from mrfit.io.escapes import visible
from mrfit.io.workspace import recording_id

if TYPE_CHECKING:
    from pandas import DataFrame

    from mrfit.report.picture import Picture

PathText = str | PathLike[str]


class Recording(core.Recording):
    """One log on a uniform time base, in SI units.

    Made by ``mrfit.read``, ``Recording.from_arrays`` or ``Recording.from_frame``.

    Examples
    --------
    >>> import mrfit, numpy as np
    >>> time = np.arange(2000) / 1000
    >>> stroke = 10 * np.sin(2 * np.pi * 2 * time)
    >>> log = mrfit.Recording.from_arrays(
    ...     dt=1e-3, displacement=stroke, force=50 * stroke, units={"displacement": "mm"}, condition={"current": 1.5}
    ... )
    >>> log
    <Recording 'recording': 2000 samples of 0.001 s; displacement (m), force (N); current 1.5>
    >>> round(float(log.channels["displacement"].max()), 6)
    0.01
    """

    __slots__ = ()

    def plot(self) -> "Picture":
        """Draw the log as recorded: channels over time with cuts and warnings, and loops."""
        from mrfit.sheet.signals import draw, signals_of

        return draw(signals_of(self))

    @classmethod
    @check_arguments
    def from_arrays(
        cls,
        *,
        dt: float,
        units: Mapping[str, str] | None = None,
        condition: Mapping[str, float] | None = None,
        name: str = "recording",
        **channels: ArrayLike,
    ) -> Self:
        """Return a recording of equally long arrays, one argument a channel.

        Parameters
        ----------
        dt
            Sample interval in s.
        units
            Channel -> unit of its numbers; default: SI.
        condition
            What is known of the test, in SI: ``current``, ``temperature``, ``resistance``, ``frequency`` …
        name
            Name of the log.
        **channels
            Arrays of shape (N,), as ``displacement``, ``velocity``, ``force``, ``current``, ``voltage``, ``flux``.

        Raises
        ------
        ConfigError
            If a unit is given for no channel.
        DataError
            If the arrays do not make a log: of different lengths, no numbers, or with long gaps. An unknown unit is a
            finding.
        """
        columns = {n: (_values(name, n, v), unit) for n, v, unit in _with_units(channels, units, name)}
        return cls._of_columns(columns, _Test(name, dt, condition or {}, "arrays"))

    @classmethod
    @check_arguments
    def from_frame(
        cls,
        frame: "DataFrame",
        *,
        dt: float | None = None,
        time: str | None = None,
        units: Mapping[str, str] | None = None,
        condition: Mapping[str, float] | None = None,
        name: str | None = None,
    ) -> Self:
        """Return a recording of a data frame, one column a channel.

        Parameters
        ----------
        frame
            Columns are named as in a log: ``force``, ``Load (kN)``, ``x``. A column ``time`` or ``t`` gives the
            times in s.
        dt
            Sample interval in s; None where the frame has a column of times, or an index of times. An index of times
            or of sample numbers beside it must agree; what the numbers leave out is missing.
        time
            Name of the column of times; None finds it.
        units
            Column -> unit of its numbers; default: that in the column's name, else SI. Columns of one letter without a
            unit, as ``x``, ``v``, ``F``, are the channel of this symbol in SI; a finding says so.
        condition
            What is known of the test, in SI: ``current``, ``temperature``, ``resistance``, ``frequency`` …
        name
            Name of the log; default: ``frame.attrs["name"]``, else its condition, as ``current-0.5``.

        Raises
        ------
        ConfigError
            If there is neither a sample interval nor a column of times, or a unit or ``time`` names no column.
        DataError
            If the frame does not make a log: no numbers, or with long gaps. An unknown unit is a finding.

        Examples
        --------
        >>> import mrfit, numpy as np, pandas as pd
        >>> frame = pd.DataFrame({"time": np.arange(500) / 100, "Load (kN)": np.ones(500), "x": np.zeros(500)})
        >>> mrfit.Recording.from_frame(frame, units={"x": "mm"}).channels["force"][0]
        np.float64(1000.0)
        """
        name = name or str(frame.attrs.get("name") or "") or _name_by(condition or {})
        named = {str(column): frame[column].to_numpy() for column in frame.columns}
        if len(named) < len(frame.columns):
            raise DataError(f"{name}: two columns have one name; rename one of them")
        columns = {n: (_values(name, n, v), unit) for n, v, unit in _with_units(named, units, name)}
        timed = [n for n, (_, unit) in columns.items() if _is_time(n, unit)]
        if time is not None:
            if time not in columns:
                raise ConfigError(f"{name}: time = '{time}' is no column; there are {', '.join(columns)}")
            values, unit = columns.pop(time)
            columns = {"time": (values, unit or "s"), **{n: c for n, c in columns.items() if n not in timed}}
        elif not timed and (times := index_times(frame.index, dt, name)) is not None:
            columns = {"time": (times, "s"), **columns}
        columns, said = _by_symbol(columns)
        if others := [n for n in timed if time not in (None, n)]:
            left_out = ", ".join(map(repr, others))
            text = f"{left_out}: called as times are beside '{time}', and left out; units={{…}} tells what they are"
            said.append(core.Finding("not-read", "", None, text))
        made = cls._of_columns(columns, _Test(name, dt, condition or {}, "frame"))
        return replace(made, findings=(*made.findings, *said))

    @classmethod
    def _of_columns(cls, columns: Mapping[str, tuple[Array, str | None]], test: "_Test") -> Self:
        dt = None if test.dt is None else _number(test.name, "dt", test.dt, "seconds above 0")
        if dt is not None and dt <= 0.0:
            raise ConfigError(f"{test.name}: dt {dt} is no sample interval; give seconds above 0")
        lengths = {n: len(v) for n, (v, _) in columns.items()}
        if len(set(lengths.values())) > 1:
            raise DataError(f"{test.name}: channels of different lengths: {_listed(lengths)}; cut them to one length")
        made = [Column(name_and_unit(n)[0], unit, values, k) for k, (n, (values, unit)) in enumerate(columns.items())]
        clock = next((c for c in made if _is_time(c.name, c.unit)), None)
        table = Table(
            tuple(c for c in made if c is not clock),
            np.arange(1, 1 + max(lengths.values(), default=0), dtype=np.int64),
            time=clock,
            dt=dt,
            condition={str(k): _number(test.name, f"the condition '{k}'", v) for k, v in test.condition.items()},
        )
        found = build(table, LogOrigin(test.name, "", test.reader, Rules(believed=test.reader == "arrays")))
        if len(found) > 1:
            raise DataError(
                f"{test.name}: its samples have gaps and make {len(found)} stretches; fill the gaps, or make a "
                "recording of each stretch"
            )
        return cls._of(replace(found[0], id=recording_id(Path(f"{test.name}.x"), set())))

    @classmethod
    def _of(cls, recording: core.Recording) -> Self:
        return cls(**{f.name: getattr(recording, f.name) for f in fields(recording)})

    def to_frame(self) -> "DataFrame":
        """Return the channels in SI units over time in s."""
        from pandas import DataFrame, Index

        return DataFrame(dict(self.channels), index=Index(np.arange(self.samples) * self.dt, name="time"))

    def __repr__(self) -> str:
        units = (f"{n} ({self.units[n]})" if self.units.get(n) else n for n in self.channels)
        condition = ", ".join(f"{k} {v:.4g}" for k, v in self.condition.items() if not k.startswith("measured_"))
        text = f"{self.samples} samples of {self.dt:.6g} s; {', '.join(units)}" + (
            f"; {condition}" if condition else ""
        )
        return visible(f"<Recording '{self.id}': {text}>")

    def _repr_html_(self) -> str:
        findings = "".join(f"<li>{html.escape(visible(f.text))}</li>" for f in self.findings)
        return f"<p>{html.escape(repr(self))}</p>" + (f"<ul>{findings}</ul>" if findings else "")


@dataclass(frozen=True, slots=True)
class _Test:
    """Properties of a log beside its columns."""

    name: str
    dt: float | None
    condition: Mapping[str, float]
    reader: str


def _name_by(condition: Mapping[str, float]) -> str:
    """Return a name of a log that has none: its condition, in which the logs of a campaign differ."""
    return "-".join(f"{n}-{v:g}" for n, v in condition.items() if isinstance(v, Real)) or "recording"


def _by_symbol(
    columns: Mapping[str, tuple[Array, str | None]],
) -> tuple[dict[str, tuple[Array, str | None]], list[core.Finding]]:
    """Return columns of one letter without a unit as the channels of these symbols in SI, and what was taken so.

    A letter of several channels is that of the motion where there is another channel of a motion.
    """
    meant = {
        n: [c for c in CHANNELS.values() if n in (c.symbol, c.symbol.upper()) or n.lower() in c.aliases]
        for n in columns
    }
    of_motion = {c for output, moved in MOTION.items() for c in (output, *moved)}
    moving = any(c.name in of_motion for n, found in meant.items() if n != "v" for c in found) or bool(
        of_motion & set(columns)
    )
    found: dict[str, tuple[Array, str | None]] = {}
    said = []
    for n, (values, unit) in columns.items():
        among = [c for c in meant[n] if c.name not in columns and c.name not in found]
        if len(among) > 1:
            among = [c for c in among if (c.name in of_motion) == moving]
        if unit is not None or len(n) > 1 or _is_time(n, unit) or len(among) != 1:
            found[n] = values, unit
            continue
        (channel,) = among
        found[channel.name] = values, channel.unit
        text = f"'{n}' has no unit: taken as {channel.name} in {channel.unit}; units={{'{n}': …}} says another"
        said.append(core.Finding("unit-assumed", channel.name, None, text))
    return found, said


def _listed(lengths: Mapping[str, int]) -> str:
    return ", ".join(f"{n} {length}" for n, length in lengths.items())


def _is_time(column: str, unit: str | None) -> bool:
    """Return whether a column is called as times are."""
    return is_called_time(name_and_unit(column)[0], unit)


def _with_units(
    columns: Mapping[str, ArrayLike], units: Mapping[str, str] | None, name: str
) -> list[tuple[str, ArrayLike, str | None]]:
    """Return (name, values, unit) of the columns; SI where a channel is called by its own name and nothing is said."""
    given = dict(units or {})
    for column in given:
        if column not in columns:
            raise ConfigError(f"{name}: units name '{column}', which is no column; there are {', '.join(columns)}")
    own = {n: unit_of(n) for n in columns if n in CHANNELS} | {n: "s" for n in columns if n.lower() == "time"}
    return [(n, v, given.get(n, name_and_unit(n)[1] or own.get(n))) for n, v in columns.items()]


def _number(log: str, what: str, value: float, give: str = "a number in SI units, or leave it out") -> float:
    if not np.isfinite(number := float(value)):
        raise ConfigError(f"{log}: {what} is {one_line(value)}, which is no finite number; give {give}")
    return number


def _values(log: str, column: str, values: ArrayLike) -> Array:
    """Return numbers, nan where they are masked or missing."""
    try:
        given = np.ma.asanyarray(values) if np.ma.isMaskedArray(values) else np.asarray(values)
    except ValueError as error:
        raise DataError(f"{log}: '{column}' is no array ({error}); give one row of samples, shape (N,)") from None
    if given.dtype.kind in "mM" and given.ndim:
        given = seconds_of(np.asarray(given))
    if given.dtype.kind == "O":  # pandas has a missing value of its own
        given = np.array([np.nan if type(v).__name__ in ("NAType", "NaTType") else v for v in given.ravel()])
        given = given.reshape(np.shape(values))
    if given.dtype.kind == "c":
        raise DataError(f"{log}: '{column}' holds complex numbers; give their real part or their magnitude")
    try:
        numbers = np.array(np.ma.filled(given.astype(np.float64), np.nan), dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise DataError(f"{log}: '{column}' holds what is no number ({error}); convert or leave it out") from None
    if numbers.ndim != 1:
        raise DataError(f"{log}: '{column}' has the shape {numbers.shape}; give one row of samples, shape (N,)")
    return numbers


@check_arguments
def read(
    paths: PathText | Iterable[PathText],
    map: PathText | None = None,
    *,
    jobs: int = 1,
    progress: Heard = True,
    **options: object,
) -> list[Recording]:
    """Read logs, as ``mrfit ingest`` does, into memory.

    A file that cannot be read is left out with a warning; what is odd about a log is in its ``findings``.

    Parameters
    ----------
    paths
        Files, folders or patterns as ``logs/*.csv``; one, or several.
    map
        Channel map (TOML); None looks for ``mrfit.toml`` beside each log.
    jobs
        Files read at the same time.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.
    **options
        Those of ``mrfit ingest``, see below: ``pattern``, conditions in file names, as
        ``{frequency:Hz}Hz-{current:A}A``; ``resistance``, the coil's in Ω, of all logs.

    Raises
    ------
    ConfigError
        If a pattern matches nothing, an option or the channel map is wrong.
    DataError
        If no file can be read.
    """
    wanted = [paths] if isinstance(paths, (str, PathLike)) else list(paths)
    kind = mrfit.ingest.stage.Settings
    check_names((kind,), options)
    settings = settings_of(kind, {**options, "map": map, "jobs": jobs})
    with shown(progress) as told:
        logs = mrfit.ingest.stage.read([f for p in wanted for f in _matching(p)], settings, told)
    for refusal in logs.refusals:
        warnings.warn(f"left out {refusal}", stacklevel=2)
    return [Recording._of(r) for r in logs.recordings]


with_options(read, (mrfit.ingest.stage.Settings,), ())


def _matching(path: PathText) -> list[Path]:
    text = str(path)
    # a name may hold what means something to glob
    if Path(path).exists() or not glob.has_magic(text):
        return [Path(path)]
    found = sorted(glob.glob(text, recursive=True))
    if not found:
        raise ConfigError(f"'{text}' matches nothing; check the folder and the ending")
    return [Path(f) for f in found]


def several(recordings: core.Recording | Iterable[core.Recording]) -> list[core.Recording]:
    """Return recordings as a list sorted by id, every id once.

    Raises
    ------
    ConfigError
        If there are none, or something is no recording.
    """
    given: Sequence[object] = [recordings] if isinstance(recordings, core.Recording) else list(recordings)
    if not given:
        raise ConfigError("there are no recordings; give some of mrfit.read or mrfit.Recording.from_frame")
    taken: set[str] = set()
    found = []
    for one in given:
        if not isinstance(one, core.Recording):
            kind = type(one).__name__
            raise ConfigError(f"a {kind} is no recording; make one by mrfit.read or mrfit.Recording.from_frame")
        found.append(replace(one, id=recording_id(Path(f"{one.id}.x"), taken)))
    return sorted(found, key=lambda r: r.id)
