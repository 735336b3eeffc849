"""What a nanny tells malloc does not make a worker's arrays slower than a command's."""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import resource, sys
import numpy as np
from mrfit.core.executors.dask import _freed_memory_kept
if sys.argv[1] == "kept":
    _freed_memory_kept()
np.ones(100_000).sum()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(200):
    np.ones(100_000).sum()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def faults(how: str) -> int:
    """Return the page faults of 200 arrays, one after the other, under the environment of a nanny's worker."""
    environment = {**os.environ, "MALLOC_TRIM_THRESHOLD_": "65536"}
    done = subprocess.run([sys.executable, "-c", PROGRAM, how], env=environment, stdout=subprocess.PIPE, check=True)
    return int(done.stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="not run: glibc's malloc")
def test_freed_memory_is_used_for_the_next_array() -> None:
    assert faults("kept") < 2000
    # the counter-case: each array of 0.8 MB is mapped again, some 195 pages
    assert faults("as it is") > 200 * 100
