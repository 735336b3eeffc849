"""Every threshold of an examination, and what set it."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Policy:
    """What an effect has to show beside the best law.

    Shares are of the squared error that no law makes. "Nulls" and "planted" are generated records of four laws
    (regularised Bingham with a Maxwell element, tanh, LuGre, Iwan) against six bases, without and with one effect.
    """

    # Standard errors from neutral: ten candidates reach 4 by chance in less than 1 of 1000 data sets
    clear: float = 4.0
    # … and of what takes at least this share, on conditions left out too: nulls take .14 at most
    most: float = 0.6
    clear_of_most: float = 2.5
    # Share to take; of 120 nulls the largest was .14, of 114 planted effects the smallest .21
    share: float = 0.15
    # … or this share, if it shows by so many standard errors: of 116 nulls none took .075 and showed by more than 4,
    # but one that took .68
    share_if_plain: float = 0.10
    plain: float = 8.0
    # Share to take on conditions left out, the law from all: chance takes less than nothing there
    kept: float = 0.10
    # … of a typical one, the law from the others too: false names under a memory longer than assumed take less
    held: float = 0.05
    # Largest force over the range: below, sensors of .5 % accuracy make what is seen
    size: float = 0.006
    # Share of its sensitivity's square that no law takes; below, rounding and smoothing decide
    left: float = 0.0005
    # Half the 95 % interval of its largest force, over that force: true effects .44 at most; a name under a memory
    # longer than assumed 1.2, since laws that leave as little differ by that much
    unsure: float = 0.7
    # Sensitivity that lies so far in the base's own linear terms is the base's: a spring beside a model with a spring
    owned: float = 0.999
    # Share of the least share from which an effect is worth a refinement (time)
    worth_refining: float = 0.5
    # Effects refined in a round, and named at most (time; two at once are the most that was planted)
    most_refined: int = 4
    most_named: int = 4
    # Rounds in which an effect is weighed by what the law leaves beside it (time; two are enough to settle)
    most_weighings: int = 3
    # Where no effect alone is there, pairs are refined that could take this share and so many times what both take
    # alone: a spring and a mass that oppose each other at one frequency
    pair: float = 0.4
    gain_of_pair: float = 1.3
    most_pairs: int = 2
    # A rival leaves at most so many times the winner's squared error
    rival: float = 1.3
    # One with fewer numbers wins if it leaves at most so many times the squared error
    simpler: float = 1.1
    # Share of what an effect takes that another must be able to take to be tried in its place once all are there
    instead: float = 0.6
    most_swaps: int = 3
    # Share of a mass's that a force that is early takes, from which the two are not told apart: true masses take at
    # most .10, early forces .85 and more
    early: float = 0.3
    # … or up to this share if it takes no more than this of its own beside the mass, over what that takes beside it:
    # true masses .66 and .04 at most, early forces 1.06 and 1.5 at least
    early_at_most: float = 0.8
    early_beyond: float = 0.3
    # Factor on standard errors and shares that are asked for beside a law of twice the memory: it takes a part of every
    # sensitivity, so that a true mass keeps half of its standard errors
    further: float = 0.5
    # Share of an effect's largest force that such a law may take over: at most .07 of true effects, and .17 of a spring
    # that stands for memory
    drifts: float = 0.1
    # A law that remembers for longer is no rival if it leaves so many times what the shorter leaves with the effect;
    # where long memories made springs it left .15 to .99 times as much
    no_rival: float = 1.15
    # Share that flexible terms must take, on conditions left out, for an invariance to be called broken without a name
    generic: float = 0.25
    # Rows for each column of the nuisance: below, what is left out cannot be predicted from the others
    rows_for_a_column: float = 3.0
    # Groups of samples from which an error is told: fewer conditions are cut into pieces
    fewest_groups: int = 6
    pieces: int = 8

    @property
    def beside_longer_memory(self) -> "Policy":
        """The same with what is asked for beside a law that remembers for longer."""
        lowered = ("clear", "clear_of_most", "share", "share_if_plain", "plain", "kept", "held")
        factors = {name: self.further * getattr(self, name) for name in lowered}
        return replace(self, unsure=self.unsure / self.further, **factors)


STANDARD = Policy()
