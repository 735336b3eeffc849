"""Which models a discovery left standing: what it could not tell apart, and what its data could not show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from mrfit.core import registry
from mrfit.core.specs import EffectSpec
from mrfit.errors import DataError
from mrfit.io.schemas.discovery import DiscoveryFile

# How a discovery says that its data show nothing of an effect
UNSEEN_REASONS = ("absorbed by what the model has", "cannot be judged")
NO_MORE_RIVALS = "nothing more"


@dataclass(frozen=True)
class Rival:
    """A model that may be the true one.

    Attributes
    ----------
    name
        The effect that it has and the others have not; ``NO_MORE_RIVALS`` for the model as found.
    effects
        All its effects beside the base.
    hidden
        Whether the data there are show nothing of it.
    start
        Values of its effect's parameters that a discovery found, by the model's parameter names.
    """

    name: str
    effects: tuple[str, ...]
    hidden: bool = False
    start: Mapping[str, float] = field(default_factory=dict)


def spec_of(effect: str) -> EffectSpec:
    """Return the SPEC of an effect."""
    return registry.load("effect", effect).SPEC


def rivals_of(found: DiscoveryFile) -> list[Rival]:
    """Return the models that a discovery left standing, the one it prefers first.

    These are the effects of which it could not tell which one it is; else those that it named and those that look like
    them; else the model as found and each effect of which its data show nothing.

    Raises
    ------
    DataError
        If it left none.
    """
    if found.verdict == "insufficient-data":
        raise DataError(f"the discovery on {found.base_model} had too few data for rivals: {'; '.join(found.advice)}")
    present = tuple(found.augmented_model.split("+")[len(found.base_model.split("+")) :])
    rivals = _told(found, present) or _hidden(found, present)
    if len(rivals) < 2:
        raise DataError(
            f"the discovery on {found.base_model} ended with '{found.verdict}' and left no rivals: nothing to separate"
        )
    return rivals


def _told(found: DiscoveryFile, present: tuple[str, ...]) -> list[Rival]:
    """Return the rivals that a discovery states; none where it states none."""
    values = {e.name: {f"{e.name}.{p.name}": p.value for p in e.parameters} for e in found.effects}
    values |= {s.name: {f"{s.name}.{p.name}": p.value for p in s.parameters} for s in found.suspects}
    swaps: dict[str, str] = {}
    for name in found.ambiguous_set:
        swaps[name] = name if name in present else _counterpart(name, [p for p in present if p in found.ambiguous_set])
    for effect in found.effects:
        alike = [a for a in effect.aliases if a not in present and _exists(a)]
        swaps |= {name: effect.name for name in (effect.name, *alike)} if alike else {}
    for suspect in found.suspects:
        if suspect.instead_of and suspect.name not in swaps:
            swaps |= {suspect.instead_of: suspect.instead_of, suspect.name: suspect.instead_of}
    models: dict[tuple[str, ...], Rival] = {}
    for name, own in swaps.items():
        effects = tuple(sorted({*(e for e in present if e != own), name}))
        models.setdefault(effects, Rival(name, effects, start=values.get(name, {})))
    return list(models.values()) if len(models) > 1 else []


def _counterpart(name: str, standing: Sequence[str]) -> str:
    """Return the effect of a found model in whose place another may stand: one that it is mistaken for."""
    own = spec_of(name).aliases
    return next((e for e in standing if e in own or name in spec_of(e).aliases), standing[0] if standing else "")


def _hidden(found: DiscoveryFile, present: tuple[str, ...]) -> list[Rival]:
    """Return the model as found and, beside it, each effect of which the data show nothing."""
    confounded = {c.name for c in found.confounded}
    unseen = [
        c.name
        for c in found.candidates
        if c.name not in present and _exists(c.name) and (c.reason.startswith(UNSEEN_REASONS) or c.name in confounded)
    ]
    own = {f"{e.name}.{p.name}": p.value for e in found.effects for p in e.parameters}
    more = [Rival(n, tuple(sorted((*present, n))), hidden=True, start=own) for n in sorted(unseen)]
    return [Rival(NO_MORE_RIVALS, tuple(sorted(present)), start=own), *more]


def _exists(name: str) -> bool:
    return name in registry.names("effect")
