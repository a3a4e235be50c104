"""Gather the fragments of changelog.d into CHANGELOG.md: python scripts/changelog.py [VERSION]

Without a version they stand under "Unreleased" and stay where they are; with one they stand under it, and are taken
away.
"""

import sys
from datetime import date
from pathlib import Path

ROOT = Path(__file__).parent.parent
FRAGMENTS, PAGE = ROOT / "changelog.d", ROOT / "CHANGELOG.md"
HEAD = "# Changelog\n\nWritten by `python scripts/changelog.py` from the fragments in `changelog.d`.\n"
KINDS = {"added": "Added", "changed": "Changed", "fixed": "Fixed"}


def section(title: str, fragments: list[Path]) -> str:
    """Return the section of a version: what was added, changed and fixed, an entry for each fragment."""
    lines = [f"## {title}", ""]
    for kind, heading in KINDS.items():
        mine = [path for path in fragments if path.suffixes[-2:-1] == [f".{kind}"]]
        lines += [f"### {heading}", ""] if mine else []
        for path in mine:
            first, *more = path.read_text().strip().split("\n")
            lines += [f"* {first}", *(f"  {line}".rstrip() for line in more)]
        lines += [""] if mine else []
    return "\n".join(lines)


def main(version: str = "") -> int:
    """Write the page."""
    if version.startswith("-"):  # an option is no version, and fragments are taken away for one
        print(__doc__.strip())
        return 2
    fragments = sorted(path for path in FRAGMENTS.glob("*.md") if path.name != "README.md")
    odd = [path.name for path in fragments if path.suffixes[-2:-1] not in [[f".{kind}"] for kind in KINDS]]
    if odd:
        print(f"neither {', '.join(KINDS)}: {', '.join(odd)}")
        return 1
    former = PAGE.read_text().partition("\n## ")[2] if PAGE.exists() else ""
    former = f"## {former}" if former else ""
    if former.startswith("## Unreleased"):
        former = former.partition("\n## ")[2]
        former = f"## {former}" if former else ""
    title = f"{version}, {date.today().isoformat()}" if version else "Unreleased"
    PAGE.write_text("\n".join(part for part in (HEAD, section(title, fragments), former) if part).rstrip() + "\n")
    if version:
        for path in fragments:
            path.unlink()
    print(f"{len(fragments)} fragments under {title}")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
