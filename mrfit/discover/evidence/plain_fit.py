"""The error on held-out conditions by fits of their own, in which every sample weighs alike."""

from collections.abc import Mapping, Sequence

from mrfit.discover.evidence.work import work_of
from mrfit.discover.policy import STANDARD
from mrfit.errors import MrfitError, Unreachable
from mrfit.fit import stage as fit_stage
from mrfit.io.dataset import Dataset
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.reading import reusable
from mrfit.io.workspace import Workspace
from mrfit.settings.discover import Settings

# Cycles that are simulated for those of a periodic test, folded to one
FOLDED_CYCLES = 3.0
# What is said where they are left out
PLAIN_ERRORS = "plain errors, which `mrfit fit` states"


def with_plain_errors(
    found: DiscoveryFile, near: Mapping[str, float], workspace: Workspace, settings: Settings, data: Dataset
) -> DiscoveryFile:
    """Return a discovery with the errors that fits of its base and of its augmented model state of held-out conditions.

    The base's own is the very fit. That of the augmented model descends from where the discovery's ended.

    Parameters
    ----------
    found
        The discovery.
    near
        Parameters of the augmented model by name (SI) in the discovery.
    workspace
        May hold the fits already.
    settings
        As the discovery was asked for.
    data
        Segments and recordings with the roles that a fit gives them.
    """
    base, augmented = _fit_of(found.base_model, settings), _fit_of(found.augmented_model, settings, found.held)
    alone = _prepared(data, base)
    whole = _prepared(data, augmented) if augmented != base else alone
    if _work(data, alone) + _work(data, whole) > STANDARD.most_work:
        return found.model_copy(update={"left_out": (*found.left_out, PLAIN_ERRORS)})
    before = after = _stated(workspace, data, base, alone)
    if found.augmented_model != found.base_model:
        after = _stated(workspace, data, augmented, whole, near)
    gap = found.gap.model_copy(update={"plain_before": before, "plain_after": after})
    return found.model_copy(update={"gap": gap})


def _fit_of(model: str, settings: Settings, held: Sequence[tuple[str, float]] = ()) -> fit_stage.Settings:
    return fit_stage.Settings(
        model,
        per="all",
        start=settings.start,
        fixed=tuple(held),
        current_order=settings.current_order,
        seed=settings.seed,
    )


def _prepared(data: Dataset, fit: fit_stage.Settings) -> fit_stage.FitPreparation | None:
    """Return a fit's preparation, in which laws of current are chosen; None where it cannot be made."""
    try:
        return fit_stage.prepare(data, fit)
    except Unreachable:
        raise
    except MrfitError:
        return None


def _work(data: Dataset, prepared: fit_stage.FitPreparation | None) -> int:
    """Return the work of a fit, of which cycles are folded; 0 where it cannot be made."""
    samples = sum(s.samples / max(s.cycles / FOLDED_CYCLES, 1.0) for s in data.segments if s.role == "train")
    return work_of(prepared.assembly, int(samples)) if prepared else 0


def _stated(
    workspace: Workspace,
    data: Dataset,
    fit: fit_stage.Settings,
    prepared: fit_stage.FitPreparation | None,
    near: Mapping[str, float] | None = None,
) -> float | None:
    """Return the NRMSE over all held-out conditions that a fit states; None where it cannot be made."""
    known = reusable(workspace.fit_folder(fit.fit_name) / "fit.json", Fit)
    try:
        if known and known.key == fit_stage.origin_of(data, fit).key:
            return fit_stage.over_held_out(known.metrics)
        return fit_stage.held_out_error(prepared, fit, near) if prepared else None
    except Unreachable:
        raise
    except MrfitError:
        return None
