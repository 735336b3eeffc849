"""Specimens with hidden forces of forms outside the library, made without any code of mrfit or of the other rigs."""
