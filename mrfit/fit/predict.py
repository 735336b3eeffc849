"""Simulate a fitted model on other logs, free run, and say how far off it is there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.errors import DataError, near
from mrfit.fit.extrapolation import ConditionInputs, extrapolations, outside
from mrfit.fit.files import read_fit_json
from mrfit.fit.identify import measured_output
from mrfit.fit.proof import lawful
from mrfit.fit.result import metric_rows, simulate_block
from mrfit.fit.select import left_out_warnings, usable
from mrfit.io.columns import part_of
from mrfit.io.dataset import Dataset
from mrfit.io.schemas.fit import Caution, Fit, MetricRow, Result
from mrfit.io.workspace import Workspace
from mrfit.search.parts import Blocks, SegmentPart, parts_of
from mrfit.signal.output_floor import output_floors
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_levels import assembly_of

# Share within which quantities of two conditions are the same
TRAINED_CURRENT_SHARE = 0.01


@dataclass(frozen=True)
class SegmentPrediction:
    """What a fitted model says of other segments.

    Attributes
    ----------
    metrics
        Rows as in metrics.csv; role is ``predict``. There are none where no log has the measured output.
    used
        For each segment the condition whose parameters were used.
    blocks, simulated
        The segments' blocks and the simulated outputs, for tables and figures.
    warnings
        On logs that were left out, on conditions whose parameters are another's, and on what was not tested.
    unmeasured
        Segments of logs without the output, which are simulated alone.
    leads
        Segment of a test without cycles -> measured and simulated output and inputs from the start of the record up to
        what is judged, while the model settles.
    clock
        Segment -> time in s, as the log has it, of the first sample that is judged.
    """

    metrics: list[MetricRow]
    used: dict[str, str]
    blocks: Blocks
    simulated: list[Array]
    warnings: list[Caution]
    unmeasured: frozenset[str] = frozenset()
    leads: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    clock: Mapping[str, float] = field(default_factory=dict)


def read_fit(workspace: Workspace, name: str, compare: bool = False) -> Fit:
    """Return fit.json of a named fit, with what is out of date about it; ``compare`` as ``lawful`` has it.

    Raises
    ------
    DataError
        If there is no such fit, when the message lists those there are, its file is damaged, or its law has changed.
    """
    fit = read_fit_json(workspace.fit_folder(name) / "fit.json", Fit)
    if fit is None:
        there = ", ".join(workspace.fit_names()) or "none yet; run `mrfit fit` first"
        hint = near(name, workspace.fit_names())
        raise DataError(f"{workspace.root}: no fit named '{name}' (there are: {there}){hint}")
    return lawful(workspace, replace(fit, name=name), compare)


def predict(fit: Fit, dataset: Dataset, trained: Mapping[str, tuple[float, float]] | None = None) -> SegmentPrediction:
    """Simulate a fit on all segments of other logs, of those without the measured output too.

    Parameters
    ----------
    fit
        The fit.
    dataset
        The segments and their recordings.
    trained
        Least and greatest value of every channel during the fit, to say where the logs leave them.

    Raises
    ------
    DataError
        If every log lacks a channel the model needs; where only some do, these are left out.
    """
    assembly = assembly_of(fit)
    found = dataset.segments
    recordings, lacking = _with_output(dataset.recordings, assembly.spec.output)
    segments, left_out = usable(found, recordings, assembly)
    outputs: list[Array] = []
    used: dict[str, str] = {}
    simulated: list[Array] = []
    parts: list[SegmentPart] = []
    borrowed: dict[str, Caution] = {}
    leads, clock = {}, {}
    for segment in segments:
        recording = recordings[segment.recording]
        output = measured_output(recording, assembly)
        result = closest_result(fit.results, segment)
        used[segment.id] = result.condition
        if result.condition not in ("all", segment.condition):
            borrowed.setdefault(segment.condition, _borrowed(result, segment))
        own = parts_of(replace(segment, role="predict"), recording, assembly, output)
        parts += own
        outputs.append(output[segment.start : segment.stop])
        simulated += [simulate_block(p.block, assembly, theta_of(assembly, result))[0] for p in own]
        clock[segment.id] = recording.start + segment.start * recording.dt
        if not segment.cycles and own[0].drive.warm_up:
            leads[segment.id] = _lead(own[0], assembly, theta_of(assembly, result), output)
    noise = output_floors(segments, recordings, outputs, assembly.spec.output)
    floors = dict(zip((s.id for s in segments), noise, strict=True))
    unmeasured = frozenset(s.id for s in segments if s.recording in lacking)
    measured = [k for k, p in enumerate(parts) if p.segment.id not in unmeasured]
    metrics = []
    if measured:
        known, outputs = Blocks([parts[k] for k in measured]), [simulated[k] for k in measured]
        metrics = metric_rows(known, [floors[parts[k].segment.id] for k in measured], outputs, assembly)
    warnings = [*left_out_warnings(left_out, len(found)), *borrowed.values()]
    stretches = [_stretch(p, assembly) for p in parts]
    if trained:
        warnings += extrapolations(trained, stretches)
    warnings += outside(assembly.name, (s.extents() for s in stretches))
    return SegmentPrediction(metrics, used, Blocks(parts), simulated, warnings, unmeasured, leads, clock)


def _lead(part: SegmentPart, assembly: Assembly, theta: Array, output: Array) -> dict[str, Array]:
    """Return what is simulated of a record before the first sample that is judged, of an output over the record."""
    block, samples = part.block, part.drive.warm_up
    with np.errstate(all="ignore"):
        outputs = assembly.simulate(block.drive, theta[None, :], block.dt)[0, :samples]
    measured = part_of(output, part.segment.start - samples, part.segment.start)
    inputs = {name: block.drive[row, :samples] for row, name in enumerate(assembly.spec.inputs)}
    return {"measured": measured, "simulated": outputs + simulate_block(block, assembly, theta)[1], **inputs}


def _with_output(recordings: Mapping[str, Recording], output: str) -> tuple[dict[str, Recording], set[str]]:
    """Return recordings of which all have the output, and the ids of those in which it was not measured: zero there."""
    lacking = {i for i, r in recordings.items() if output not in r.channels and r.channels}
    made = {
        i: replace(r, channels={**r.channels, output: np.zeros(r.samples)}) if i in lacking else r
        for i, r in recordings.items()
    }
    return made, lacking


def stretch_of(segment: Segment, dt: float, inputs: Mapping[str, Array]) -> ConditionInputs:
    """Return the inputs of a segment, and what is known of its test."""
    return ConditionInputs(segment.condition, dt, inputs, segment.temperature, segment.drive, segment.amplitude)


def _stretch(part: SegmentPart, assembly: Assembly) -> ConditionInputs:
    inputs = {name: part.block.inputs(row) for row, name in enumerate(assembly.spec.inputs)}
    return stretch_of(part.segment, part.dt, inputs)


def theta_of(assembly: Assembly, result: Result) -> Array:
    """Return the parameter vector (K,) of one result in the order of the model's SPEC."""
    return assembly.spec.theta({p.name: p.value for p in result.parameters})


