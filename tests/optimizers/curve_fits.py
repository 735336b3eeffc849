"""Least-squares problems with certified answers, in the unit cube.

Data and certified values: NIST Statistical Reference Datasets, nonlinear regression (Misra1a, Rat42, BoxBOD, MGH09,
MGH10, MGH17, Thurber). Functions with known minima: Moré, Garbow and Hillstrom, Testing unconstrained optimization
software, ACM TOMS 7 (1981).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array


@dataclass(frozen=True)
class Problem:
    """Residuals as a function of parameters (P, K), the box searched, NIST's first start, and the certified minimum."""

    name: str
    function: Callable[[Array], Array]
    low: Array
    high: Array
    start: Array
    certified: Array
    squares: float

    def residuals(self, points: Array) -> Array:
        return self.function(self.low + (self.high - self.low) * points)

    def to_cube(self, values: Array) -> Array:
        return (values - self.low) / (self.high - self.low)

    def cost(self) -> float:
        rows = self.function(self.certified[None, :]).shape[1]
        return float(np.sqrt(self.squares / rows))


def numbers(text: str) -> Array:
    return np.array(text.split(), dtype=float)


def problem(name, function, low, high, start, certified, squares):
    return Problem(name, function, *(numbers(text) for text in (low, high, start, certified)), squares)


def saturation(x, y):
    def residuals(b):
        return b[:, :1] * (1.0 - np.exp(-b[:, 1:2] * x)) - y

    return residuals


def rat42(b):
    x = numbers("9 14 21 28 42 57 63 70 79")
    y = numbers("8.930 10.800 18.590 22.330 39.350 56.110 61.730 64.620 67.080")
    return b[:, :1] / (1.0 + np.exp(b[:, 1:2] - b[:, 2:3] * x)) - y


def mgh09(b):
    x = numbers("4 2 1 .5 .25 .167 .125 .1 .0833 .0714 .0625")
    y = numbers("0.1957 0.1947 0.1735 0.1600 0.0844 0.0627 0.0456 0.0342 0.0323 0.0235 0.0246")
    with np.errstate(all="ignore"):
        return b[:, :1] * (x**2 + x * b[:, 1:2]) / (x**2 + x * b[:, 2:3] + b[:, 3:4]) - y


def mgh10(b):
    x = np.arange(50.0, 130.0, 5.0)
    y = numbers("34780 28610 23650 19630 16370 13720 11540 9744 8261 7030 6005 5147 4427 3820 3307 2872")
    return b[:, :1] * np.exp(b[:, 1:2] / (x + b[:, 2:3])) - y


def mgh17(b):
    x = 10.0 * np.arange(33)
    y = numbers(
        ".844 .908 .932 .936 .925 .908 .881 .850 .818 .784 .751 .718 .685 .658 .628 .603 .580 .558 .538 .522 .506 .490"
        " .478 .467 .457 .448 .438 .431 .424 .420 .414 .411 .406"
    )
    return b[:, :1] + b[:, 1:2] * np.exp(-b[:, 3:4] * x) + b[:, 2:3] * np.exp(-b[:, 4:5] * x) - y


def thurber(b):
    x = numbers(
        "-3.067 -2.981 -2.921 -2.912 -2.840 -2.797 -2.702 -2.699 -2.633 -2.481 -2.363 -2.322 -1.501 -1.460 -1.274"
        " -1.212 -1.100 -1.046 -0.915 -0.714 -0.566 -0.545 -0.400 -0.309 -0.109 -0.103 0.010 0.119 0.377 0.790 0.963"
        " 1.006 1.115 1.572 1.841 2.047 2.200"
    )
    y = numbers(
        "80.574 84.248 87.264 87.195 89.076 89.608 89.868 90.101 92.405 95.854 100.696 101.060 401.672 390.724 567.534"
        " 635.316 733.054 759.087 894.206 990.785 1090.109 1080.914 1122.643 1178.351 1260.531 1273.514 1288.339"
        " 1327.543 1353.863 1414.509 1425.208 1421.384 1442.962 1464.350 1468.705 1447.894 1457.628"
    )
    powers = x ** np.arange(4)[:, None]
    return (b[:, :4] @ powers) / (1.0 + b[:, 4:] @ powers[1:]) - y


