"""Every threshold of an examination, and what set it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Policy:
    """What an effect has to show beside the best law.

    Shares are of the squared error that no law makes. "Nulls" and "planted" are generated records of four laws
    (regularised Bingham with a Maxwell element, tanh, LuGre, Iwan) against six bases, without and with one effect.
    """

    # Standard errors from neutral: ten candidates reach 4 by chance in less than 1 of 1000 data sets
    clear: float = 4.0
    # Share to take; of 120 nulls the largest was .14, of 114 planted effects the smallest .21
    share: float = 0.15
    # Share to take on conditions left out, the law from all: chance takes less than nothing there
    kept: float = 0.10
    # … the law from the others too: removes laws that remember longer than assumed (2 of 3), costs 1 of 268 planted
    held: float = 0.05
    # Largest force over the range: below, sensors of .5 % accuracy make what is seen
    size: float = 0.006
    # Share of its sensitivity's square that no law takes; below, rounding and smoothing decide
    left: float = 0.0005
    # Sensitivity that lies so far in the base's own linear terms is the base's: a spring beside a model with a spring
    owned: float = 0.999
    # Share of the least share from which an effect is worth a refinement (time)
    worth_refining: float = 0.5
    # Effects refined in a round, and named at most (time; two at once are the most that was planted)
    most_refined: int = 4
    most_named: int = 4
    # A rival leaves at most so many times the winner's squared error
    rival: float = 1.3
    # Share of a mass's that a force that is early takes, from which the two are not told apart: true masses take at
    # most .10, early forces .85 and more
    early: float = 0.3
    # Share that flexible terms must take, on conditions left out, for an invariance to be called broken without a name
    generic: float = 0.25
    # Groups of samples from which an error is told: fewer conditions are cut into pieces
    fewest_groups: int = 6
    pieces: int = 8


STANDARD = Policy()
