"""Error of the base's law itself, and its places: its response less that of the best law, effects put aside."""

from collections.abc import Sequence

import numpy as np

from mrfit.core.channels import CONTROL, unit_of
from mrfit.core.specs import Array
from mrfit.discover.invariance.estimate import GramTable, rows_of
from mrfit.discover.invariance.findings import LawGap
from mrfit.discover.invariance.setting import RegressionData, State
from mrfit.discover.invariance.weights import rms
from mrfit.discover.policy import STANDARD
from mrfit.io.schemas.discovery import LawPlace


def law_gap(
    setting: RegressionData, response: Sequence[Array], state: State, made: GramTable, errors: tuple[float, float]
) -> LawGap | None:
    """Return the error of a base's law; None where its response is not known.

    Parameters
    ----------
    setting
        The data.
    response
        Of the base, per record (N,).
    state
        Effects that are there.
    made
        The table of the best law with them.
    errors
        Of the best law alone, and with the effects, over the range.
    """
    if not response:
        return None
    rows, found = rows_of(setting, state), made.solve(made.total, effects=0)
    differences, base = [], []
    for at, own in enumerate(response):
        whole = np.concatenate([np.zeros(setting.records[at].lead), own])
        simulated = setting.row_means(at, whole) / setting.scales.span
        differences.append(simulated - rows.law[at] @ found[: made.size])
        base.append(simulated - setting.targets[at])
    total = rms(base) ** 2 - setting.noise**2
    share = float(np.clip((rms(base) ** 2 - errors[0] ** 2) / total, 0.0, 1.0)) if total > 0.0 else 0.0
    return LawGap(rms(differences), share, tuple(_where(setting, differences)))


def _where(setting: RegressionData, differences: Sequence[Array]) -> list[LawPlace]:
    """Return the places of the squared difference, over travel, speed and current, the largest bin of each first."""
    scales, records = setting.scales, setting.records
    squared = np.concatenate([d**2 for d in differences])
    since = [np.concatenate([np.zeros(r.lead), m.since]) for r, m in zip(records, setting.motions, strict=True)]
    place, speed, _ = records[0].motion
    kinds = (
        ("travel", since, scales.travel * np.array(STANDARD.law_travels), unit_of(place)),
        ("speed", [np.abs(r.speed) for r in records], scales.speed * np.array(STANDARD.law_shares), unit_of(speed)),
        (
            "control",
            [np.abs(r.control) for r in records],
            scales.control * np.array(STANDARD.law_shares),
            unit_of(CONTROL),
        ),
    )
    found: list[LawPlace] = []
    for name, values, edges, unit in kinds:
        at = np.concatenate([setting.row_means(k, v) for k, v in enumerate(values)])
        bins = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, len(edges) - 2)
        own = [
            LawPlace(
                over=name,
                low=float(edges[b]),
                high=float(min(edges[b + 1], at.max())),
                unit=unit,
                share_of_error=float(squared[bins == b].sum() / max(squared.sum(), 1e-300)),
                share_of_samples=float(np.mean(bins == b)),
            )
            for b in np.unique(bins)
        ]
        found += sorted(own, key=lambda p: -p.share_of_error)
    return found
