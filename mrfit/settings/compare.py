"""Settings of a comparison, of models or of optimizers."""

import hashlib
import re
from dataclasses import asdict, dataclass, fields
from typing import Annotated

import mrfit.settings.fit
from mrfit.core.setting import Setting
from mrfit.errors import ConfigError
from mrfit.settings.fit import PATIENCE, Bounds, Budget, Fixed, Only, Options, Per, Seconds, Stall, Weight
from mrfit.settings.forms import NAMES, Names
from mrfit.settings.shared import CurrentOrder, Jobs, Seed, Start

LONGEST_COMPARISON = 100
"""Characters of a fit's name."""

Models = Annotated[Names, Setting("Models by commas, or all.", form=NAMES, show_default=False)]
Seeds = Annotated[int, Setting("Runs of each optimizer, from different starts.", low=1)]


@dataclass(frozen=True)
class Settings:
    """Models to compare, and the settings of their fits.

    Attributes
    ----------
    models
        Models as written; ``("all",)`` for every one there is.
    optimizer, options, per, seed, budget, seconds, stall, weight, current_order, only
        As in the fit stage, the same for all.
    jobs
        Worker threads of each fit; fits run one after the other, so that their times can be compared.
    """

    models: Models = ("all",)
    optimizer: Annotated[str, Setting("Optimizer with which models are compared.", flag="opt", names="optimizer")] = (
        "auto"
    )
    options: Options = ()
    per: Per = "all"
    seed: Seed = 0
    budget: Budget = None
    seconds: Seconds = None
    stall: Stall = PATIENCE
    weight: Weight = "none"
    current_order: CurrentOrder = "auto"
    only: Only = ""
    jobs: Jobs = 1

    def of_fit(self, model: str) -> mrfit.settings.fit.Settings:
        """Return the settings of one model's fit."""
        shared = {k: v for k, v in asdict(self).items() if k != "models"}
        return mrfit.settings.fit.Settings(model=model, name=self.name_of(model), **shared)

    def name_of(self, model: str) -> str:
        """Return the name of one model's fit, which holds every setting that is not at its default."""
        name = f"{model}.{self.optimizer}" + (".all" if self.per == "all" else "") + (f".{self.only}" * bool(self.only))
        for field in fields(Settings):
            value = getattr(self, field.name)
            if field.name not in ("models", "optimizer", "per", "only", "jobs") and value != field.default:
                name += f".{field.name.replace('_', '-')}-{_written(value)}"
        name = re.sub(r"[^A-Za-z0-9._+-]+", "_", name)
        if len(name) <= LONGEST_COMPARISON:
            return name
        return f"{name[: LONGEST_COMPARISON - 9]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"

    @property
    def names(self) -> list[str]:
        """The models' names, all written out."""
        # help looks for no plug-in
        from mrfit.core import registry

        return registry.names("model") if self.models == ("all",) else list(dict.fromkeys(self.models))


def _written(value: object) -> str:
    """Return a setting as a part of a name: 0.5, floor, population40_F0.7."""
    if isinstance(value, tuple):
        return "_".join("".join(map(_written, pair)) if isinstance(pair, tuple) else str(pair) for pair in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class OfOptimizers:
    """Optimizers to compare, and the fit they are compared on.

    Attributes
    ----------
    optimizers
        Optimizers or chains, as in ``pso-fmin``.
    fit
        What they fit: model, ``per``, bounds, weight, budget, options, … as in the fit stage; its optimizer and seed
        are not used. An option goes to every optimizer that has one of the name.
    seeds
        Runs of each optimizer, seeds 0, 1, …. Seed 0 starts at the model's own start values, every other at a point of
        the cube drawn at random, the same for all optimizers; ``auto`` starts at what the data give as well, as it
        does in a fit, and ``points`` there only.
    """

    optimizers: Names
    fit: mrfit.settings.fit.Settings
    seeds: Seeds = 5


@dataclass(frozen=True)
class _First:
    """Options that choose the comparison; they come first in the help."""

    models: Models = ()
    optimizers: Annotated[Names, Setting("Instead: optimizers by commas, on one --model.", form=NAMES)] = ()
    model: Annotated[str, Setting("Model on which optimizers are compared.", names="model", show_default=False)] = ""
    seeds: Seeds = 5


@dataclass(frozen=True)
class CompareOptions(Settings, _First):
    """Options of the command: the settings of either comparison."""

    models: Models = ()
    bounds: Bounds = ()
    start: Start = ()
    fixed: Fixed = ()

    def __post_init__(self) -> None:
        if bool(self.models) == bool(self.optimizers) or bool(self.optimizers) != bool(self.model):
            raise ConfigError("compare takes --models NAMES, or --optimizers NAMES together with --model NAME")
        if self.models and (self.bounds or self.start or self.fixed):
            raise ConfigError("--bounds, --start and --fix go with --optimizers: models have parameters of their own")

    @property
    def of_models(self) -> Settings:
        """The settings of a comparison of models."""
        return Settings(**{f.name: getattr(self, f.name) for f in fields(Settings)})

    @property
    def of_optimizers(self) -> OfOptimizers:
        """The settings of a comparison of optimizers; seeds and optimizers are not those of one fit."""
        own = {f.name for f in fields(self)} - {"optimizer", "seed"}
        shared = {f.name: getattr(self, f.name) for f in fields(mrfit.settings.fit.Settings) if f.name in own}
        return OfOptimizers(self.optimizers, mrfit.settings.fit.Settings(**shared), self.seeds)
