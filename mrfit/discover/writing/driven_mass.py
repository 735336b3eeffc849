"""A discovery of a driven mass, whose law is judged with a mass of its own, as the model that drives it is written."""

from dataclasses import replace

from mrfit.fit.driven import INERTIA_EFFECT
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.settings.discover import Settings


def with_inertia(settings: Settings) -> Settings:
    """Return settings of which the model, and every other law beside it, has a mass of its own where that is free."""
    free = settings.driven_by != "none" and settings.mass == "free" and INERTIA_EFFECT not in settings.model.split("+")
    return replace(settings, model=f"{settings.model}+{INERTIA_EFFECT}") if free else settings


def of_driven(found: DiscoveryFile, settings: Settings) -> DiscoveryFile:
    """Return a discovery whose models are those of a driven mass, where the mass is no effect of the law."""
    if settings.driven_by == "none":
        return found
    free = settings.mass == "free"

    def law(text: str) -> str:
        return text.replace(f"+{INERTIA_EFFECT}", "") if free else text

    by = f" --driven-by {settings.driven_by} --mass {settings.mass}"
    laws = [o.model_copy(update={"model": law(o.model), "command": law(o.command) + by}) for o in found.other_laws]
    models = {"base_model": law(found.base_model), "augmented_model": law(found.augmented_model)}
    other = found.other_base and found.other_base.model_copy(update={"model": law(found.other_base.model)})
    ways = found.ways and found.ways.model_copy(update={"difference": law(found.ways.difference)})
    return found.model_copy(update={**models, "other_laws": tuple(laws), "other_base": other, "ways": ways})
