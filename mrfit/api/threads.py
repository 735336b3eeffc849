"""One thread of linear algebra: the result then does not depend on the machine's cores, and small matrices are quicker.

The command line asks for it before numpy is loaded; a notebook has numpy already, and may want its threads back.
"""

from collections.abc import Iterator
from contextlib import contextmanager

# what is limited has to be loaded before
import scipy.linalg  # noqa: F401
from threadpoolctl import threadpool_limits


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS use one thread for the time of a call."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield
