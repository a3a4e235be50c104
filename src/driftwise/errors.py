"""The error a user meets at the door."""

__all__ = ["CommandError", "InputError"]


class InputError(ValueError):
    """Data or a setting handed over by the user cannot be used; the message says which, why and the likely cause."""


class CommandError(InputError):
    """An option of a command cannot be what it is; no data were looked at."""
