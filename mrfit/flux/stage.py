"""The flux stage: recordings with coil voltage and current in, the same with flux linkage out.

λ(t) = λ0 + ∫(u − R·i) dt, with λ0 and the drift removed over whole cycles.
Source: Tang, Bankosz and Goldasz, "Reconstructing Magnetic Hysteresis Behavior with Flux Model", eq. 3.
"""

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace

import numpy as np

from mrfit.core.channels import MOTION, unit_of
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import FLUX_RESISTANCE, Recording
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.flux import losses
from mrfit.flux.channel import InMemory, SampleSource, channel_of
from mrfit.flux.integral import IntegralDrift, drift_removed, integral_on_disk, integrate
from mrfit.flux.plateau import resistance_of_plateaus, steady_blocks
from mrfit.io.atomic import accessing
from mrfit.io.columns import extent, is_on_disk, part_of
from mrfit.io.keys import code_version, file_digest, flux_key
from mrfit.io.schemas.reading import reusable
from mrfit.io.schemas.stages import FluxFile, FluxRow, FluxSettings, LoopRow, SeparationRow
from mrfit.io.workspace import Workspace, checked, write_json
from mrfit.settings.flux import DRIFTS, RULES
from mrfit.settings.flux import Settings as Settings
from mrfit.signal.cycles import SteadyCycles, steady_stretches
from mrfit.signal.harmonics import series_at
from mrfit.signal.long_cycles import stretches_of
from mrfit.signal.thinning import thinned

STAGE = "flux"
INTEGRATED, PASSED = "integrated", "passed through"
NO_FLUX = "no flux linkage, which a damper does not need"


@dataclass(frozen=True, slots=True)
class _Resistance:
    """Coil resistance with its standard error in Ω (0 where it was given) and where it came from."""

    value: float
    error: float
    source: str


_NO_RESISTANCE = (
    "the coil resistance cannot be estimated: it needs steady cycles at three frequencies, of one amplitude or of "
    f"{losses.NEEDED_LOOPS} loops, or a steady direct current (at one frequency an error δR adds −δR·∮i²dt to the "
    "loop's area, just as hysteresis does); give it with --resistance OHM, or log more frequencies"
)


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> FluxFile:
    """Reconstruct flux linkage where coil voltage and current were logged, and write ``flux/`` and flux.json.

    Recordings with a measured flux keep it; those and the ones without voltage and current are not copied: later stages
    read them where ingest left them.

    Parameters
    ----------
    workspace
        Holds the recordings; on an error it is left as it was.
    settings
        Resistance, drift and integration rule.
    progress
        Reports every recording.

    Returns
    -------
    FluxFile
        Content of flux.json, and whether it was there already.

    Raises
    ------
    ConfigError
        If a setting is wrong or a resistance is not positive.
    DataError
        If nothing has been ingested, or the resistance cannot be found.
    """
    _check(settings)
    identifiers = workspace.identifiers
    key = flux_key(asdict(settings), workspace.contents(identifiers))
    existing = reusable(workspace.flux_json, FluxFile)
    if existing and existing.key == key and _complete(workspace, existing):
        return replace(existing, skipped=True)
    with workspace.scratching():
        analysed = [_analyse(workspace.read_recording(i, streamed=True), settings) for i in identifiers]
    resistances = _resistances(analysed, settings)
    with _replacing(workspace) as staging:
        rows = []
        for done, found in enumerate(analysed):
            rows.append(_write(workspace, staging, found, resistances.get(found.identifier), settings))
            progress("flux", done + 1, len(analysed))
        files = {r.id: file_digest(workspace.recording_file(r.id, staging)) for r in rows if r.action == INTEGRATED}
        summary = checked(replace(_summary(settings, key, rows, analysed, resistances), files=files))
    write_json(workspace.flux_json, summary)
    return summary


def _complete(workspace: Workspace, existing: FluxFile) -> bool:
    """Return whether every recording that was changed is there."""
    changed = [r.id for r in existing.recordings if r.action == INTEGRATED]
    return all(workspace.recording_file(i, STAGE).is_file() and workspace.is_whole(i, STAGE) for i in changed)


