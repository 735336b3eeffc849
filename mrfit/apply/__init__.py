"""A fit put to use: the current for a force, forces tracked, a quarter car, the flux linkage of a coil.

``dir(mrfit.apply)`` lists the functions, such as ``invert``, ``track`` and ``quarter_car``, and the classes they take.
"""
