"""What two commits tell of changes in the files to choose by, file by file: numbers of docs/decisions/claims.md.

    python scripts/claims_between.py OLD NEW --files 400 --first 0 --trouble "gain jump"

Plants, files, truth and oracle are this tree's; the package that answers is that of OLD, then that of NEW (`git
worktree`, in a folder that goes). With --trouble only files are answered that have it, alone or beside others.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent


def answer(first: int, files: int, trouble: str) -> None:
    """Print a line of JSON for each file: what the oracle knows, what of it is told, and false claims by kind."""
    from driftwise_studies.score.claims.audit import one
    from driftwise_studies.score.claims.checking import FALSE
    from driftwise_studies.score.claims.drawing import draw

    for number in range(first, first + files):
        if not trouble or trouble in draw(0, number).troubles:
            line = one(0, number)
            false = [kind for kind, verdict, _ in line.claims if verdict == FALSE]
            print(
                json.dumps({"number": number, "there": line.expected, "told": line.found, "false": false}), flush=True
            )


def answers(commit: str, words: list[str]) -> list[dict]:
    """Return these lines, answered by the package of a commit."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        subprocess.run(["git", "-C", str(ROOT), "worktree", "add", "-q", "--detach", str(tree), commit], check=True)
        try:
            env = os.environ | {"PYTHONPATH": f"{tree / 'src'}{os.pathsep}{ROOT / 'studies'}"}
            done = subprocess.run(
                [sys.executable, __file__, "--answer", *words], env=env, capture_output=True, text=True
            )
        finally:
            subprocess.run(["git", "-C", str(ROOT), "worktree", "remove", "--force", str(tree)], check=True)
    if done.returncode:
        sys.exit(done.stderr)
    return [json.loads(line) for line in done.stdout.splitlines()]


def table(old: list[dict], new: list[dict]) -> str:
    """Return what is told by both, by one, by none, as a table of Markdown."""
    rows = [
        "| what the oracle knows | there | told by both | by the old alone | by the new alone |",
        "|---|---|---|---|---|",
    ]
    for what in sorted({name for line in old for name in line["there"]}):
        pairs = [(a["told"].get(what, 0), b["told"].get(what, 0)) for a, b in zip(old, new) if what in a["there"]]
        there = sum(line["there"].get(what, 0) for line in old)
        both = sum(min(pair) for pair in pairs)
        rows.append(
            f"| {what} | {there} | {both} | {sum(a for a, _ in pairs) - both} | {sum(b for _, b in pairs) - both} |"
        )
    rows += ["", "| false claims | old | new |", "|---|---|---|"]
    kinds = sorted({kind for line in (*old, *new) for kind in line["false"]})
    rows += [
        f"| {kind} | {' | '.join(str(sum(x['false'].count(kind) for x in s)) for s in (old, new))} |" for kind in kinds
    ]
    return "\n".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commits", nargs="*")
    parser.add_argument("--files", type=int, default=400)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--trouble", default="")
    parser.add_argument("--answer", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.answer:
        return answer(asked.first, asked.files, asked.trouble)
    if len(asked.commits) != 2:
        parser.error("two commits are compared: OLD NEW")
    words = ["--files", str(asked.files), "--first", str(asked.first), "--trouble", asked.trouble]
    old, new = (answers(commit, words) for commit in asked.commits)
    print(f"{len(old)} files of seed 0\n\n{table(old, new)}")
    return None


if __name__ == "__main__":
    main()
