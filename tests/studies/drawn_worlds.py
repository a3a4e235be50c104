"""Drawn worlds, for tests."""

from collections.abc import Sequence
from functools import cache

from driftwise_studies.score import worlds

draw = cache(worlds.draw)


class Drawn(Sequence):
    """Three hundred worlds, each drawn when a test first asks for it: importing a test file draws none."""

    def __len__(self):
        return 300

    def __getitem__(self, place):
        numbers = range(len(self))[place]
        return draw(0, numbers) if isinstance(numbers, int) else [draw(0, number) for number in numbers]


DRAWN = Drawn()
