"""Functions in the subset that the printer reads, one for each part of it; and functions outside of it."""

import math

import numpy as np

# How fast it fades
FADING = 0.3
_MANY, _FEW = 12, 3


def choice(x: float, y: float) -> float:
    return x * y if x > y else x - y / 3.0


def chain(x: float, y: float) -> float:
    """Return one of four, by comparisons in a row."""
    if -0.5 < x < 0.5 and not (y > 1.0 or y < -1.0):
        value = x
    elif x >= 0.5:
        value = 2.0 * y
    elif x == y:
        value = 0.0
    else:
        # what is left
        value = -x
    return value + FADING


def early(x: float, y: float) -> float:
    """Return before the end, in a branch of a branch."""
    if x < 0.0:
        if y < 0.0:
            return x * y
        x = -x
    y += x
    if y > 1.0:
        return y
    return x - y


def from_loop(x: float, y: float) -> float:
    """Return out of a loop."""
    total = x
    for k in range(_MANY):
        total += y / (k + 1)
        if total > 2.0:
            return total - k
        if total < -5.0:
            break
    return total


def counted(x: float, y: float) -> float:
    """Return a sum that counts down, and one that ends by itself."""
    total = 0.0
    for k in range(_FEW, -1, -1):
        if k % 2 == 1:
            continue
        total += x**k + k // 2
    left = abs(y)
    while left > 0.25:
        left *= 0.5
    return total + left


def swapped(x: float, y: float) -> tuple[float, float]:
    """Return the two numbers, the smaller one first."""
    if x > y:
        x, y = y, x
    return x, y


def exchanged(x: float, y: float) -> float:
    """Return elements of an array that change places at once, where which ones is known as it runs."""
    v = np.zeros(3)
    v[0], v[1], v[2] = x, y, x * y
    k = 0 if x > y else 1
    v[0], held = y + 1.0, v[k]
    v[k], v[k + 1] = v[k + 1], v[k]
    v[0], v[k] = x + 5.0, v[0] + 1.0
    v[k], v[0] = y + 7.0, v[0]
    (k, held), v[k] = (k + 1, held + x), v[0] + k
    v[0], held = held, weighted(v) + v[k]
    m = np.zeros((2, 2))
    m[0, 0], m[1, 0] = x, y
    m[k - 1, 0], held = held + 1.0, m[0, 0]
    return held + 2.0 * v[0] + 3.0 * v[1] + 5.0 * v[2] + m[0, 0] - m[1, 0]


def weighted(v: np.ndarray) -> float:
    return v[0] + 2.0 * v[1]


def outliving(x: float, y: float) -> float:
    """Return counts of loops behind them, and beside other uses of their names."""
    k = 5
    for _ in range(_FEW):
        y += 0.25 * _
    if x > y:
        for k in range(_FEW):
            x += k
            if x > 1.0:
                break
    x += 10.0 * k
    for j in range(2, -1, -1):
        x -= j * y
    x += j
    k = 2
    while k > 0:
        x += k
        k -= 1
    for k in range(int(abs(y))):
        x += k
    return x + 100.0 * k


def both(x: float, y: float) -> float:
    """Return what calls of functions of several values give."""
    low, high = swapped(x, y)
    (a, b), c = nested(low, high)
    return low * swapped(a, b)[1] + c


def nested(x: float, y: float) -> tuple[tuple[float, float], float]:
    return (x + y, x - y) if x + y > 0.0 else (y, x), min(x, y, 0.5)


