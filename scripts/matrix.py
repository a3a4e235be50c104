"""Print which memory goes with which model, every pair tried, and why the others do not: the table of docs/memory.md.

python scripts/matrix.py            # prints it; exit code 1 where a pair is not what the table of refusals says
python scripts/matrix.py --write    # writes it into docs/memory.md
python scripts/matrix.py --check    # exit code 1 where that page has another table; tries nothing
"""

import sys
from pathlib import Path

from driftwise.analysis.matrix import MEMORIES, MODELS, YES, pairs, said, tried

PAGE = Path(__file__).parent.parent / "docs" / "memory.md"
BEGIN, END = "<!-- written by scripts/matrix.py -->\n", "<!-- end -->\n"


def columns() -> dict[tuple[str, ...], list[str]]:
    """Return the models that say the same of every memory, by what they say."""
    found: dict[tuple[str, ...], list[str]] = {}
    for model in MODELS:
        found.setdefault(tuple(said(model, memory) for memory in MEMORIES), []).append(model)
    return found


def table() -> str:
    """Return the matrix: models that take the same share a column; behind it a sentence for each number."""
    groups = columns()
    sentences = list(dict.fromkeys(answer for answers in groups for answer in answers if answer != YES))
    heads = [", ".join(f"`{name}`" for name in names) for names in groups.values()]
    lines = [f"| memory | {' | '.join(heads)} |", "|---" * (len(groups) + 1) + "|"]
    for at, memory in enumerate(MEMORIES):
        cells = [YES if said[at] == YES else f"no ({sentences.index(said[at]) + 1})" for said in groups]
        lines.append(f"| `{memory}` | " + " | ".join(cells) + " |")
    lines += ["", *(f"{i}. {sentence}." for i, sentence in enumerate(sentences, 1))]
    return "\n".join(lines) + "\n"


def main(*options: str) -> int:
    """Try every pair, print the table, perhaps write it down; or look whether it stands there."""
    if "--check" in options:
        return int(BEGIN + table() + END not in PAGE.read_text())
    wrong = [(model, memory) for model, memory in pairs() if not is_as_said(model, memory)]
    print(table())
    for model in MODELS:
        print(f"{model}: {sum(said(model, memory) == YES for memory in MEMORIES)} of {len(MEMORIES)}")
    for model, memory in wrong:
        print(f"{model} with {memory}: said {said(model, memory)!r}, tried {tried(model, memory)!r}")
    if "--write" in options:
        head, rest = PAGE.read_text().split(BEGIN)
        PAGE.write_text(head + BEGIN + table() + END + rest.split(END, 1)[1])
    return 1 if wrong else 0


def is_as_said(model: str, memory: str) -> bool:
    """Say whether a pair is taken, or refused with its sentence, as the table says."""
    found = tried(model, memory)
    return said(model, memory) in found if said(model, memory) != YES else found == YES


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
