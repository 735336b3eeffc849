"""Run a command of mrfit without its own effects: `python -m benchmarks.outside_forms.library_off discover …`."""

from mrfit.core import built_in

_all_names = built_in.own_names


def _without_effects(kind: built_in.Kind) -> tuple[str, ...]:
    return () if kind == "effect" else _all_names(kind)


def main() -> None:
    """Take the effects from the registry and run the command."""
    built_in.own_names = _without_effects  # type: ignore[assignment]
    from mrfit.cli.__main__ import main as run

    run()


if __name__ == "__main__":
    main()
