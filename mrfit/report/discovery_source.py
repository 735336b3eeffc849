"""Results of a discovery, read from the workspace for its page: the decision, and every sample's error."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import unit_of
from mrfit.core.recording import Segment
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.io.tables import read_table
from mrfit.io.unreadable import reading
from mrfit.io.workspace import Workspace
from mrfit.report.figures import LOOPS
from mrfit.report.numbers import natural
from mrfit.signal.smoothing import smooth


@dataclass(frozen=True)
class Contribution:
    """Change of a segment's output by an effect that is not named, in the fit in which it had its proof.

    Attributes
    ----------
    force
        What the output loses without it, SI, shape (N,).
    remainder
        Measured minus simulated without it, SI, shape (N,).
    """

    force: Array
    remainder: Array


@dataclass(frozen=True)
class Part:
    """One segment with the errors of the model without and with the effects found.

    Attributes
    ----------
    segment
        The segment.
    time
        Seconds from its first sample, shape (N,).
    measured
        Output, SI, shape (N,).
    before, after
        Simulated minus measured, SI, shape (N,).
    inputs
        Channels a loop is drawn against, SI, shape (N,).
    floor
        Noise floor of the output, SI.
    contributions
        Of suspects, by name.
    """

    segment: Segment
    time: Array
    measured: Array
    before: Array
    after: Array
    inputs: dict[str, Array]
    floor: float
    contributions: dict[str, Contribution] = field(default_factory=dict)

    @property
    def changed(self) -> bool:
        """Whether an effect was added, so that there is an error after."""
        return not np.array_equal(self.before, self.after)

    @property
    def errors(self) -> tuple[float, float]:
        """RMS errors before and after."""
        return float(np.sqrt(np.mean(self.before**2))), float(np.sqrt(np.mean(self.after**2)))


@dataclass(frozen=True)
class Discovery:
    """A finished discovery.

    Attributes
    ----------
    found
        Content of discovery.json.
    parts
        Segments, conditions in natural order; empty where the data were too few.
    output
        Channel the model predicts.
    """

    found: DiscoveryFile
    parts: list[Part]
    output: str

    @property
    def unit(self) -> str:
        """SI unit of the output."""
        return unit_of(self.output)

    @property
    def span(self) -> float:
        """Range of the measured output, to which NRMSE refers."""
        return float(max(p.measured.max() for p in self.parts) - min(p.measured.min() for p in self.parts))

    @property
    def loops(self) -> list[str]:
        """Channels that every part has and a loop is drawn against, the first first."""
        return [c for c in LOOPS.get(self.output, ()) if all(c in p.inputs for p in self.parts)]

    def of_role(self, role: str) -> list[Part]:
        """Return the parts that were fitted (``train``) or held out (``holdout``)."""
        return [p for p in self.parts if p.segment.role == role]

    def conditions(self, role: str) -> list[list[Part]]:
        """Return a role's parts by condition."""
        names = dict.fromkeys(p.segment.condition for p in self.of_role(role))
        return [[p for p in self.of_role(role) if p.segment.condition == name] for name in names]


def files_of(workspace: Workspace) -> tuple[Path, Path]:
    """Return the paths of discovery.json and residuals.parquet."""
    folder = workspace.root / "discover"
    return folder / "discovery.json", folder / "residuals.parquet"


def read_discovery(workspace: Workspace) -> Discovery:
    """Return the workspace's discovery.

    Raises
    ------
    DataError
        If there is none, or its files do not go with the segments.
    """
    found = workspace.discovery()
    output = registry.load("model", found.base_model.partition("+")[0]).SPEC.output
    listed = found.segments
    if not listed:
        return Discovery(found, [], output)
    table = files_of(workspace)[1]
    if not table.is_file():
        raise DataError(f"{table}: is missing; delete {table.parent} and run `mrfit discover` again")
    columns, _ = read_table(table)
    segments = {s.id: s for s in workspace.read_segments()}
    if any(one.id not in segments for one in listed):
        raise DataError(f"{workspace.root}: the segments have changed since; run `mrfit discover` again")
    used = [_UsedSegment(segments[one.id], one.noise_floor or 0.0) for one in listed]
    with reading(table, f"delete {table.parent} and run `mrfit discover` again"):
        parts = _parts(workspace, columns, used, LOOPS.get(output, ()))
    return Discovery(found, sorted(parts, key=lambda p: natural(p.segment.condition)), output)


@dataclass(frozen=True)
class _UsedSegment:
    """A segment with its noise floor as a share of the output's range."""

    segment: Segment
    floor: float


def _parts(
    workspace: Workspace, columns: dict[str, Array], used: Sequence[_UsedSegment], wanted: Sequence[str]
) -> list[Part]:
    """Return the parts of segments."""
    span = float(np.ptp(columns["measured"]))
    parts = []
    for number, one in enumerate(used):
        segment, rows = one.segment, columns["segment"] == number
        if not rows.any():
            continue
        recording = workspace.read_recording(segment.recording, workspace.latest)
        inputs = {}
        for name in wanted:
            try:
                drive = smooth(recording, segment, (name,))
            except DataError:
                continue
            # of a driven mass the first cycle is no part of its test
            inputs[name] = drive.values[0, drive.warm_up :][-int(rows.sum()) :]
        time, measured, before, after = (columns[c][rows] for c in ("time", "measured", "before", "after"))
        shares = {
            name.removeprefix("with "): Contribution(
                columns[name][rows] - columns[f"without {name.removeprefix('with ')}"][rows],
                -columns[f"without {name.removeprefix('with ')}"][rows],
            )
            for name in columns
            if name.startswith("with ")
        }
        parts.append(Part(segment, time - time[0], measured, before, after, inputs, one.floor * span, shares))
    return parts
