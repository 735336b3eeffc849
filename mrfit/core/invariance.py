"""Invariances that every rheological law keeps, as specifications and files of discoveries name them."""

from enum import StrEnum


class Invariance(StrEnum):
    """Invariance that every rheological law keeps; an effect that breaks one of these can be told from any law.

    The force reverses with the motion; it does not know where in the stroke, when, and how warm the specimen is; it
    follows the current at once; it is made by the motion so far, of which only a short part is remembered.
    """

    ODDNESS = "oddness"
    POSITION = "position"
    TIME = "time"
    TEMPERATURE = "temperature"
    CURRENT = "current-at-once"
    MEMORY = "memory"
