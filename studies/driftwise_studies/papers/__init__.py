"""The papers' experiments, run again: `driftwise reproduce NAME`."""

from __future__ import annotations

import importlib

from driftwise.engine.errors import InputError

PAPERS = {  # module, and how many records it was checked with
    "salut1979": ("driftwise_studies.papers.salut1979", 300),
    "perriot1981": ("driftwise_studies.papers.perriot1981", 500),
    "abid2008": ("driftwise_studies.papers.abid2008", 400),
    "tian2009": ("driftwise_studies.papers.tian2009", 200),
    "radar": ("driftwise_studies.papers.radar", 300),  # draws its own
    "policies": ("driftwise_studies.papers.policies", 200),
}


def reproduce(name: str, seeds: int | None = None, say=lambda title: None):
    """Return the `Reproduction` of a paper: sections with verdicts, tables and figures.

    Parameters
    ----------
    name : a key of ``PAPERS``
    seeds : number of simulated records of the Monte Carlo parts, by default as many as the paper's checks were set
        with; tolerances widen with fewer
    say : called with the name of each part before it runs

    Raises
    ------
    InputError
        Where there is no such reproduction, or too few records.
    """
    if name not in PAPERS:
        raise InputError(f"there is no reproduction called {name!r}; there are: {', '.join(PAPERS)}")
    module, checked = PAPERS[name]
    seeds = checked if seeds is None else seeds
    if seeds < 20:
        raise InputError(f"seeds must be at least 20 (fewer judge nothing), got {seeds}")
    return importlib.import_module(module).run(seeds, say)
