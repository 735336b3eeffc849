"""Settings of the fit stage; a comparison shares most of them."""

from dataclasses import dataclass
from typing import Annotated, Literal

from mrfit.core.setting import Setting
from mrfit.settings.forms import CONSTANTS, LIMITS, NUMBERS, Limits, Pairs
from mrfit.settings.shared import CurrentOrder, DrivenBy, Jobs, Mass, Seed, Start

# A global search ends when this share of its evaluations has passed without progress, unless told otherwise.
PATIENCE = 0.5

Intervals = Literal["hac", "bootstrap", "profile", "posterior"]
Forms = Literal["named", "evidence"]
Options = Annotated[
    Pairs,
    Setting(
        "Constants of the optimizers, as b=1.2,population=40, of one by mwoa.b=1.2; `mrfit show mwoa` lists them.",
        flag="opt_set",
        metavar="NAME=VALUE,…",
        form=CONSTANTS,
        told=None,
    ),
]
Per = Annotated[Literal["condition", "all"], Setting("Parameters per condition, or one set for all.", told=None)]
Budget = Annotated[int | None, Setting("Evaluations for each set of parameters.", low=1)]
Seconds = Annotated[float | None, Setting("Time limit for each set of parameters.", above=0.0)]
Stall = Annotated[
    float, Setting("Share of a global search without progress that ends it; 1: none does.", low=0.01, high=1.0)
]
Weight = Annotated[Literal["none", "floor", "range"], Setting("none; floor: conditions by their noise; range: alike.")]
Bounds = Annotated[
    Limits,
    Setting(
        "Change bounds; several by commas.", metavar="NAME=LOW:HIGH", form=LIMITS, told="bounds of {0} {1:g} to {2:g}"
    ),
]
# a pipeline file calls it as Python does
Fixed = Annotated[
    Pairs,
    Setting(
        "Hold a parameter; several by commas.",
        flag="fix",
        key="fixed",
        metavar="NAME=VALUE",
        form=NUMBERS,
        told="{0} fixed at {1:g}",
    ),
]
Only = Annotated[str, Setting("Segments by peak velocity, by condition, or both.", metavar="LMH|MH|PATTERN|MH,PATTERN")]


@dataclass(frozen=True)
class Settings:
    """Settings of a fit.

    Attributes
    ----------
    model
        Model as written on the command line.
    optimizer
        Optimizer chain, as in ``pso-fmin``.
    options
        The user's changes to the optimizers' options: name, or OPTIMIZER.NAME, and value.
    per
        ``condition``: one set of parameters for each condition, its last third of cycles held out; ``all``: one set for
        all training conditions, whole conditions held out.
    driven_by
        ``none``: the model gives the output from the logged motion; ``force`` or ``base``: a mass hangs on it, that
        channel ``excitation_force`` or ``base_acceleration`` drives, and its motion is the output.
    mass
        Its mass in kg, or ``free``.
    name
        Name of the fit; empty for MODEL.OPT (MODEL.OPT.all for a joint fit).
    seed
        Seed of every random choice.
    budget
        Evaluations allowed for each set of parameters, or None for the optimizers' own.
    seconds
        Wall-clock limit for each set of parameters, the searches that give its starts included, or None.
    stall
        Share of a global optimizer's evaluations after which it ends if they brought no progress; 1 for never.
    weight
        ``none``: every sample counts alike; ``floor``: errors count in multiples of their condition's noise floor,
        which is most accurate where noise limits the fit; ``range``: errors count as shares of their condition's range.
    bounds
        Least and greatest value of parameters, by name, in place of the model's own.
    start
        Values of parameters, by name, at which a search starts as well.
    fixed
        Values of parameters, by name, at which they are held.
    current_order
        How parameters depend on current in a joint fit: ``auto``, an order 0 to 4 for all, or ``NAME=ORDER,…``; an
        order may be in pieces, ``1:0.2:2``, and have ``plain``, ``log`` or ``sat`` before it.
    only
        Segments that take part: ``LMH`` or ``MH`` by peak velocity, patterns on conditions, or both as ``MH,*-1A``;
        empty for all.
    intervals
        ``hac``: from the Jacobian with autocorrelated noise; ``bootstrap``: refits to residuals resampled in blocks;
        ``profile``: how far each parameter can go while the others make up for it; ``posterior``: draws within the
        bounds.
    forms
        ``named``: every effect in the form that the model names; ``evidence``: of an effect that has several, as
        ``temperature``, the one is kept that predicts best what is left out.
    jobs
        Worker processes; does not change the result.
    """

    model: Annotated[str, Setting("Model; `mrfit list models` shows all.", names="model", told=None)]
    optimizer: Annotated[
        str, Setting("Optimizer or chain, as in pso-fmin.", flag="opt", names="optimizer", told=None)
    ] = "auto"
    options: Options = ()
    per: Per = "condition"
    driven_by: DrivenBy = "none"
    mass: Mass = ""
    name: Annotated[str, Setting("Name of the fit; default MODEL.OPT.", show_default=False, told=None)] = ""
    seed: Seed = 0
    budget: Budget = None
    seconds: Seconds = None
    stall: Stall = PATIENCE
    weight: Weight = "none"
    bounds: Bounds = ()
    start: Start = ()
    fixed: Fixed = ()
    current_order: CurrentOrder = "auto"
    only: Only = ""
    intervals: Annotated[Intervals, Setting("Of parameters: hac, bootstrap, profile or posterior.")] = "hac"
    forms: Annotated[
        Forms, Setting("Of an effect with several, as temperature: the named one, or the one the data call for.")
    ] = "named"
    jobs: Jobs = 1

    @property
    def fit_name(self) -> str:
        """Name of the fit's folder."""
        return self.name or f"{self.model}.{self.optimizer}" + (".all" if self.per == "all" else "")
