"""The seed that nobody could see while choosing, and the page on which every judgement stays.

The judging seed is the first eight hexadecimal digits of the last commit that changed a constant, or a system. A dirty
tree is refused, and so is a second judgement of the same commit. Rows are only ever appended.
"""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

from driftwise.engine.errors import InputError

from .field import Line, Total, by_size, by_trouble, total

ROOT = Path(__file__).parents[4]
PAGE = ROOT / "docs" / "judged.md"
CHOOSING = 0  # the seed to work with
CHOSEN = (
    *("additive", "at_rest", "auto", "auto_answers", "auto_constants", "auto_shown", "auto_state", "lone_jump"),
    *("robust_start", "second_start", "first_samples", "less_noise", "noise_level", "wind_up", "suspicion"),
    *("trial", "trial_state", "verdict", "bank", "modes", "mixing", "likelihood_drift", "unknown_drift", "sensitivity"),
    *("moments", "resolution", "retrospect", "set_free"),
)
DRAWN = "system", "drawing", "simulation", "told", "measured"
CONSTANTS = (  # where a number stands that was chosen on the choosing systems, or that makes and measures systems
    *(f"src/driftwise/memory/{name}.py" for name in CHOSEN),
    *(f"studies/driftwise_studies/score/worlds/{name}.py" for name in DRAWN),
)
GOALS = (  # words, how to read a `Total`, least, most
    ("geometric mean of the ratios", lambda t: t.mean, 0.0, 1.12),
    ("95th percentile of the ratios", lambda t: t.high, 0.0, 1.35),
    ("worst ratio", lambda t: t.worst, 0.0, 1.8),
    ("share told of the jumps that the oracle tells", lambda t: t.told / max(t.tellable, 1), 0.85, 1.0),
    ("false jumps a record whose parameters rest", lambda t: t.false, 0.0, 0.02),
    ("share that the 95 % bars hold", lambda t: t.inside, 0.92, 0.97),
    ("the same within 15 samples after a jump", lambda t: t.after, 0.90, 1.0),
)
KNOWN = (("mean ratio of the eight systems of docs/unknown-noise.md", 1.06), ("their worst", 1.12))


def verdicts(found: Total, known: tuple[float, float] | None = None) -> list[tuple[str, bool]]:
    """Return each goal in words, with the number, and whether it is met; ``known``: mean and worst of `KNOWN`."""
    made = []
    for words, read, least, most in GOALS:
        value = read(found)
        span = f"at most {most:g}" if not least else f"at least {least:g}" if most == 1.0 else f"{least:g} to {most:g}"
        made.append((f"{words}: {value:.3f} ({span})", bool(least <= value <= most)))
    for (words, most), value in zip(KNOWN, known or ()):
        made.append((f"{words}: {value:.2f} (at most {most:g})", round(value, 2) <= most))
    return made


def git(*words: str) -> str:
    """Return what git says."""
    done = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True)
    if done.returncode:
        raise InputError(f"judging needs the repository's history: git {words[0]} said {done.stderr.strip()!r}")
    return done.stdout.strip()


def seed(files: Sequence[str] = CONSTANTS) -> tuple[str, int]:
    """Return the last commit that changed one of the files, and the seed that it gives.

    Raises
    ------
    InputError
        Where the tree is dirty or its history is cut short.
    """
    if changed := git("status", "--porcelain"):
        raise InputError(f"commit first: what is judged must be what is written down. Changed:\n{changed}")
    if git("rev-parse", "--is-shallow-repository") == "true":
        raise InputError("the history is cut short, so that the commit of the last change is not known")
    commit = git("log", "-1", "--format=%H", "--", *files)
    return commit, int(commit[:8], 16)


def title(commit: str, systems: int, records: int) -> str:
    """Return the line that a judgement begins with."""
    return f"## {commit[:8]}: {systems} systems, {records} records"


def refuse_twice(line: str, page: Path = PAGE) -> None:
    """Raise where what this title says was judged before."""
    if page.exists() and line in page.read_text(encoding="utf-8").splitlines():
        raise InputError(f"{line.split()[1][:-1]} is judged already, see {page.name}: no number has changed since")


def write(name: str, text: str, page: Path = ROOT / "docs" / "worlds.md") -> None:
    """Put tables between the markers of that name on a page."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, rest = page.read_text(encoding="utf-8").split(begin)
    page.write_text(f"{before}{begin}\n{text.rstrip()}\n{end}{rest.split(end)[1]}", encoding="utf-8")


def append(parts: Sequence[str], page: Path = PAGE) -> Path:
    """Add the lines of a judgement at the end of the page, and return the page."""
    with page.open("a", encoding="utf-8") as file:
        file.write("\n".join(["", *parts]) + "\n")
    return page


def judgement(commit: str, seed: int, records: int, lines: list[Line], name: str, known) -> list[str]:
    """Return the lines that say how systems were judged."""
    told = [f"* {'met' if good else '**missed**'}: {words}" for words, good in verdicts(total(lines, name), known)]
    return [
        title(commit, len(lines), records), "", f"Seed {seed} = 0x{commit[:8]}; `{name}`.", "", *told, "",
        by_trouble(lines, name), by_size(lines, name).rstrip(),
    ]  # fmt: skip
