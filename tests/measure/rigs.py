"""Records of closed-form dampers as recordings and as whole cycles."""

import numpy as np

from datasets.rig.closed_forms import Rig
from mrfit.core.recording import Recording
from mrfit.measure import bilinear, energy, forces, loop_shape
from mrfit.measure.cycles import Cycles, cycles_of
from mrfit.measure.intervals import Estimate
from mrfit.measure.phase import widened
from mrfit.measure.quantity import Quantity
from mrfit.segment.stage import Settings, cut


def recording(name: str, dt: float, **channels: np.ndarray) -> Recording:
    return Recording(name, f"{name}.csv", "", "arrays", dt, 0.0, channels, {})


def of_rig(rig: Rig, name: str = "a") -> Recording:
    displacement, force = rig.record()
    return recording(name, 1.0 / rig.rate, displacement=displacement, force=force)


def cycles(record: Recording, skew: float = 0.0) -> Cycles:
    segments, _ = cut([record], 1, Settings(drive="displacement", holdout="none"))
    return cycles_of(record, segments[0], skew)


def quantities(whole: Cycles) -> dict[str, Quantity]:
    own, late = forces.forces_of(whole), whole.late_by(whole.dt)
    moved = _groups(late, forces.forces_of(late, peaks=own.peaks))
    return {one.name: one for one in widened(whole, _groups(whole, own), moved)}


def _groups(whole: Cycles, own: forces.Forces) -> list[Quantity]:
    return [
        *forces.quantities(whole, own),
        *energy.quantities(whole, own, True),
        *bilinear.quantities(whole, own),
        *loop_shape.quantities(whole, own),
    ]


def known(found: dict[str, Quantity]) -> dict[str, Estimate]:
    return {name: one.estimate for name, one in found.items() if one.estimate}
