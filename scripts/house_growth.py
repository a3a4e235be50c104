"""Print how many lines of code each room of the package has gained since a commit, and what came: its new files.

Run: python scripts/house_growth.py COMMIT

Lines are those of `scripts/house.py`: no blanks, comments, docstrings. A folder that is new counts whole.
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tarfile
from collections import Counter
from pathlib import PurePosixPath

from house_tree import ROOT, code_lines, folder, sources

LEAST = 200  # lines of a new file or folder that is named
IN_ROOM = ("engine", "estimators")  # rooms that are shown folder by folder


def former(commit: str) -> dict[str, int]:
    """Return the lines of code of every file of the package at a commit, by its path inside."""
    packed = subprocess.run(["git", "-C", ROOT, "archive", f"{commit}:src/driftwise"], capture_output=True, check=True)
    with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as files:
        texts = {m.name: files.extractfile(m) for m in files if m.name.endswith(".py")}
        return {name: lines(file.read().decode()) for name, file in texts.items() if file}


def lines(text: str) -> int:
    """Return the lines of code of a text."""
    return code_lines(text, ast.parse(text))


def place(path: str) -> str:
    """Return the room that a file stands in, and of large rooms the folder there."""
    parts = PurePosixPath(path).parts
    return "/".join(parts[:2]) if parts[0] in IN_ROOM and len(parts) > 2 else folder(path)


def main() -> None:
    """Print the table."""
    before, now = former(sys.argv[1]), {path: code_lines(*both) for path, both in sources().items()}
    then, today, added = Counter[str](), Counter[str](), Counter[str]()
    for count, found in ((then, before), (today, now)):
        for path, n in found.items():
            count[place(path)] += n
    for path in now.keys() - before.keys():
        added[place(path)] += now[path]
    print("| room | then | now | more | of it new files |\n|---|---|---|---|---|")
    for room in sorted({*then, *today}, key=lambda room: then[room] - today[room]):
        print(f"| {room} | {then[room]} | {today[room]} | {today[room] - then[room]:+} | {added[room]} |")
    total = sum(then.values()), sum(today.values()), sum(added.values())
    print(f"| all | {total[0]} | {total[1]} | {total[1] - total[0]:+} | {total[2]} |")
    large = [(now[path], path) for path in now.keys() - before.keys() if now[path] >= LEAST and then[place(path)]]
    print("\nNew files: " + ", ".join(f"{path} {n}" for n, path in sorted(large, reverse=True)))


if __name__ == "__main__":
    main()