def listed(x: float, y: float) -> float:
    """Return a sum over tuples and arrays whose places vary."""
    weights = (0.5, x, y, 2.0)
    held, rows = np.zeros(4), np.zeros((2, 3))
    for k in range(len(weights)):
        held[k] = weights[k] * (k + 1.0)
    fill(rows, x)
    total = 0.0
    for i in range(2):
        for j in range(3):
            total += rows[i, j] * held[i + j // 2]
    return total + summed(weights) + held[-1]


def fill(rows: np.ndarray, x: float) -> None:
    for i in range(2):
        for j in range(3):
            rows[i, j] = x * i - j


def summed(values: tuple[float, float, float, float]) -> float:
    found = 0.0
    for k in range(4):
        found += values[k]
    return found


def flags(x: float, y: float) -> float:
    """Return a sum of what is true."""
    inside = abs(x) <= 1.0
    rising = y > x
    both_hold = inside and rising
    count = 1 if both_hold else 0
    return float(count) + (0.25 if not inside else 0.125) + max(count, 2 - count)


def functions(x: float, y: float) -> float:
    """Return functions of math, at arguments where all have a value."""
    u = abs(x) + 0.1
    found = math.exp(-u) + math.expm1(x) + math.log(u) + math.log1p(u) + math.sqrt(u) + math.tanh(y) + math.hypot(x, y)
    found += math.copysign(u, y) + math.floor(x) + math.sin(x) * math.cos(y) + math.atan(x) + math.erf(y)
    return found + int(u) + (u**1.5) ** 2 + np.sign(y) + np.minimum(x, y) - np.clip(y, -0.5, 0.5)


def kept_names(x: float, y: float) -> float:
    """Return what variables give whose names are words of C, or those of functions that are called."""
    int_, double, swapped_, struct = x, y, x * y, 1.0
    early_ = early(double, int_)
    return early_ + swapped_ * struct


def kept_words(x: float, y: float) -> float:
    """Return out of a loop, beside variables with names of C, of MATLAB and of what the printer itself adds."""
    log, exp, fabs, done, result, kept_1 = x, y, x + y, 0.0, 1.0, 2.0
    log_, done_, end, zeros, chosen_1, value_, smaller = 0.5, 3.0, x - y, y, 0.25, 0.125, 4.0
    NAN, EXP_, main_double, pair_0, x_start = 0.2, 0.3, 0.4, 0.6, x
    pair = (x * y, x - y) if x > y else (y * y, x)
    for k in range(_FEW):
        done += math.exp(-abs(log)) * (k + 1.0)
        if done > fabs:
            x = done + max(exp, log_) if end > 0.0 else math.log(abs(zeros) + chosen_1)
            return x + pair[0] * pair[1]
    x, exp = exp, x
    result += kept_1 * done_ + min(value_, smaller) + pair[1] * pair_0
    return result + NAN + EXP_ + main_double + x_start + x - exp + end


def kept_outputs(x: float, y: float) -> tuple[float, float]:
    """Return two numbers by the names of functions that are called, out of a branch."""
    log, log_out = math.log(abs(x) + 1.0), y
    if y > 1.0:
        return log, log_out
    log_out, log = log, log_out * x
    return log, log_out


def both_words(x: float, y: float) -> float:
    """Return the same, called, in a variable of such a name."""
    log = kept_outputs(x, y)
    sqrt, exp = kept_outputs(y, x)
    return log[0] * math.log(2.0) + log[1] + sqrt * math.exp(exp / (1.0 + abs(exp)))


def late_whole(x: float, y: float) -> float:
    """Return a number that is whole at first."""
    total = 0
    for k in range(3):
        total = total + x * k
    last = math.inf if y > 1e9 else y
    return total + last


def from_inner_loop(x: float, y: float) -> tuple[float, float]:
    """Return out of a loop in a loop, and out of one whose round goes on behind an inner loop."""
    for i in range(3):
        for j in range(2, 0, -1):
            if x * i > y + j - 1.0:
                return float(i), float(j)
        left = y
        while left > 0.5:
            left -= 0.25 + abs(x)
            if left < 0.6 and i > 0:
                return left, x
        x += 0.125 * i
    return x, y


def once_in_a_branch(x: float, y: float) -> float:
    """Return arguments that one branch changes, to what stays as it is and to what a call gives."""
    before = x
    if x < 0.0:
        x = y
    elif x > 1.0:
        y = swapped(x, 2.0)[0]
    pair = (x, y)
    for k in range(2):
        if y > k:
            y = FADING
    return x - y * before + pair[0] * pair[1]


def either_of(x: float, y: float) -> float:
    """Return a sum of what is one of two arguments, or one of them and a number."""
    low, high = (x, y) if x < y else (y, x)
    one, other = (x * y, 1.0) if high > 0.5 else ((0.25, y) if low > -0.5 else (y, low))
    both = (x, y) if one < other else (y, x)
    return low + 2.0 * high - one * other + 3.0 * both[0] + both[1]


def signs(x: float, y: float) -> float:
    """Return negatives of negatives, and what stands beside them."""
    return x - -(-y) * -(x - y) - (-(-(-x)) - (y - x)) + x / (y * y + 1.0) / -(-2.0 - abs(x)) - (x - (y - 1.0))  # noqa: B002


def nested_places(x: float, y: float) -> float:
    """Return items from the end, of a row, and of places that are computed of constants."""
    count = 3
    rows, weights = np.zeros((2, 3)), (x, y, 0.5, x * y)
    rows[1, count - 1] = weights[-1] + weights[len(weights) - 3]
    rows[0, 0] += x
    rows[0, 0] /= 2.0
    total = weights[count - 3] * 4.0 + rows[1][2]
    for k in range(count):
        total += rows[k % 2, k] * weights[k + 1] + k // 2 - 7 % 4
    return total - rows[0, 0]


CASES = (
    exchanged,
    outliving,
    from_inner_loop,
    once_in_a_branch,
    either_of,
    signs,
    nested_places,
    choice,
    chain,
    early,
    from_loop,
    counted,
    swapped,
    both,
    nested,
    listed,
    flags,
    functions,
    kept_names,
    kept_words,
    kept_outputs,
    both_words,
    late_whole,
)


def with_list(x: float) -> float:
    values = [x, 2.0]
    return values[0]


def with_keyword(x: float, y: float) -> float:
    return choice(x, y=y)


def with_string(x: float) -> float:
    return x if str(x) else 0.0


def without_value(x: float) -> float:
    if unknown > 0.0:  # type: ignore[name-defined]  # noqa: F821
        x = 0.0
    return x


def of_two_kinds(x: float) -> float:
    flag = x > 0.0
    flag = x
    return flag


def over_list(x: float) -> float:
    total = 0.0
    for value in (x, 1.0):
        total += value
    return total


def with_slice(x: float) -> float:
    values = np.zeros(3)
    return values[:2][0] + x


OUTSIDE = {
    with_list: "values = [x, 2.0]|'[x, 2.0]'",
    with_keyword: "by their places",
    with_string: "str(x)",
    without_value: "unknown has no value",
    of_two_kinds: "keeps one kind",
    over_list: "range(...)",
    with_slice: "':2'",
}
