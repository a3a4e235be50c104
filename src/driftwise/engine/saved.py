"""Files that driftwise wrote and reads again: whole, or refused in one sentence, whatever is in them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from .errors import InputError


@contextmanager
def reading(path, writer: str) -> Iterator[None]:
    """Refuse a file that ``writer`` did not write or that was damaged since, in words that name the file.

    A damaged file can make anything fail that is built from it: whatever it is, the caller need know one error.
    """
    try:
        yield
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file. Was it saved elsewhere?") from None
    except InputError as error:
        raise InputError(f"{path} cannot be used: {error}") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror or error})") from None
    except Exception as error:
        kind = type(error).__name__
        raise InputError(f"{path} is no file that {writer} wrote, or it was damaged since ({kind})") from None


def check_states(states: np.ndarray, unknown: tuple[str, ...]) -> np.ndarray:
    """Return saved states; refuse numbers that are not finite, but in the parts where NaN says ``unknown``."""
    for part in (name for name in states.dtype.names or () if name not in unknown):
        numbers = np.frombuffer(states[part].tobytes())
        if (wrong := numbers[~np.isfinite(numbers)]).size:
            raise InputError(f"{part} of its state is {wrong[0]}: states are finite")
    return states
