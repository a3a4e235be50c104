"""Write docs/history.md: a row for each commit that moved the benchmarks, the score or a judgement.

python scripts/history.py            # from the repository's own history: numbers as each page had them at that commit
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGES = ("docs/benchmarks.md", "docs/score.md", "docs/judged.md")
TOTALS = re.compile(r"(\d+) (?:budgets )?met, (\d+) missed|(\d+) of (\d+) targets met|(\d+) budgets? met")
MEAN = re.compile(r"geometric mean of the ratios: ([\d.]+)")
TOLD = re.compile(r"share told of the jumps that the oracle tells: ([\d.]+)")


def git(*words: str) -> str:
    """Return what git says."""
    done = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=False)
    return done.stdout


def totals(text: str) -> str:
    """Return how many promises a page says are met."""
    found = TOTALS.search(text)
    if not found:
        return ""
    a, b, c, d, e = found.groups()
    return f"{a} of {int(a) + int(b)} met" if a else f"{c} of {d} met" if c else f"{e} met"


def last(pattern: re.Pattern, text: str) -> str:
    """Return the last number of a kind on a page to which judgements are appended."""
    found = [next(filter(None, match)) if isinstance(match, tuple) else match for match in pattern.findall(text)]
    return found[-1] if found else ""


def rows() -> list[tuple[str, ...]]:
    """Return (date, commit, subject, budgets, targets, mean ratio, told), the newest first; equal numbers once."""
    found: list[tuple[str, ...]] = []
    for line in git("log", "--reverse", "--date=short", "--format=%h%x09%ad%x09%s", "--", *PAGES).splitlines():
        commit, date, subject = line.split("\t")
        bench, score, judged = (git("show", f"{commit}:{page}") for page in PAGES)
        numbers = totals(bench), totals(score), last(MEAN, judged), last(TOLD, judged)
        if any(numbers) and (not found or numbers != found[-1][3:]):
            found.append((date, commit, subject.replace("|", "\\|"), *numbers))
    return found[::-1]


def main() -> int:
    """Write the page."""
    head = "| date | commit | what was done | speed | recordings | mean ratio | jumps told |"
    lines = [
        "# History of what was measured",
        "",
        "Written by `python scripts/history.py`: a row for each commit that moved the [benchmarks](benchmarks.md) "
        "(budgets met), the [score](score.md) on recordings (targets met), or what was [judged](judged.md) of "
        "`AutoMemory` on drawn systems (error over that of who knows, geometric mean; share of jumps told).",
        "",
        head,
        "|---|---|---|---|---|---|---|",
        *("| " + " | ".join(row[:1] + (f"`{row[1]}`",) + row[2:]) + " |" for row in rows()),
    ]
    (ROOT / "docs" / "history.md").write_text("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
