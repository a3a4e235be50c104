"""Whoever silences the type checker says why, beside it; that its kind is named, ruff asks for (PGH003)."""

import re
import tokenize
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = "src", "studies", "scripts", "bench", "examples", "tests"
SILENCED = "type: " + "ignore"
REASONED = re.compile(rf"# {SILENCED}\[[\w, -]+\]  # \w")


def without_reason(file: Path) -> list[str]:
    """Return the places of a file where the type checker is silenced without a reason."""
    if SILENCED not in file.read_text(encoding="utf-8"):
        return []
    with file.open("rb") as source:
        comments = [one for one in tokenize.tokenize(source.readline) if one.type == tokenize.COMMENT]
    return [
        f"{file.name}:{one.start[0]}" for one in comments if SILENCED in one.string and not REASONED.search(one.string)
    ]


def test_every_silenced_error_has_its_reason():
    files = [file for folder in FOLDERS for file in sorted((ROOT / folder).rglob("*.py"))]
    assert len(files) > 500
    assert [place for file in files for place in without_reason(file)] == []


def test_one_without_is_found(tmp_path):
    file = tmp_path / "some.py"
    text = [
        f"x = 1  # {SILENCED}",
        f"x = 1  # {SILENCED}[misc]",
        f"x = 1  # {SILENCED}[misc]  # because",
        f'"{SILENCED}"',
    ]
    file.write_text("\n".join(text))
    assert without_reason(file) == ["some.py:1", "some.py:2"]
