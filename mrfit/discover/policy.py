"""Every threshold of a discovery, and what set it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Policy:
    """What the evidence has to show.

    An error is the RMS error in multiples of the noise floor, 1 where only noise is left; a gap is its square less 1.
    Unless said otherwise errors are those on held-out conditions. A word in brackets is the stratum of the benchmark of
    hidden effects, ``python -m benchmarks.discovery``, whose cases the rule is for; its page has the rates that
    all values together reach.

    How evidence is measured, such as bins, regions and the length of searches, stands where it is measured.
    """

    # --- what the data must hold
    # Training conditions of periodic tests: from one condition a missing effect cannot be told from the base (little)
    fewest_training: int = 2
    # Range of the current, in A, below which the base's parameters are taken as constant (null)
    least_current_range: float = 0.1
    # Share of the range below which no error counts: almost noiseless channels would make any form wrong (null)
    least_floor: float = 2e-4

    # --- what is worth a refit
    # Share of a sensitivity left after projection below which the base has the effect already (absorbed)
    absorbed: float = 0.02
    # Share of the squared training error that a candidate must take to first order (time: 60 s for one discovery)
    worth_a_refit: float = 1e-3
    # Candidates that are refitted in a round, and rounds (time: 60 s for one discovery)
    most_refits: int = 7
    most_rounds: int = 4

    # --- proof of one effect
    # Standard errors from neutral: twenty candidates reach 3 by chance in 5 of 100 data sets, 4 in 1 of 1000
    clear: float = 4.0
    # Standard score of the fall in squared error: chance passes it in 2 of 100, beside ``clear`` in far fewer
    holdout_clear: float = 2.0
    # Neither is asked of what takes this share of all that is left where the error stands so far above noise: while a
    # second effect is missing its doings widen every interval, and a few bursts have no high score (pair)
    overwhelming: float = 0.8
    above_noise: float = 1.5
    # … but this many standard errors: an effect at neutral takes nothing, a better fit of the rest does (null)
    not_neutral: float = 1.0
    # Of the first effect fewer are enough if it takes half the gap on conditions it was not fitted to (single)
    half: float = 0.5
    clear_of_half: float = 3.0
    # Least share of the squared error to take: of 1000 irrelevant regressors none has that and a clear parameter
    least_gain: float = 0.01
    # Least share of the base's gap for an effect, and for the look-alike of one that is in already (outside, pair) …
    least_gap: float = 0.02
    least_gap_of_alike: float = 0.1
    # … or, where it takes so much of the gap that is left and is no look-alike, so much of the base's (pair)
    most_of_the_rest: float = 0.5
    least_gap_of_the_rest: float = 0.005

    # --- rivals
    # Cosine of projected sensitivities from which a wrong form of one effect may well look like the other (untellable)
    alike: float = 0.8
    # Share of the winner's fall in squared error that a rival must take to be looked at (untellable)
    rival_takes: float = 0.35
    # A rival that leaves so many times what the winner leaves, and significantly more, is not its equal (untellable)
    far_behind: float = 2.0
    # A shape parameter this near an end of its range says no more than that it is large, or small (single: stribeck)
    end_of_range: float = 0.05
    # Rivals that an effect faces again once others are beside it (time: 60 s for one discovery)
    most_rivals: int = 4
    # Share of what is left that an effect must be able to take to face one it is not known to be mistaken for (pair)
    worth_a_duel: float = 0.05

    # --- pairs
    # Pairs are looked for where more than this share of the base's gap is left (pair)
    left_for_two: float = 0.05
    # Pairs that are refitted, until one leaves no more than this share of the gap (time: 60 s for one discovery)
    most_pairs: int = 8
    little_left: float = 0.01

    # --- shadows
    # An effect must take more than this times what all together leave (outside)
    above_the_rest: float = 0.5
    # Effects that together leave more than this share of the gap may be shadows of something else (outside) …
    left_by_shadows: float = 0.2
    # … and already from this share on where the error left is so many times the noise (outside, other-law)
    left_in_sight: float = 0.05
    in_sight: float = 2.5
    # Change from middle to end of a record, as a share of the strength and in standard errors, that is a drift: a
    # resistance that settles by 0.5 % is none of a steady effect, a steady one is named (tests/discover, slow)
    drifts: float = 0.2
    drift_clear: float = 4.0

    # --- is something left without a name?
    # Errors that repeat from cycle to cycle, this many times the noise, leave no doubt (outside)
    far_above: float = 2.0
    # … nor do smaller ones from here on, if a model that knows no physics predicts this share of their square …
    clearly_above: float = 1.25
    structure: float = 0.15
    # … or if they are so far above a floor of white noise that no colour of noise excuses them (null)
    beyond_any_colour: float = 8.0
    # What does not repeat is no noise if in most of so many records of so many cycles its power differs by this factor
    # between the halves of a cycle with large and small |output|, by so many standard errors (outside: gap-vibration)
    fewest_records: int = 5
    fewest_cycles: int = 4
    power_ratio: float = 1.35
    power_clear: float = 2.0

    # --- where the law itself may be off
    # Share of the gap that a base with its effects may leave and still be taken as exact …
    left_open: float = 0.2
    # … and where the error left is in sight of a reader: where the base is exact, effects that are named rightly leave
    # less than .003 of it and 1.1 times the noise; wrong ones beside a wrong law left .05 and 6 times
    left_open_in_sight: float = 0.01
    # Multiples of a floor above which a law is examined although little of the gap is left: right names leave 1.1
    at_the_floor: float = 1.2
    # Error left over that of the best law, up to which a base with its effects is taken as exact where its floor is a
    # guess or is not quite reached
    as_good: float = 1.5
    # Share of what an effect takes that something else takes beside it which breaks the same invariance, from which the
    # effect may be a part of that: beside an asymmetry that was cavitation .13 and more (outside: cavitation)
    broken_beside: float = 0.08
    # Share of the base's gap that another law must take to be told of; laws that are fitted have at most so many
    # parameters, and so many are told of (time: 60 s for one discovery)
    law_takes: float = 0.2
    most_law_parameters: int = 10
    most_laws: int = 3
    # Errors of another law, in multiples of the noise floor, up to which it is offered as a base to be taken as exact
    near_floor: float = 2.0
    # … and is taken so, where all records together have at most so many samples (time: 60 s for one discovery)
    most_samples_again: int = 100_000

    # --- what is said of it
    # Share of the gap without a name above which its place and shape are told; regions listed (a page to read)
    worth_telling: float = 0.1
    most_regions: int = 8
    # Share of the error beyond that of the samples from which a region is worth a sentence, and how many are said
    region_told: float = 0.02
    most_said: int = 3
    # Share of the squared error that a shape must predict, and a loop beyond the curve, to be spoken of (outside); less
    # than the last one is nothing
    shape_told: float = 0.1
    memory_told: float = 0.1
    nothing: float = 0.005
    # Held-out tests that leave the range of the training tests by more than this share of the larger one extrapolate
    extrapolates: float = 0.1


STANDARD = Policy()