def reconstruct(recordings: Sequence[Recording], settings: Settings) -> tuple[list[Recording], float | None]:
    """Return recordings in memory with flux linkage, as ``run`` makes it of those of a workspace.

    Parameters
    ----------
    recordings
        The recordings; their ids are unique.
    settings
        Resistance, drift and integration rule.

    Returns
    -------
    tuple
        The recordings, and the coil resistance in Ω (the median, if they differ), None where nothing was integrated.

    Raises
    ------
    ConfigError
        If a setting is wrong or a resistance is not positive.
    DataError
        If the resistance cannot be found.
    """
    _check(settings)
    analysed = [_analyse(r, settings) for r in recordings]
    found = _resistances(analysed, settings)
    made_of = zip(recordings, analysed, strict=True)
    changed = [_integrated(r, a, found[r.id], settings)[0] if r.id in found else r for r, a in made_of]
    return changed, float(np.median([r.value for r in found.values()])) if found else None


def last_settings(workspace: Workspace) -> Settings:
    """Return the settings of the workspace's last flux run, or the defaults."""
    stored = workspace.flux_file()
    return Settings(**asdict(stored.settings)) if stored else Settings()


def last_resistance(workspace: Workspace) -> float | None:
    """Return the coil resistance in Ω of the workspace's last flux run (the median, if recordings differ), or None."""
    stored = workspace.flux_file()
    return stored.resistance if stored else None


def to_predict(settings: Settings, found: float | None, given: float | str | None) -> Settings:
    """Return the settings for logs that are predicted by a fit.

    Parameters
    ----------
    settings
        Those of the fit's own logs: a resistance that was given there holds for the others too.
    found
        Resistance in Ω that was found there, used where the logs state none.
    given
        Resistance for these logs, or None.
    """
    if given is not None:
        return replace(settings, resistance=given)
    if settings.resistance == "auto":
        settings = replace(settings, resistance=None)
    return replace(settings, fallback=found)


def _check(settings: Settings) -> None:
    for name, choice, known in (("drift", settings.drift, DRIFTS), ("rule", settings.rule, RULES)):
        if choice not in known:
            raise ConfigError(f"flux {name} '{choice}' is unknown; choose one of {', '.join(known)}")
    for value in (settings.resistance, settings.fallback):
        if value is not None and value != "auto":
            _positive(value, "--resistance")


def _positive(value: object, where: str) -> float:
    try:
        ohms = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{where}: '{value}' is no resistance; give ohms above 0, or auto") from error
    if not (np.isfinite(ohms) and ohms > 0.0):
        raise ConfigError(f"{where}: coil resistance {ohms:g} Ω is not positive; give the coil's ohms, or auto")
    return ohms


@dataclass(frozen=True, slots=True)
class _CoilAnalysis:
    """Properties of a recording that need no resistance: its treatment, its steady cycles and loops.

    ``is_of_damper``: a force or torque was logged too, and a fit of that needs no flux.
    """

    identifier: str
    source: str
    action: str
    own_resistance: float | None
    stretches: tuple[SteadyCycles, ...]
    loops: tuple[losses.LoopEnergy, ...]
    blocks: Array
    peak: float
    is_of_damper: bool = False


def _analyse(recording: Recording, settings: Settings) -> _CoilAnalysis:
    channels = recording.channels
    nothing = (recording.id, recording.source)
    empty = np.empty((0, 2))
    if "flux" in channels:
        return _CoilAnalysis(*nothing, "measured flux kept", None, (), (), empty, 0.0)
    if not {"voltage", "current"} <= set(channels):
        return _CoilAnalysis(*nothing, PASSED, None, (), (), empty, 0.0)
    own = recording.condition.get("resistance")
    if own is not None and settings.resistance is None:
        own = _positive(own, recording.source)
    voltage, current = channels["voltage"], channels["current"]
    stretches = tuple(_stretches(recording))
    loops = tuple(losses.loop_of(voltage, current, recording.dt, s, recording.id) for s in stretches)
    blocks = steady_blocks(voltage, current) if not stretches else empty
    peak = max(map(abs, extent(current))) if not stretches else 0.0
    of_damper = not MOTION.keys().isdisjoint(channels)
    return _CoilAnalysis(*nothing, INTEGRATED, own, stretches, loops, blocks, peak, of_damper)


