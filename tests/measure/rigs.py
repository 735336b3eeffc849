"""Records of closed-form dampers as recordings and as whole cycles."""

import numpy as np

from datasets.rig.closed_forms import Rig
from mrfit.core.recording import Recording
from mrfit.measure.cycles import Cycles, cycles_of
from mrfit.measure.intervals import Estimate
from mrfit.measure.quantity import Quantity
from mrfit.segment.stage import Settings, cut
from mrfit.settings.sheet import Settings as SheetSettings
from mrfit.sheet.measured import cycle_quantities


def recording(name: str, dt: float, **channels: np.ndarray) -> Recording:
    return Recording(name, f"{name}.csv", "", "arrays", dt, 0.0, channels, {})


def of_rig(rig: Rig, name: str = "a") -> Recording:
    displacement, force = rig.record()
    return recording(name, 1.0 / rig.rate, displacement=displacement, force=force)


def cycles(record: Recording, skew: float = 0.0) -> Cycles:
    segments, _ = cut([record], 1, Settings(drive="displacement", holdout="none"))
    return cycles_of(record, segments[0], skew)


def quantities(whole: Cycles) -> dict[str, Quantity]:
    return {one.name: one for one in cycle_quantities(whole, True, SheetSettings())}


def known(found: dict[str, Quantity]) -> dict[str, Estimate]:
    return {name: one.estimate for name, one in found.items() if one.estimate}
