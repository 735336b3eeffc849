"""A fit put to use: the current for a force, forces tracked, a quarter car, the flux linkage of a coil.

``mrfit.apply.invert``, ``track``, ``quarter_car``, ``damper``, ``coil`` and what they take; ``dir(mrfit.apply)`` lists them.
"""
