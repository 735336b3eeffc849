"""Every table of speed and coverage, as ratios in one run: ``python -m benchmarks`` (about five minutes)."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from benchmarks import coverage, fit_speed, models_speed  # noqa: E402

COVERAGE_SEEDS = 40


def main() -> None:
    """Print all tables: kernels, whole fits, intervals."""
    models_speed.main()
    fit_speed.main()
    coverage.main(COVERAGE_SEEDS)


if __name__ == "__main__":
    main()