def closest_result(results: Sequence[Result], segment: Segment) -> Result:
    """Return the result whose parameters suit a segment: the joint one, its own condition's, or the nearest one's.

    Nearness is measured on the logarithms of frequency and amplitude and on the current level, as the results'
    ``at`` records them.
    """
    for result in results:
        if result.condition in ("all", segment.condition):
            return result

    def distance(result: Result) -> float:
        at = result.at
        pairs = [(at.frequency, segment.frequency), (at.amplitude, segment.amplitude)]
        logs = [np.log(max(a or 0.0, 1e-12) / max(b, 1e-12)) for a, b in pairs]
        levels = [at.current or 0.0, segment.current if np.isfinite(segment.current) else 0.0]
        return float(np.hypot(*logs) + abs(levels[0] - levels[1]))

    return min(results, key=distance)


def _borrowed(result: Result, segment: Segment) -> Caution:
    """Return the warning that a segment is predicted by another condition's parameters, and how far off that is."""
    at, unit = result.at, unit_of(segment.drive)
    current = segment.current if np.isfinite(segment.current) else None
    pairs = [
        ("frequency", at.frequency, segment.frequency, "Hz"),
        ("amplitude", at.amplitude, segment.amplitude, unit),
        # in a test of a coil the current is the drive, whose level the amplitude is
        *([("current", at.current, current, "A")] if segment.drive != "current" else []),
    ]
    known = [(name, there, here, unit) for name, there, here, unit in pairs if there is not None or here is not None]
    apart = [
        f"{name} {_value(there, unit)} instead of {_value(here, unit)}{_share(there, here)}"
        for name, there, here, unit in known
        if there is None or here is None or not np.isclose(there, here, rtol=TRAINED_CURRENT_SHARE, atol=1e-9)
    ]
    how = "; ".join(apart) or "the same in frequency, amplitude and current"
    text = (
        f"{segment.condition} was not fitted: its parameters are those of {result.condition}, the nearest ({how}); "
        "only a fit with --per all says how they go on"
    )
    return Caution(kind="nearest-set", text=text)


def _value(value: float | None, unit: str) -> str:
    return "a moving one" if value is None else f"{value:.4g} {unit}"


def _share(there: float | None, here: float | None) -> str:
    return "" if not there or not here else f" ({100.0 * (there / here - 1.0):+.0f} %)"
