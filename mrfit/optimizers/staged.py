"""Least squares from where the stages of an identification end: the joint refinement that follows them."""

import numpy as np

from mrfit.core.specs import OptimizerSpec, Options
from mrfit.optimizers import lsq
from mrfit.search.objective import Objective

SPEC = OptimizerSpec(
    name="staged",
    title="Stage by stage on the tests made for each part of the model, then least squares on all",
    reference="Savaia et al. sec. 3",
    kind="local",
    budget=lsq.SPEC.budget,
)


def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> None:
    """Refine the best point known, to which the fit stage has added the end of the model's stages, by ``lsq``."""
    lsq.minimise(objective, rng, options)
