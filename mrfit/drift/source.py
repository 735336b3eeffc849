"""Values of parameters with their variances and covariates, from tables of batches and from fits in workspaces."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mrfit.batch.fleet import date_of
from mrfit.core.channels import unit_of as channel_unit
from mrfit.core.recording import NAMING
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.fit.predict import read_fit, theta_of
from mrfit.io.schemas.fit import Fit, Result
from mrfit.io.workspace import Workspace
from mrfit.settings.drift import Settings
from mrfit.sheet.measured import unit_of
from mrfit.simulate.current_levels import assembly_of

if TYPE_CHECKING:
    from pandas import DataFrame

# Of a normal distribution: half the 95 % interval over the standard deviation
HALF_INTERVAL = 1.959963984540054
CYCLES_OF_BLOCK = re.compile(r"-cycles(\d+)to(\d+)$")
SECONDS_OF_DAY = 86400.0
FORCE_ENDS = GREATEST_FORCE, LEAST_FORCE = "lambda_max", "lambda_min"
NO_FILE = "no such file; check the path and its spelling"
TEXT_COLUMNS = ("log", "condition", "parameter", "unit", "role", "scale", "warnings")
NUMBERS_OF_TABLE = ("value", "low", "high", "nrmse", "nrmse_holdout", "degrees")
# Samples of a cycle of a stated motion, and cycles of which the last one counts
SAMPLES_OF_CYCLE, CYCLES_OF_MOTION = 256, 3


@dataclass(frozen=True)
class FitValue:
    """A value of one fit.

    Attributes
    ----------
    log, specimen, condition
        Its log, the unit that was tested, and the test condition.
    parameter, unit, role
        What it is of, in which SI unit, and what that does in the model.
    value, variance
        On the scale of the search, with its known variance.
    log_scale
        Whether this is the logarithm.
    covariates
        Of the test, by name.
    doubts
        What is out of date about its fit.
    model
        Its model; empty where that is not stated.
    settable
        Whether it is a parameter of the model, not derived from them.
    """

    log: str
    specimen: str
    condition: str
    parameter: str
    unit: str
    role: str
    value: float
    variance: float
    log_scale: bool
    covariates: Mapping[str, float] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()
    model: str = ""
    settable: bool = False


def read_values(inputs: Sequence[Path], settings: Settings) -> list[FitValue]:
    """Return the values of tables (Parquet, CSV), of workspaces, and of all workspaces below folders.

    Raises
    ------
    ConfigError
        If a pattern or a covariate is wrong.
    DataError
        If there is no fit or table, one cannot be read, or none states its covariance.
    """
    found: list[FitValue] = []
    motion = motion_of(settings.at) if settings.at else None
    for path in inputs:
        if not path.exists():
            raise DataError(f"{path}: {NO_FILE}")
        if motion and not path.is_dir():
            raise ConfigError(f"{path}: --at simulates the fits, which a table does not hold; give their workspaces")
        if path.is_dir():
            found += _of_workspaces(path, settings)
        elif path.suffix.lower() in (".parquet", ".csv"):
            found += values_of_table(read_table(path), str(path))
        else:
            raise DataError(f"{path}: no workspace, and no table that ends in .parquet or .csv")
    if motion and not any(v.parameter == GREATEST_FORCE for v in found):
        raise ConfigError(
            f"--at: no fit is of tests at {motion[2]:g} A; give one of their currents, or fit with --per all"
        )
    return completed(found, settings)


def completed(values: Sequence[FitValue], settings: Settings) -> list[FitValue]:
    """Return values with the names of their units and with covariates from a file and from dates.

    Raises
    ------
    ConfigError
        If no value has a covariate that is asked for.
    DataError
        If there is no value, models differ, no two tests are comparable, or the file of covariates lacks a log.
    """
    if not values:
        raise DataError("no fit here states a covariance; fit again, by `mrfit fit` or `mrfit batch`")
    if len(models := {v.model for v in values} - {""}) > 1:
        raise DataError(f"fits of several models, {', '.join(sorted(models))}; compare those of one")
    stated = _stated(settings.covariates) if settings.covariates else {}
    pooled = set(settings.over) & set(NAMING)
    made = []
    for one in values:
        more = dict(one.covariates)
        date = date_of(one.log)
        if date is not None:
            more.setdefault("date", date / SECONDS_OF_DAY)
        if stated:
            name = next((n for n in (one.log, Path(one.log).name, Path(one.log).stem) if n in stated), None)
            if name is None:
                raise DataError(f"{settings.covariates}: no row of log '{one.log}'")
            more |= stated[name]
        specimen = unit_of(one.log, settings.unit, "--unit") if settings.unit else one.specimen or one.log
        condition = "all" if pooled else one.condition
        made.append(replace(one, specimen=specimen, condition=condition, covariates=more))
    known = {name for one in made for name in one.covariates}
    for name in settings.over:
        if name not in known:
            dates = ", no log has one in its name" * (name == "date")
            named = ", ".join(sorted(known)) or "none"
            raise ConfigError(f"--over {name}: no fit states it{dates}; there are {named}; --covariates adds others")
    if max(Counter((v.condition, v.parameter) for v in made).values()) == 1:
        other = "" if pooled else "; --over current, frequency or amplitude compares conditions with each other"
        raise DataError(f"one fit of every condition: there is nothing to compare it with{other}")
    return made


def read_table(path: Path) -> "DataFrame":
    """Return a table of a batch, or one with its columns.

    Raises
    ------
    DataError
        If it cannot be read.
    """
    import pandas as pd

    try:
        if path.suffix.lower() == ".parquet":
            return pd.read_parquet(path)
        table = pd.read_csv(path)
        texts = [name for name in TEXT_COLUMNS if name in table]
        return table.assign(**{name: table[name].astype(object).where(table[name].notna(), "") for name in texts})
    except FileNotFoundError:
        raise DataError(f"{path}: {NO_FILE}") from None
    except (OSError, ValueError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be read as a table ({error})") from None


def values_of_table(table: "DataFrame", source: str = "table") -> list[FitValue]:
    """Return the values of a table: ``log``, ``parameter``, ``value`` and ``covariance``, or ``low`` and ``high``.

    Raises
    ------
    DataError
        If a column is missing.
    """
    lacking = [name for name in ("log", "parameter", "value") if name not in table]
    if lacking or not ("covariance" in table or {"low", "high"} <= set(table)):
        raise DataError(f"{source}: no column {', '.join(lacking) or 'covariance, nor low and high'}")
    others = [n for n in table.select_dtypes("number") if n not in NUMBERS_OF_TABLE]
    found: list[FitValue] = []
    place: dict[tuple[str, str], int] = {}
    for row in table.to_dict("records"):
        key = str(row["log"]), str(row.get("condition", "") or "")
        place[key] = place.get(key, -1) + 1
        variance = _variance(row, place[key])
        if variance is None:
            continue
        log_scale = row.get("scale") == "log"
        if log_scale and not row["value"] > 0.0:
            raise DataError(f"{source}: {row['parameter']} of {key[0]} is {row['value']}, on a logarithmic scale")
        condition, cycles = condition_of(key[1])
        found.append(
            FitValue(
                *(key[0], "", condition, str(row["parameter"]), str(row.get("unit", "") or "")),
                role=str(row.get("role", "") or ""),
                value=math.log(row["value"]) if log_scale else float(row["value"]),
                variance=variance,
                log_scale=log_scale,
                covariates={**cycles, **{str(n): float(row[n]) for n in others if math.isfinite(row[n])}},
            )
        )
    return found


def _variance(row: Mapping[Any, Any], place: int) -> float | None:
    """Return the known variance of a row of a table on its scale, None where the data leave the value open."""
    covariance = row.get("covariance")
    if isinstance(covariance, (str, list, tuple)):
        covariance = _numbers(covariance, str(row["log"]))
    if isinstance(covariance, np.ndarray) and len(covariance) > place:
        return float(covariance[place]) if math.isfinite(covariance[place]) else None
    low, high = row.get("low", math.nan), row.get("high", math.nan)
    if "covariance" in row or not (math.isfinite(low) and math.isfinite(high)):
        return None
    width = math.log(high / low) if row.get("scale") == "log" else high - low
    return (width / (2.0 * HALF_INTERVAL)) ** 2


def _numbers(written: str | Sequence[object], log: str) -> Array:
    """Return a list of numbers, also as the text that pandas writes into a CSV file of an array or a list."""
    words = re.sub(r"np\.\w+\(|array\(", " ", written) if isinstance(written, str) else written
    split = re.split(r"[\s,()\[\]]+", words) if isinstance(words, str) else words
    try:
        return np.array([math.nan if w in (None, "None", "null") else float(str(w)) for w in split if w != ""])
    except ValueError as error:
        raise DataError(f"{log}: its covariance is no list of numbers ({error})") from None


def condition_of(name: str) -> tuple[str, dict[str, float]]:
    """Return a test condition without the cycles of its block, and these as a covariate."""
    found = CYCLES_OF_BLOCK.search(name)
    if not found:
        return name, {}
    return name[: found.start()], {"cycles": (int(found[1]) - 1 + int(found[2])) / 2.0}


def _of_workspaces(root: Path, settings: Settings) -> Iterator[FitValue]:
    places = sorted({p.parents[2] for p in root.rglob("fits/*/fit.json")})
    if not places:
        raise DataError(f"{root}: no fit in this folder or below it; run `mrfit fit` or `mrfit batch` first")
    for place in places:
        workspace = Workspace(place)
        names = workspace.fit_names()
        name = settings.fit or names[0]
        if len(names) > 1 and not settings.fit:
            raise ConfigError(f"{place}: several fits, {', '.join(names)}; choose one by --fit")
        if name in names:
            label = place.name if place == root else place.relative_to(root).as_posix()
            yield from values_of_fit(read_fit(workspace, name), label, settings.at)


def values_of_fit(fit: Fit, label: str, at: str = "") -> list[FitValue]:
    """Return the values of a fit; of a fit of conditions each is named after its recording.

    Parameters
    ----------
    fit
        The fit.
    label
        What its logs are called where it was fitted to several.
    at
        Motion and current, see ``Settings``; its greatest and least force are values as well.
    """
    found: list[FitValue] = []
    energy: dict[str, float] = {}
    doubts = tuple(f"warning outdated: {fit.name}: {why}" for why in fit.outdated)
    for result in fit.results:
        recordings = sorted({s.id.rpartition("#")[0] for s in result.segments})
        # the workspace of a log in a batch is named after it
        own = len(recordings) == 1 and len(fit.results) > 1 and recordings[0] != Path(label).stem
        log = f"{label}/{recordings[0]}" if own else label
        condition, covariates = condition_of(result.condition)
        covariates |= {n: float(v) for n in NAMING if (v := getattr(result.at, n)) is not None}
        covariates |= _temperature(result)
        work = [p.loop_area for p in result.passivity if p.loop_area is not None]
        cycles = CYCLES_OF_BLOCK.search(result.condition)
        if work and cycles:
            spent = float(np.mean(work)) * (int(cycles[2]) - int(cycles[1]) + 1)
            covariates["energy"] = energy.get(log, 0.0) + spent / 2.0
            energy[log] = energy.get(log, 0.0) + spent
        values = [*_of_covariance(result), *(force_ends(fit, result, at) if at else ())]
        made = [replace(v, log=log, condition=v.condition or condition, covariates=covariates) for v in values]
        own_names = {p.name for p in result.parameters}
        found += [replace(v, doubts=doubts, model=fit.model, settable=v.parameter in own_names) for v in made]
    return found


def _temperature(result: Result) -> dict[str, float]:
    ends = [e for r in result.remainders if (e := r.extents.get("temperature"))]
    return {"temperature": float(np.mean(ends))} if ends else {}


def _of_covariance(result: Result) -> Iterator[FitValue]:
    given = result.covariance
    rows = {q.name: q for q in (*result.parameters, *result.derived)}
    for k, name in enumerate(given.names if given else ()):
        assert given is not None
        value = math.log(rows[name].value) if given.log[k] else float(rows[name].value)
        yield FitValue("", "", "", name, rows[name].unit, given.roles[k], value, given.rows[k][k], given.log[k])


def force_ends(fit: Fit, result: Result, at: str) -> Iterator[FitValue]:
    """Yield the greatest and the least output over a cycle of a stated motion and current, with their variances.

    The variance is that of the output over the refits of the fit: also where no parameter is determined by itself.
    """
    frequency, amplitude, current = motion_of(at)
    assembly, refits = assembly_of(fit), result.refits
    if refits is None or (result.at.current is not None and abs(result.at.current - current) > 1e-2 + 0.03 * current):
        return
    dt = 1.0 / (frequency * SAMPLES_OF_CYCLE)
    phase = 2.0 * np.pi * np.arange(SAMPLES_OF_CYCLE * CYCLES_OF_MOTION) / SAMPLES_OF_CYCLE
    rate = 2.0 * np.pi * frequency
    motion = [np.sin(phase), rate * np.cos(phase), -(rate**2) * np.sin(phase)]
    names = ("displacement", "velocity", "acceleration", "angle", "angular_velocity", "angular_acceleration")
    channels = {n: amplitude * m for n, m in zip(names, 2 * motion, strict=True)}
    known = {n for r in result.remainders for n in r.extents}
    middle = {n: float(np.mean([r.extents[n] for r in result.remainders if n in r.extents])) for n in known}
    channels |= {n: np.full(len(phase), v) for n, v in {**middle, "current": current}.items() if n not in channels}
    lacking = [n for n in assembly.spec.inputs if n not in channels]
    if lacking:
        raise ConfigError(f"--at: {fit.model} needs {', '.join(lacking)} beside a motion and a current")
    theta = np.tile(theta_of(assembly, result), (len(refits.rows) + 1, 1))
    theta[1:, [assembly.spec.names.index(n) for n in refits.names]] = refits.rows
    drive = np.array([channels[n] for n in assembly.spec.inputs])
    outputs = assembly.simulate(drive, theta, dt)[:, -SAMPLES_OF_CYCLE:]
    unit = channel_unit(fit.output)
    turns = {"angle", "angular_velocity"} & {*assembly.spec.inputs}
    place = f"{frequency:g} Hz, {amplitude:g} {'rad' if turns else 'm'}, {current:g} A"
    for name, ends in ((GREATEST_FORCE, outputs.max(axis=1)), (LEAST_FORCE, outputs.min(axis=1))):
        # of refits alone: their mean is not the optimum's
        spread = refits.factor * float(np.var(ends[1:][np.isfinite(ends[1:])]))
        yield FitValue("", "", place, name, unit, "", float(ends[0]), spread, False)


def motion_of(text: str) -> tuple[float, float, float]:
    """Return frequency in Hz, amplitude and current in A of a motion as it is written.

    Raises
    ------
    ConfigError
        If these are not three numbers, the first two above 0.
    """
    try:
        frequency, amplitude, current = map(float, text.split(":"))
    except ValueError:
        frequency = amplitude = current = math.nan
    if not (frequency > 0.0 and amplitude > 0.0 and all(map(math.isfinite, (frequency, amplitude, current)))):
        raise ConfigError(f"--at '{text}': write frequency in Hz, amplitude in m and current in A, as 1:0.01:0.5")
    return frequency, amplitude, current


def _stated(path: Path) -> dict[str, dict[str, float]]:
    """Return the covariates of a file by log."""
    table = read_table(path)
    if "log" not in table:
        raise DataError(f"{path}: no column 'log'")
    names = [str(n) for n in table.select_dtypes("number")]
    return {str(row["log"]): {n: float(row[n]) for n in names} for row in table.to_dict("records")}


def columns_of(values: Sequence[FitValue], names: Sequence[str]) -> Array:
    """Return covariates (N, C) of values, nan where one is not known."""
    return np.array([[v.covariates.get(n, math.nan) for n in names] for v in values]).reshape(len(values), len(names))
