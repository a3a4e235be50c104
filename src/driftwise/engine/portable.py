"""Objects that hold compiled loops and are sent to other processes all the same."""

from functools import cached_property


class Portable:
    """Pickled and copied without what its cached properties hold, compiled loops among it: they come again."""

    def __getstate__(self):
        return {k: v for k, v in vars(self).items() if not isinstance(getattr(type(self), k, None), cached_property)}

    def carried_over(self, rows):
        """Return rows of states, (.., numbers), of a former layout of its own as they are laid out now."""
        return rows

    def carried_table(self, table):
        """Return the table of a trace that was written with such states."""
        return table