def _stretches(recording: Recording) -> list[SteadyCycles]:
    """Return the steady cycles of the current; of one that stays on disk they are found on means over neighbours."""
    current = recording.channels["current"]
    if not is_on_disk(current):
        return steady_stretches(current, recording.dt)
    means, step = thinned(replace(recording, channels={"current": current}), "current")
    found = []
    for one in stretches_of(means.channels["current"], means.dt):
        start, stop = step * one.start, step * one.stop
        series = series_at(part_of(current, start, stop), recording.dt, one.fit.frequency)
        found.append(SteadyCycles(start, stop, series, one.cycles))
    return found


def _resistances(analysed: list[_CoilAnalysis], settings: Settings) -> dict[str, _Resistance]:
    """Return the resistance of every recording that is integrated: as set, its own, the fallback or estimated.

    Logs of a damper of which none of these tells it are not integrated.
    """
    wanted = [a for a in analysed if a.action == INTEGRATED]
    given, fallback = settings.resistance, settings.fallback
    if isinstance(given, (int, float)):
        return {a.identifier: _Resistance(float(given), 0.0, "given") for a in wanted}
    found = {
        a.identifier: _Resistance(a.own_resistance, 0.0, "recording's condition")
        for a in wanted
        if a.own_resistance is not None and given is None
    }
    if fallback is not None and given is None:
        rest = _Resistance(float(fallback), 0.0, "fallback")
    elif len(found) == len(wanted):
        return found
    elif (estimate := _estimated(wanted)) is not None:
        rest = estimate
    elif all(a.is_of_damper or a.identifier in found for a in wanted):
        return found
    else:
        raise DataError(f"{wanted[0].source}: {_NO_RESISTANCE}")
    return {a.identifier: found.get(a.identifier, rest) for a in wanted}


def _estimated(wanted: list[_CoilAnalysis]) -> _Resistance | None:
    by_frequency = losses.estimate_resistance([loop for a in wanted for loop in a.loops])
    if by_frequency is not None and by_frequency[0] > 0.0:
        value, error = by_frequency
        return _Resistance(value, error, "estimated from energy per cycle over frequency")
    peak = max((a.peak for a in wanted), default=0.0)
    by_plateau = resistance_of_plateaus([a.blocks for a in wanted], peak)
    if by_plateau is not None and by_plateau[0] > 0.0:
        value, error, how = by_plateau
        return _Resistance(value, error, f"estimated from {how}")
    return None


