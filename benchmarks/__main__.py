"""Every table of speed, memory and coverage: ``python -m benchmarks`` (about ten minutes, 15 GB of disk)."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from benchmarks import coverage, fit_speed, ingest_memory, ingest_throughput, models_speed  # noqa: E402

COVERAGE_SEEDS = 40


def main() -> None:
    """Print all tables: kernels, whole fits, intervals, ingest, a log longer than memory."""
    models_speed.main()
    fit_speed.main()
    coverage.main(COVERAGE_SEEDS)
    ingest_throughput.main()
    ingest_memory.main()


if __name__ == "__main__":
    main()