def powell_singular(b):
    x1, x2, x3, x4 = b.T
    return np.stack([x1 + 10 * x2, 5**0.5 * (x3 - x4), (x2 - 2 * x3) ** 2, 10**0.5 * (x1 - x4) ** 2], axis=1)


def box_3d(b):
    t = np.arange(1, 11) / 10.0
    return np.exp(-t * b[:, :1]) - np.exp(-t * b[:, 1:2]) - b[:, 2:3] * (np.exp(-t) - np.exp(-10.0 * t))


def biggs_exp6(b):
    t = np.arange(1, 14) / 10.0
    y = np.exp(-t) - 5.0 * np.exp(-10.0 * t) + 3.0 * np.exp(-4.0 * t)
    sums = b[:, 2:3] * np.exp(-t * b[:, :1]) - b[:, 3:4] * np.exp(-t * b[:, 1:2])
    return sums + b[:, 5:6] * np.exp(-t * b[:, 4:5]) - y


def rosenbrock(b):
    return np.concatenate([10.0 * (b[:, 1::2] - b[:, ::2] ** 2), 1.0 - b[:, ::2]], axis=1)


MISRA1A = saturation(
    numbers("77.6 114.9 141.1 190.8 239.9 289.0 332.8 378.4 434.8 477.3 536.8 593.1 689.1 760.0"),
    numbers("10.07 14.73 17.94 23.93 29.61 35.18 40.02 44.82 50.76 55.05 61.01 66.40 75.47 81.78"),
)
BOXBOD = saturation(numbers("1 2 3 5 7 10"), numbers("109 149 149 191 213 224"))

CERTIFIED = [
    problem("Misra1a", MISRA1A, "0 0", "1000 .01", "500 .0001", "2.3894212918E+02 5.5015643181E-04", 1.2455138894e-01),
    problem(
        "Rat42",
        rat42,
        "0 0 0",
        "200 10 1",
        "100 1 .1",
        "7.2462237576E+01 2.6180768402E+00 6.7359200066E-02",
        8.0565229338e00,
    ),
    problem("BoxBOD", BOXBOD, "0 0", "1000 10", "1 1", "2.1380940889E+02 5.4723748542E-01", 1.1680088766e03),
    problem(
        "MGH09",
        mgh09,
        "0 0 0 0",
        "50 50 50 50",
        "25 39 41.5 39",
        "1.9280693458E-01 1.9128232873E-01 1.2305650693E-01 1.3606233068E-01",
        3.0750560385e-04,
    ),
    problem(
        "MGH10",
        mgh10,
        "0 1000 100",
        "2 10000 1000",
        ".02 4000 250",
        "5.6096364710E-03 6.1813463463E+03 3.4522363462E+02",
        8.7945855171e01,
    ),
    problem(
        "MGH17",
        mgh17,
        "0 0 -5 0 0",
        "2 5 0 .1 .1",
        ".5 1.5 -1 .01 .02",
        "3.7541005211E-01 1.9358469127E+00 -1.4646871366E+00 1.2867534640E-02 2.2122699662E-02",
        5.4648946975e-05,
    ),
    problem(
        "Thurber",
        thurber,
        "0 0 0 0 0 0 0",
        "3000 3000 1000 200 2 1 .2",
        "1000 1000 400 40 .7 .3 .03",
        "1.2881396800E+03 1.4910792535E+03 5.8323836877E+02 7.5416644291E+01 9.6629502864E-01 3.9797285797E-01"
        " 4.9727297349E-02",
        5.6427082397e03,
    ),
]

ZERO_MINIMUM = [
    problem("Rosenbrock", rosenbrock, "-2 -2", "2 2", "-1.2 1", "1 1", 0.0),
    problem("extended Rosenbrock", rosenbrock, "-2 " * 20, "2 " * 20, "-1.2 1 " * 10, "1 " * 20, 0.0),
    problem("Powell singular", powell_singular, "-4 " * 4, "5 " * 4, "3 -1 0 1", "0 0 0 0", 0.0),
    problem("Box 3-D", box_3d, "0 0 -5", "20 20 20", "0 10 20", "1 10 1", 0.0),
    problem("Biggs EXP6", biggs_exp6, "0 0 0 0 0 0", "20 20 10 10 20 10", "1 2 1 1 1 1", "1 10 1 5 4 3", 0.0),
]
