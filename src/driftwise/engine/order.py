"""Numbers in order, as far as a loop asks for it."""

from .dispatch import kernel


@kernel
def smallest(a, n, at):
    """Return that of the first n which stands at ``at`` when they are in order; it moves them (Hoare's find)."""
    low, high = 0, n - 1
    while low < high:
        pivot, i, j = a[at], low, high
        while i <= j:
            while a[i] < pivot:
                i += 1
            while pivot < a[j]:
                j -= 1
            if i <= j:
                a[i], a[j] = a[j], a[i]
                i += 1
                j -= 1
        if j < at:
            low = i
        if at < i:
            high = j
    return a[at]
