"""Test conditions from header, channel map and file name, checked against what the data say."""

import re
from collections.abc import Collection, Mapping
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from mrfit.core.channels import CHANNELS, EXCITATIONS, POSITIONS, unit_of
from mrfit.core.counting import number_of
from mrfit.core.recording import NAMING, Finding, Recording
from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.refusal import Refusal

NAMED_NUMBER = r"(?:(?<![^\W_)\]])[-+])?\d+(?:[.,xp]\d+)?"
"""A number in a file's name; a hyphen right after a letter, a digit or a bracket parts two words and is no sign."""
SLOT = re.compile(r"\{([a-z_]+)(?::([^{}]*))?\}")
DRIVES = ("displacement", "angle", "current", "velocity", "voltage", "flux")
NAMING_UNITS = ("Hz", "m", "rad", "A", "m/s", "rad/s")
DISAGREE = 0.1
"""Relative difference between the stated and the measured condition that is worth saying."""
WORTH_SHOWING = 0.005
"""Relative difference from which the measured condition is shown beside the stated one."""
MEASURED_PREFIX = "measured_"
SHOWN_UNITS = {"m": ("mm", 1e3), "degC": ("°C", 1.0), "ohm": ("Ω", 1.0)}
"""What people write for an SI unit, and the factor."""


def conditions_of(
    record: Recording, number: int, runs: int, stated: Mapping[str, float], rules: Rules
) -> tuple[dict[str, float], list[Finding]]:
    """Return the condition of a recording and where name and data disagree.

    What the data say is kept beside it under ``measured_frequency``, ``measured_amplitude``, ``measured_current``.
    """
    condition = dict(stated)
    findings: list[Finding] = []
    if rules.pattern:
        found = from_name(Path(record.source).stem, rules.pattern)
        if not found:
            text = f"the name does not follow the pattern '{rules.pattern}': no condition is known from it"
            findings.append(Finding("condition-unknown", "", None, text))
        condition |= found
    condition |= _from_map(record, number, runs, rules)
    findings += [Finding("condition-unknown", "", None, text) for text in filter(None, map(_misspelt, condition))]
    if rules.resistance is not None:
        condition["resistance"] = rules.resistance
    measured = _measured(record, condition)
    for key, value in measured.items():
        condition[MEASURED_PREFIX + key] = value
        if abs(value - condition[key]) > DISAGREE * max(abs(condition[key]), 1e-12):
            stated_as, measured_as = (_with_unit(key, v, record.channels) for v in (condition[key], value))
            text = f"the stated {key} is {stated_as} but the data say {measured_as}: both are kept"
            findings.append(Finding("condition-differs", _drive(record), None, text))
    return condition, findings


def _misspelt(key: str) -> str:
    """Return words on a key that is nearly a known one; none on another, as on ``gap`` or ``temperature_2``."""
    known = [*NAMING, *CHANNELS]
    near = [] if key.startswith(tuple(known)) else get_close_matches(key, known, n=1, cutoff=0.8)
    return f"the condition '{key}' is not known and is kept as a label; did you mean '{near[0]}'?" if near else ""


def condition_words(condition: Mapping[str, float], channels: Collection[str]) -> str:
    """Return a condition in one line with units; what the data say stands behind what is stated where they differ.

    Parameters
    ----------
    condition
        Values by key, SI.
    channels
        Names of the recording's channels, which say what an amplitude is.
    """
    said = []
    for key, value in condition.items():
        if not key.startswith(MEASURED_PREFIX):
            found = condition.get(MEASURED_PREFIX + key, value)
            differs = abs(found - value) > WORTH_SHOWING * abs(value)
            more = f" (measured {_with_unit(key, found, channels)})" if differs else ""
            said.append(f"{key} {_with_unit(key, value, channels)}{more}")
    return ", ".join(said)


def _with_unit(key: str, value: float, channels: Collection[str]) -> str:
    quantity = next((d for d in DRIVES if d in channels), "") if key == "amplitude" else key
    unit = "Hz" if key == "frequency" else unit_of(quantity)
    shown, factor = SHOWN_UNITS.get(unit, (unit, 1.0))
    return f"{factor * value:.4g} {shown}".strip()


