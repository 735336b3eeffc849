"""Whether a fit's parameters are those of the law that is here: the one rule, kept by all that simulate a stored fit.

A fit states hashes of its law's code. Where they are the same, the law is. Where they differ, or an older mrfit stated
none, the law is simulated on the fit's own segments and held against residuals.parquet, which keeps what the fit
simulated: the same numbers are the same law.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.fit.identify import measured_output, split_parts
from mrfit.fit.result import simulate_block
from mrfit.fit.select import load_recordings
from mrfit.io.keys import PLUGIN, law_code
from mrfit.io.outdated import Inputs, law_reason, refusal
from mrfit.io.residuals import read_residuals
from mrfit.io.schemas.fit import Fit, Result
from mrfit.io.workspace import Workspace
from mrfit.search.parts import SegmentPart
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_levels import as_written

# Samples that are simulated at most, beyond the first segment
PROOF_SAMPLES = 200_000
# Share of the output's range within which two simulations are one: rounding differs between machines
PROOF_TOLERANCE = 1e-6


def lawful(workspace: Workspace, fit: Fit, compare: bool = False) -> Fit:
    """Return a fit of a workspace with what is out of date about it, if its law is the one here.

    Parameters
    ----------
    workspace
        Where it lies.
    fit
        The fit.
    compare
        Whether it is simulated though its hashes are the same. A fit by a plug-in, which may call code that no hash
        covers, always is.

    Raises
    ------
    DataError
        If the law gives other outputs than the fit had, or its code has changed and there is nothing to compare with.
    """
    changed = law_reason(fit)
    said = []
    if compare or changed or not fit.law or any(name.startswith(PLUGIN) for name in fit.law):
        difference = _difference(workspace, fit)
        if difference is None and changed:
            raise refusal(fit, f"{changed}, and the data that it simulated are not here to compare with")
        if difference is not None and not difference <= PROOF_TOLERANCE:
            raise refusal(fit, f"{changed or 'the code of its law has changed since'}: {_far(difference)}")
        if difference is None and not fit.law:
            said.append("an older mrfit's, which does not state its code, and not compared with what it simulated")
        if difference is not None and (changed or not fit.law):
            said.append(f"{changed or 'an older mrfit made it'}; this code simulates the same as the fit did")
    reason = Inputs(workspace).of_fits([fit]).get(fit.name, "")
    if reason and not (changed and reason == changed):
        said.append(reason)
    return replace(fit, outdated=said, law=law_code(fit.model) if changed else fit.law)


def check_simulated(fit: Fit, assembly: Assembly, parts: Iterable[SegmentPart], simulated: Iterable[Array]) -> None:
    """Refuse a fit in memory whose law no longer gives what it simulated, in as many samples as are compared.

    Raises
    ------
    DataError
        If it gives other outputs.
    """
    pairs, samples = [], 0
    for part, stored in zip(parts, simulated, strict=True):
        pairs.append((_simulated(fit, assembly, part), np.asarray(stored)))
        samples += part.segment.samples
        if samples > PROOF_SAMPLES:
            break
    if not (difference := _largest(pairs)) <= PROOF_TOLERANCE:
        raise refusal(fit, f"the code of its law has changed since: {_far(difference)}")


def _far(difference: float) -> str:
    return f"this code simulates otherwise than the fit did, by {100.0 * difference:.2g} % of the output's range"


def _difference(workspace: Workspace, fit: Fit) -> float | None:
    """Return how far what the law gives is from what the fit simulated, over the range of the output.

    None where that cannot be told: the recordings or segments are not those of the fit, or its residuals are gone.
    """
    assembly = as_written(fit)
    try:
        parts = list(_parts(workspace, fit, assembly))
        stored = _stored(workspace.fit_folder(fit.name) / "residuals.parquet", parts)
    except DataError:
        return None
    pairs = []
    for part in parts:
        columns = stored.get((part.segment.id, part.segment.role))
        if columns is None or not _same_data(part, columns, assembly):
            return None
        pairs.append((_simulated(fit, assembly, part), columns["simulated"]))
    return _largest(pairs) if pairs else None


def _same_data(part: SegmentPart, columns: dict[str, Array], assembly: Assembly) -> bool:
    """Return whether a part holds what the fit measured, and drives the model with what it did."""
    own = {"measured": np.asarray(part.output)}
    own |= {name: part.inputs(row) for row, name in enumerate(assembly.spec.inputs)}
    return all(
        name in columns and len(columns[name]) == len(values) and bool(np.allclose(columns[name], values, 1e-9, 0.0))
        for name, values in own.items()
    )


def _simulated(fit: Fit, assembly: Assembly, part: SegmentPart) -> Array:
    result = _result_of(fit, part.segment)
    theta = assembly.spec.theta({p.name: p.value for p in result.parameters})
    return simulate_block(part.block, assembly, theta)[0]


def _result_of(fit: Fit, segment: Segment) -> Result:
    return next(r for r in fit.results if any((s.id, s.role) == (segment.id, segment.role) for s in r.segments))


def _largest(pairs: list[tuple[Array, Array]]) -> float:
    now, then = (np.concatenate(values) for values in zip(*pairs, strict=True))
    with np.errstate(invalid="ignore"):
        apart = np.where((now == then) | (np.isnan(now) & np.isnan(then)), 0.0, np.abs(now - then))
        # where the fit's own simulation diverged, the rest has the range
        known = then[np.isfinite(then)]
        return float(np.max(apart) / ((np.ptp(known) if len(known) else 0.0) or 1.0))


def _parts(workspace: Workspace, fit: Fit, assembly: Assembly) -> Iterator[SegmentPart]:
    """Yield the first piece of the segments of a fit, of segments spread over them where there are many samples."""
    segments = {s.id: s for s in workspace.read_segments()}
    used = {s.id: [u.role for u in r.segments if u.id == s.id] for r in fit.results for s in r.segments}
    if missing := [name for name in used if name not in segments]:
        raise DataError(f"{workspace.segments_file}: no segment {missing[0]}")
    chosen = [segments[name] for name in used]
    every = -(-sum(s.samples for s in chosen) // PROOF_SAMPLES)
    chosen = chosen[::every]
    recordings: dict[str, Recording] = load_recordings(workspace, chosen)
    for segment in chosen:
        recording = recordings[segment.recording]
        output = measured_output(recording, assembly)
        # a condition by itself holds a part of its own cycles out
        own = split_parts(segment, recording, assembly, output, len(set(used[segment.id])) > 1)
        for role in dict.fromkeys(p.segment.role for p in own):
            yield next(p for p in own if p.segment.role == role)


def _stored(path: Path, parts: list[SegmentPart]) -> dict[tuple[str, str], dict[str, Array]]:
    """Return the columns of residuals.parquet over the samples of parts, by segment and role."""
    wanted = {(p.segment.id, p.segment.role): len(p.output) for p in parts}
    found: dict[tuple[str, str], dict[str, Array]] = {}
    for (_, segment, role), columns in read_residuals(path):
        place = segment, role
        if (count := wanted.get(place, 0)) > len(found.get(place, {"time": ()})["time"]):
            before = found.get(place, {name: np.empty(0) for name in columns})
            found[place] = {name: np.concatenate([before[name], columns[name]])[:count] for name in columns}
        if len(found) == len(wanted) and all(len(found[p]["time"]) == n for p, n in wanted.items()):
            break
    return found
