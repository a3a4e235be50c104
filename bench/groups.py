"""What is measured, in the order of the page."""

from __future__ import annotations

from typing import NamedTuple


class Group(NamedTuple):
    """A heading of the page, what to know before reading, and the files that measure."""

    title: str
    text: str
    parts: tuple[str, ...]


GROUPS = (
    Group(
        "One step, four ways to feed it",
        "The same recursion, called for each sample, over a record, and for a fleet.",
        ("ways",),
    ),
    Group(
        "Fleets and streams",
        "Many series, one sample or one batch at a time.",
        ("fleets", "fleet_files", "calls"),
    ),
    Group(
        "The service",
        "`driftwise live` from a message to what is on disk: decoding, joining, estimating, committing.",
        ("live",),
    ),
    Group(
        "The same job done by others",
        "Same model, same data; answers are compared before clocks are. The opponent `bench/joint.c` is the same U D "
        "recursion with run-time sizes; `bench/lanes.c` knows the order and takes one series or eight at a time. The "
        "other filters get the matrices of every sample, built beforehand.",
        ("records", "lanes", "rivals", "recursive"),
    ),
    Group(
        "What breaks whom",
        "One missing number, and a prior that says nothing.",
        ("failures",),
    ),
    Group(
        "How cost grows",
        "With the order, the length of the record, the number of series, the batch, and the threads.",
        ("scaling", "lengths"),
    ),
    Group(
        "How far from the machine's limit",
        "",
        ("roofline",),
    ),
    Group(
        "Starting, and room",
        "Processes as a shell starts them, with and without a compiled cache; bytes of a state.",
        ("startup", "sizes"),
    ),
    Group(
        "By which compiler",
        "Kernels are Python, translated to C; numba compiles the same source and is the reference.",
        ("engines",),
    ),
    Group(
        "What each choice costs",
        "A memory, a noise model, a smoother, several outputs, continuous time, matrices of your own, tracks, beside "
        "the plain filter.",
        ("choices", "memories", "smoothing", "outputs", "continuous", "observers", "state_space", "tracks", "evidence"),
    ),
    Group(
        "Detecting jumps",
        "Delays at a matched rate of false alarms, and what a detector costs.",
        ("detectors",),
    ),
)
PARTS = tuple(part for group in GROUPS for part in group.parts)