def name_expression(pattern: str) -> tuple[re.Pattern[str], dict[str, str]]:
    """Return the regular expression of a name pattern and the unit of each of its keys.

    Raises
    ------
    ConfigError
        If the pattern holds no ``{key:unit}``, one key twice, an unknown or unfit unit, or stray braces.
    """
    example = "as in '{amplitude:mm}mm{frequency:Hz}Hz{current:A}A'"
    key_units: dict[str, str] = {}
    expression, position = "", 0
    for slot in SLOT.finditer(pattern):
        key, unit = slot[1], slot[2] or "1"
        if key in key_units:
            raise ConfigError(f"name pattern '{pattern}': {key} occurs twice; write each key once, {example}")
        if not units.known(unit):
            raise ConfigError(f"name pattern '{pattern}': unknown unit '{unit}'; correct it, {example}")
        wanted = "Hz" if key == "frequency" else unit_of(key)
        if slot[2] and wanted and units.to_si(unit).unit != wanted:
            raise ConfigError(f"name pattern '{pattern}': {key} cannot be in '{unit}'; write a unit such as {wanted}")
        expression += _literal(pattern[position : slot.start()]) + f"(?P<{key}>{NAMED_NUMBER})"
        key_units[key], position = unit, slot.end()
    if not key_units:
        raise ConfigError(f"name pattern '{pattern}' names no condition; write keys in braces, {example}")
    if {"{", "}"} & set(SLOT.sub("", pattern)):
        raise ConfigError(f"name pattern '{pattern}': a brace opens no key in small letters; correct it, {example}")
    return re.compile(expression + _literal(pattern[position:]), re.IGNORECASE), key_units


def _literal(text: str) -> str:
    return ".*?".join(re.escape(part) for part in text.split("*"))


def from_name(stem: str, pattern: str) -> dict[str, float]:
    """Return the conditions in a file's name, in SI; empty if it does not follow the pattern."""
    found = {}
    for key, (value, unit) in _as_written(stem, pattern).items():
        conversion = units.to_si(unit)
        found[key] = conversion.scale * value + conversion.offset
    return found


def _as_written(stem: str, pattern: str) -> dict[str, tuple[float, str]]:
    expression, key_units = name_expression(pattern)
    match = expression.fullmatch(stem) or expression.search(stem)
    if match is None:
        return {}
    return {key: (float(re.sub("[xpXP,]", ".", match[key])), unit) for key, unit in key_units.items()}


def wording(stem: str, rules: Rules) -> dict[str, str]:
    """Return the wording, in the name of a test condition, of what a file's name states with a unit beside ``NAMING``.

    A unit that may be taken for another quantity's is preceded by the key: ``5bar``, but ``gap2mm``.
    """
    found = _as_written(stem, rules.pattern) if rules.pattern else {}
    kinds = [*NAMING_UNITS, *(units.to_si(u).unit for k, (_, u) in found.items() if k not in NAMING)]
    said = {}
    for key, (value, unit) in found.items():
        if unit != "1" and key not in NAMING and key not in rules.condition:
            alone = kinds.count(units.to_si(unit).unit) == 1
            shown = re.sub(r"\W", "", units.spelled(unit).replace("/", "p"))
            said[key] = f"{'' if alone else key}{value:.6g}{shown}"
    return said


def _from_map(record: Recording, number: int, runs: int, rules: Rules) -> dict[str, float]:
    chosen = {}
    for key, value in rules.condition.items():
        if not isinstance(value, list):
            chosen[key] = value
        elif len(value) == runs:
            chosen[key] = value[number]
        else:
            raise Refusal(
                record.source,
                f"the file holds {number_of('run', runs)} but condition.{key} lists {number_of('value', len(value))}",
                f"give one for each run in {rules.where}",
            )
    return chosen


def _drive(record: Recording) -> str:
    # a motion that an excitation makes is no drive
    excited = set(EXCITATIONS.values()) & set(record.channels)
    return next((d for d in DRIVES if d in record.channels), "") if not excited else ""


def _measured(record: Recording, condition: Mapping[str, float]) -> dict[str, float]:
    """Return findings on those stated conditions that the data can be asked about."""
    drive = _drive(record)
    measured = {}
    if drive and record.samples >= 16 and "frequency" in condition:
        measured["frequency"] = main_frequency(record.channels[drive], record.dt)
    if drive and record.samples >= 16 and "amplitude" in condition:
        low, high = np.percentile(record.channels[drive], [0.5, 99.5])
        measured["amplitude"] = float(high - low) / 2.0
    if "current" in condition and drive in POSITIONS and "current" in record.channels:
        measured["current"] = float(np.mean(record.channels["current"]))
    return measured


def main_frequency(values: Array, dt: float) -> float:
    """Return the frequency in Hz of the strongest line of a signal, refined between the lines of its spectrum."""
    centred = values - values.mean()
    size = 4 * len(values)
    power = np.abs(np.fft.rfft(centred * np.hanning(len(values)), size))
    k = int(np.argmax(power[1:-1])) + 1
    left, peak, right = power[k - 1], power[k], power[k + 1]
    bend = left - 2.0 * peak + right
    shift = 0.5 * (left - right) / bend if bend else 0.0
    return float((k + shift) / (size * dt))
