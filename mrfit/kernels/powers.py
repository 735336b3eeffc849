"""x^n, 2^y and tanh for SIMD lanes: numba's wheels carry no vector pow, exp or tanh, so these are polynomials."""

from mrfit.kernels.jit import bits, from_bits, kernel

_MANTISSA = 0x000FFFFFFFFFFFFF
_ONE = 0x3FF0000000000000
_HALF_SQRT = 0x0006A09E667F3BCD  # mantissa bits of sqrt(2)
_SHIFT = 0x4330000000000000  # bits of 2^52: an integer or-ed into its mantissa is 2^52 + that integer
_SHIFTER = 6755399441055744.0  # 1.5*2^52: adding it rounds to an integer


@kernel
def exp2(y: float) -> float:
    """Return 2^y to 3e-13 of itself for |y| <= 1000, by its Taylor polynomial on [-1/2, 1/2]; of NaN, NaN."""
    shifted = y + _SHIFTER
    f = 0.6931471805599453 * (y - (shifted - _SHIFTER))
    taylor = 1.0 / 5040.0 + f * (1.0 / 40320.0 + f * (1.0 / 362880.0 + f * (1.0 / 3628800.0)))
    taylor = 1.0 / 6.0 + f * (1.0 / 24.0 + f * (1.0 / 120.0 + f * (1.0 / 720.0 + f * taylor)))
    taylor = 1.0 + f * (1.0 + f * (0.5 + f * taylor))
    return taylor * from_bits((bits(shifted) << 52) + _ONE)


@kernel
def tanh(x: float) -> float:
    """Return tanh(x) = 1 - 2/(exp(2x) + 1) to 1.5e-13, absolute, without branches or calls; of NaN, NaN."""
    y = 2.8853900817779268 * x
    y = 60.0 if y > 60.0 else y  # tanh is +-1 beyond, to the last digit; NaN, compared this way round, passes
    y = -60.0 if y < -60.0 else y
    return 1.0 - 2.0 / (exp2(y) + 1.0)


@kernel
def log2(x: float) -> float:
    """Return log2(x) to about 1e-15 for x > 0 without branches or calls, by the atanh series on [1/sqrt(2), sqrt(2)].

    x that is not a number gives any value.
    """
    raw = bits(x)
    mantissa = raw & _MANTISSA
    upper = 1 if mantissa >= _HALF_SQRT else 0
    m = from_bits(mantissa | (_ONE - (upper << 52)))
    exponent = from_bits(_SHIFT | ((raw >> 52) + upper)) - (4503599627370496.0 + 1023.0)
    s = (m - 1.0) / (m + 1.0)
    t = s * s
    series = 1.0 / 13.0 + t * (1.0 / 15.0 + t * (1.0 / 17.0))
    series = 1.0 / 7.0 + t * (1.0 / 9.0 + t * (1.0 / 11.0 + t * series))
    series = 1.0 + t * (1.0 / 3.0 + t * (1.0 / 5.0 + t * series))
    return exponent + 2.8853900817779268 * s * series


@kernel
def power(x: float, n: float) -> float:
    """Return x^n = exp2(n*log2(x)) to about 1e-13 for x > 0 and n > 0 without branches or calls; of 0, some 1e-300.

    Results below 2^-1000 are raised to it, above 2^1000 lowered. x that is not a number gives any value.
    """
    y = min(max(n * log2(x), -1000.0), 1000.0)
    return exp2(y)
