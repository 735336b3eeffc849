"""A base with effects whose parameters are held at values that were found without it."""

from collections.abc import Mapping
from dataclasses import replace

from mrfit.discover.evidence.refit import Fitter, Refit, RefitRequest


def with_held(fitter: Fitter, held: Mapping[str, float]) -> Fitter:
    """Return a fitter whose base has effects with all their parameters held, by name in a model."""
    effects = dict.fromkeys(name.partition(".")[0] for name in held)
    return replace(
        fitter,
        base="+".join([fitter.base, *effects]),
        fixed={**fitter.fixed, **held},
        known={},
        keep=lambda effects, point: None,
        judged={},
    )


def refitted(fitter: Fitter, found: Refit) -> Refit:
    """Return the fitter's base, fitted from where another fit ended."""
    return next(fitter.refits([RefitRequest((), (found.values, {}))]))
