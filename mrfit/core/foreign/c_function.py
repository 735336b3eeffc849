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
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from mrfit.core import plugins
from mrfit.core.specs import Array, ModelSpec
from mrfit.errors import ConfigError

C_CODE_CAUTION = (
    "the model {} is a C function called for one parameter vector at a time: slower than a model of mrfit's own"
)
Simulate = Callable[[Array, Array, float], Array]


def register_c_function(spec: ModelSpec, library: Path, function: str, where: str = "") -> None:
    """Add a C function to the registry as a model; the library's bytes are part of the keys of its fits.

    Parameters
    ----------
    spec
        What the model is; its ``caution`` is set here.
    library
        Shared library (.so, .dylib, .dll).
    function
        Name of the function in it.
    where
        Where the model comes from, in words; default: the plug-in file that is being run.

    Raises
    ------
    ConfigError
        If the library cannot be loaded, or has no such function.
    """
    response = constant_only(spec.name, plugins.one_by_one(_called(library, function)))
    item = SimpleNamespace(
        SPEC=replace(spec, caution=C_CODE_CAUTION.format(spec.name)), response=response, __doc__=spec.title
    )
    plugins.register(item, where, f"{spec!r} {function} {hashlib.sha256(library.read_bytes()).hexdigest()}")


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


def constant_only(name: str, response: Simulate) -> Simulate:
    """Return a response that says in one line that it takes no parameters that vary along the samples."""

    def checked(drive: Array, theta: Array, dt: float) -> Array:
        if theta.ndim > 2:
            raise ConfigError(
                f"the parameters of {name} cannot vary within a test, as under a current that moves: give it the "
                "current as an input, or --current-order 0"
            )
        return response(drive, theta, dt)

    return checked
