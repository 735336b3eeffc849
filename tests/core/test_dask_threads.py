"""A worker that nobody told to use one BLAS thread adds in the same order as a command."""

import os
import subprocess
import sys

PROGRAM = """
from mrfit.core.executors import dask
from threadpoolctl import threadpool_info
import numpy, scipy.linalg
before = [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]
dask._one_blas_thread()
after = [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]
print(max(before), max(after))
"""


def test_blas_has_one_thread_from_the_first_task_on() -> None:
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "2"}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["2", "1"]
