"""A model whose equations are a C function in a shared library, called once for each parameter vector.

The function has this signature (row-major arrays of double, SI):

    int NAME(const double *drive, const double *theta, double *output,
             int64_t channels, int64_t samples, int64_t parameters, double dt);

``drive`` (channels, samples) and ``theta`` (parameters) are only read; ``output`` (samples) is to be filled. State
starts from rest at sample 0, and nothing is remembered from call to call. A return value other than 0 says that the
simulation has diverged. The library runs in mrfit's own process: what crashes it crashes mrfit.
"""

import ctypes
import hashlib
from pathlib import Path

import numpy as np

from mrfit.core.foreign.model import ForeignModel, Simulate, foreign_model
from mrfit.core.specs import Array, ModelSpec
from mrfit.errors import ConfigError

C_CODE_CAUTION = (
    "the model {} is a C function called for one parameter vector at a time: slower than a model of mrfit's own"
)


def c_function_model(spec: ModelSpec, library: Path, function: str) -> ForeignModel:
    """Return a C function as a model; the library's bytes are part of the keys of its fits.

    Parameters
    ----------
    spec
        What the model is; its ``caution`` is set here.
    library
        Shared library (.so, .dylib, .dll).
    function
        Name of the function in it.

    Raises
    ------
    ConfigError
        If the library cannot be loaded, or has no such function.
    """
    simulate = _called(library, function)
    source = f"{spec!r} {function} {hashlib.sha256(library.read_bytes()).hexdigest()}"
    return foreign_model(spec, C_CODE_CAUTION, simulate, source)


def _called(library: Path, name: str) -> Simulate:
    try:
        function = getattr(ctypes.CDLL(str(library.resolve())), name)
    except OSError as error:
        text = " ".join(str(error).split())
        raise ConfigError(f"{library}: cannot be loaded ({text}); compile it as a shared library") from None
    except AttributeError:
        raise ConfigError(f"{library}: has no function '{name}'; export it, or name another one") from None
    function.argtypes = [*3 * [ctypes.c_void_p], *3 * [ctypes.c_int64], ctypes.c_double]
    function.restype = ctypes.c_int

    def simulate(drive: Array, theta: Array, dt: float) -> Array:
        drive, theta = np.ascontiguousarray(drive, float), np.ascontiguousarray(theta, float)
        output = np.full(drive.shape[1], np.nan)
        arrays = (drive.ctypes.data, theta.ctypes.data, output.ctypes.data)
        if function(*arrays, *drive.shape, len(theta), dt) != 0:
            output[:] = np.nan
        return output

    return simulate
