"""The error a user meets at the door."""

__all__ = ["InputError"]


class InputError(ValueError):
    """Data or a setting handed over by the user cannot be used; the message says which, why and the likely cause."""
