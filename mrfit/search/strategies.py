"""The strategies of a search by name: what ``--opt`` takes, each of equal rank."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType

from mrfit.core import registry
from mrfit.core.specs import OptimizerSpec
from mrfit.search import auto, staged
from mrfit.search.chain import Given, OptimizerChain, parts
from mrfit.search.strategy import Strategy as Strategy


@dataclass(frozen=True)
class StrategyEntry:
    """A strategy that has a name of its own.

    Attributes
    ----------
    module
        Where it is; its SPEC and docstring say what it is.
    make
        Gives the strategy for a chain as written, and what is given for its optimizers' options.
    leads
        Whether optimizers may go on where it ends (``staged-lsq``); one that does not lead is its own name alone, and
        elsewhere in a chain the optimizer that ``chain.PARTS`` says.
    """

    module: ModuleType
    make: Callable[[str, Given], Strategy]
    leads: bool

    @property
    def spec(self) -> OptimizerSpec:
        """What it is, in words."""
        spec: OptimizerSpec = self.module.SPEC
        return spec


# Any other name is a chain of optimizers
REGISTERED_STRATEGIES: Mapping[str, StrategyEntry] = {
    auto.SPEC.name: StrategyEntry(auto, lambda name, given: auto.Auto(), leads=False),
    staged.SPEC.name: StrategyEntry(staged, staged.StagedIdentification, leads=True),
}


def find(name: str, given: Given = ()) -> Strategy:
    """Return the strategy that a user writes as a name or a chain of names, with options of its optimizers.

    Raises
    ------
    ConfigError
        If a part is empty, no such optimizer exists, or one that can only begin a chain stands later in it.
    """
    written = parts(name)
    for own in (REGISTERED_STRATEGIES[part] for part in written if part in REGISTERED_STRATEGIES):
        if own.leads or len(written) == 1:
            return own.make(name, given)
    return OptimizerChain(name, given)


def specs() -> dict[str, OptimizerSpec]:
    """Return what all strategies and optimizers say of themselves, by name, sorted."""
    found = {name: registry.load("optimizer", name).SPEC for name in registry.names("optimizer")}
    return dict(sorted((found | {name: own.spec for name, own in REGISTERED_STRATEGIES.items()}).items()))
