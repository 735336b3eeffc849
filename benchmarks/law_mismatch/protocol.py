"""Which cases are run: groups, splits, and how every case follows from its number alone."""

from dataclasses import dataclass
from zlib import crc32

import numpy as np

from benchmarks.law_mismatch.faults import CLASS, LIBRARY, OUTSIDE
from benchmarks.law_mismatch.laws import FAMILIES

BASES = ("bingham", "biviscous", "tanh", "guo", "boucwen", "spencer")
SPLITS = ("development", "evaluation")
# bases that have a spring of their own
OWN_SPRING = {"tanh", "boucwen", "spencer"}
# bases of a family's own form, but for the current: these are not asked
SAME_FORM = {"tanh": {"tanh", "guo"}}
COUNTS = {"null": 600, "single": 252, "pair": 120, "long-memory": 120, "outside": 60}
GROUPS = (*COUNTS, "planted", "real")
PAIRS = tuple((a, b) for k, a in enumerate(LIBRARY) for b in [*LIBRARY][k + 1 :] if CLASS.get(a, a) != CLASS.get(b, b))


@dataclass(frozen=True)
class Case:
    """One run of the benchmark.

    Attributes
    ----------
    name
        Unique, with the split; also the file's name.
    split, group, base
        As on the command line.
    hidden
        Effects, by the names of ``faults``.
    family, seed, memory, conditions
        Of a generated specimen; 0 conditions leave their number to its seed.
    records, share
        Set of real records, and the size of what is planted over the range.
    """

    name: str
    split: str
    group: str
    base: str
    hidden: tuple[str, ...] = ()
    family: str = ""
    seed: int = 0
    memory: float = 1.0
    conditions: int = 0
    records: str = ""
    share: float = 0.0

    @property
    def inside(self) -> frozenset[str]:
        """What there is to be named."""
        return frozenset(LIBRARY[h][0] for h in self.hidden if h in LIBRARY)


def generated(split: str, group: str, count: int, bases: tuple[str, ...], each: int, first: int = 0) -> list[Case]:
    """Return ``count`` specimens of a group, each asked of ``each`` bases drawn from those that may be asked.

    Specimens are numbered; those from ``first`` on are others than those before.
    """
    cases: list[Case] = []
    for number in range(first, first + count):
        title = f"{split}-{group}-{number:04d}"
        seed = crc32(title.encode())
        rng = np.random.default_rng([seed, 0])
        families = [n for n, f in FAMILIES.items() if f.split == split and (group != "long-memory" or f.remembers)]
        family = families[number % len(families)]
        hidden = _hidden(group, number, rng)
        memory = float(rng.uniform(0.25, 1.0)) if group == "long-memory" else 1.0
        barred = SAME_FORM.get(family, set()) | (OWN_SPRING if "gas-spring" in hidden else set())
        allowed = [b for b in bases if b not in barred]
        for base in rng.permutation(allowed)[:each]:
            cases.append(Case(f"{title}-{base}", split, group, str(base), hidden, family, seed, memory))
    return cases


def _hidden(group: str, number: int, rng: np.random.Generator) -> tuple[str, ...]:
    if group == "single":
        # the families turn with the number: steps of a whole round shift the effects against them
        return ([*LIBRARY][(number + number // 36) % len(LIBRARY)],)
    if group == "pair":
        return PAIRS[int(rng.integers(len(PAIRS)))]
    if group == "outside":
        return (OUTSIDE[(number + number // 20) % len(OUTSIDE)],)
    return ()
