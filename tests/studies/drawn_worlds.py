"""Drawn worlds, for tests."""

from driftwise_studies.score import worlds

DRAWN = [worlds.draw(0, number) for number in range(300)]
