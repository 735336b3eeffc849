"""Run a command of mrfit without its own effects: `python -m benchmarks.outside_forms.library_off discover …`.

An effect without force stays, so that the accelerations of the tests are there as they are with the library.
"""

from types import SimpleNamespace

import numpy as np

from mrfit.core import built_in

_all_names = built_in.own_names


def _without_effects(kind: built_in.Kind) -> tuple[str, ...]:
    return () if kind == "effect" else _all_names(kind)


def _no_force(channels: dict[str, np.ndarray], theta: np.ndarray, dt: float) -> np.ndarray:
    return np.zeros((theta.shape[0], channels["acceleration"].shape[-1]))


def main() -> None:
    """Take the effects from the registry and run the command."""
    built_in.own_names = _without_effects  # type: ignore[assignment]
    from dataclasses import replace

    from mrfit.core import plugins
    from mrfit.effects import inertia

    spec = replace(inertia.SPEC, name="no-force", aliases=(), breaks=None)
    plugins.register(SimpleNamespace(SPEC=spec, term=_no_force), "no file")
    from mrfit.cli.__main__ import main as run

    run()


if __name__ == "__main__":
    main()