@contextmanager
def _replacing(workspace: Workspace) -> Iterator[str]:
    """Yield a stage folder to write to, which takes the place of the old one if all goes well.

    The summary loses its key first: after a kill between the two the stage is run again, with the settings it holds.
    """
    for stale in workspace.root.glob(f".{STAGE}-*"):
        if stale.name.removeprefix(f".{STAGE}-").isdecimal():
            shutil.rmtree(stale, ignore_errors=True)
    staging = f".{STAGE}-{os.getpid()}"
    folder, target = workspace.root / staging, workspace.root / STAGE
    try:
        # it stays empty where no recording is changed
        with accessing(folder):
            folder.mkdir()
        yield staging
        with accessing(target):
            if existing := reusable(workspace.flux_json, FluxFile):
                write_json(workspace.flux_json, replace(existing, key=""))
            shutil.rmtree(target, ignore_errors=True)
            folder.replace(target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _write(
    workspace: Workspace, staging: str, found: _CoilAnalysis, resistance: _Resistance | None, settings: Settings
) -> FluxRow:
    if resistance is None:
        return FluxRow(id=found.identifier, action=PASSED if found.action == INTEGRATED else found.action)
    recording = workspace.read_recording(found.identifier, streamed=True)
    changed, drift = _integrated(recording, found, resistance, settings)
    workspace.write_recording(changed, staging)
    return _row(found, resistance, drift)


def _integrated(
    recording: Recording, found: _CoilAnalysis, resistance: _Resistance, settings: Settings
) -> tuple[Recording, IntegralDrift]:
    """Return a recording with its flux linkage, and the drift that was removed from it."""
    voltage, current = recording.channels["voltage"], recording.channels["current"]
    integral = _integral(voltage, current, resistance.value, recording.dt, settings.rule)
    flux, drift = drift_removed(integral, channel_of(current), recording.dt, found.stretches, settings.drift)
    changed = replace(
        recording,
        channels={**recording.channels, "flux": flux.array},
        units={**recording.units, "flux": unit_of("flux")},
        condition={**recording.condition, FLUX_RESISTANCE: resistance.value},
        history=(*recording.history, _history(resistance, drift, settings)),
    )
    return changed, drift


def _integral(voltage: Array, current: Array, resistance: float, dt: float, rule: str) -> SampleSource:
    """Return ∫(u − R·i)dt, wherever voltage and current are."""
    if is_on_disk(voltage):
        return integral_on_disk(lambda a, b: voltage[a:b] - resistance * current[a:b], len(voltage), dt, rule)
    return InMemory(integrate(voltage - resistance * current, dt, rule))


def _history(resistance: _Resistance, drift: IntegralDrift, settings: Settings) -> str:
    error = f" ± {resistance.error:.2g}" if resistance.error else ""
    closure = f", closure {_rms(drift.closure):.3g} Wb rms per cycle" if len(drift.closure) else ""
    return (
        f"flux = λ0 + ∫(u − R·i)dt by {settings.rule}: R = {resistance.value:.6g}{error} Ω ({resistance.source}), "
        f"λ0 = {drift.constant:.6g} Wb, drift {drift.offset_volt:.6g} V ({drift.method}){closure}"
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _row(found: _CoilAnalysis, resistance: _Resistance, drift: IntegralDrift) -> FluxRow:
    longest = max(found.loops, key=lambda p: p.cycles, default=None)
    closure = drift.closure
    return FluxRow(
        id=found.identifier,
        action=found.action,
        resistance=resistance.value,
        resistance_error=resistance.error,
        resistance_source=resistance.source,
        lambda0=drift.constant,
        offset_volt=drift.offset_volt,
        drift=drift.method,
        finding=drift.finding,
        closure_rms=_rms(closure),
        closure_max=float(np.max(np.abs(closure))) if len(closure) else None,
        loop_area=longest.area(resistance.value) if longest else None,
        amplitude=longest.amplitude if longest else None,
        frequency=longest.frequency if longest else None,
        loops=[
            LoopRow(
                frequency=p.frequency,
                amplitude=p.amplitude,
                cycles=p.cycles,
                loop_area=p.area(resistance.value),
                loop_area_error=p.error,
                ohmic=resistance.value * p.squared,
            )
            for p in found.loops
        ],
    )


def _summary(
    settings: Settings,
    key: str,
    rows: list[FluxRow],
    analysed: list[_CoilAnalysis],
    resistances: dict[str, _Resistance],
) -> FluxFile:
    values = {i: r.value for i, r in resistances.items()}
    loops = [loop for a in analysed for loop in a.loops]
    separations = losses.separate(loops, values)
    told = [_in_words(s) for s in separations]
    lacking = [a for a in analysed if a.action == INTEGRATED and a.identifier not in resistances]
    if loops and not separations:
        frequencies = len(losses.distinct_frequencies(loops))
        told = [
            "the loop area is not separated into hysteresis and eddy currents: that needs three frequencies, of one "
            f"amplitude or of {losses.NEEDED_LOOPS} loops; there are {len(loops)} loops of {frequencies}"
        ]
    return FluxFile(
        key=key,
        code=code_version(STAGE),
        settings=FluxSettings(**asdict(settings)),
        resistance=float(np.median(list(values.values()))) if values else None,
        recordings=rows,
        findings=[
            *(f"{r.id}: bias-change: {r.finding}" for r in rows if r.finding),
            *(f"{a.identifier}: {NO_FLUX}: {_NO_RESISTANCE}" for a in lacking),
        ],
        separation=separations,
        separation_text=told,
    )


def _in_words(separation: SeparationRow) -> str:
    parts = {
        "hysteresis": (separation.static, separation.static_error),
        "eddy currents": (separation.eddy, separation.eddy_error),
    }
    below = " and ".join(name for name, (loss, error) in parts.items() if (loss or 0.0) < -2.0 * (error or 0.0))
    note = f"; {below} cannot give energy: the loops differ by more than these parts explain, as where R warms"
    note = note if below else ""
    frequencies = ", ".join(f"{f:.3g}" for f in separation.frequencies)
    return (
        f"{separation.amplitude:.3g} A ({frequencies} Hz): loop area = "
        f"{separation.static:.4g} ± {separation.static_error:.2g} J static hysteresis "
        f"+ ({separation.eddy:.3g} ± {separation.eddy_error:.2g}) J/Hz · f eddy currents; "
        f"R used less the coil's is {separation.resistance_error:.3g} ± {separation.resistance_error_error:.2g} Ω "
        f"(± one standard error){note}"
    )
