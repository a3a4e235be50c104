"""Say whether the built site holds together: links, anchors, nothing fetched; list what it points to outside.

python scripts/check_site.py site     # writes site/external-links.txt; exit code 1 where something is broken
"""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlsplit

LOADED = {("img", "src"), ("script", "src"), ("link", "href"), ("source", "src"), ("iframe", "src"), ("image", "href")}


class Page(HTMLParser):
    """What a page can be pointed at by (ids), and what it points to, with whether the browser loads it unasked."""

    def __init__(self, text: str):
        super().__init__()
        self.ids: set[str] = set()
        self.targets: list[tuple[str, bool]] = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.ids |= {given[name] for name in ("id", "name") if given.get(name)}
        for name in ("href", "src"):
            if given.get(name):
                self.targets.append((given[name], (tag, name) in LOADED))


def html(site: Path) -> list[Path]:
    """Return the pages; what a theme brings as its own building material is none."""
    return [path for path in sorted(site.rglob("*.html")) if "_static" not in path.parts]


def check(site: Path) -> tuple[list[str], set[str]]:
    """Return what is broken, and the addresses outside."""
    pages = {path.resolve(): Page(path.read_text()) for path in html(site)}
    broken, outside = [], set()
    for path, page in pages.items():
        for target, is_loaded in page.targets:
            address, anchor = urldefrag(target)
            scheme, place = urlsplit(address)[:2]
            if scheme or place:
                outside.add(address)
                if is_loaded and scheme != "data":
                    broken.append(f"{path.relative_to(site.resolve())} loads {target}")
                continue
            to = (path.parent / unquote(address.partition("?")[0])).resolve() if address else path
            if not to.exists():
                broken.append(f"{path.relative_to(site.resolve())} points to {target}, which is not there")
            elif anchor and to in pages and unquote(anchor) not in pages[to].ids:
                broken.append(f"{path.relative_to(site.resolve())} points to {target}: there is no such anchor")
    return broken, {address for address in outside if not address.startswith(("data:", "mailto:"))}


def main(folder: str) -> int:
    """Print what is broken, and how much was looked at."""
    site = Path(folder)
    broken, outside = check(site)
    (site / "external-links.txt").write_text("".join(f"{address}\n" for address in sorted(outside)))
    print(*broken, sep="\n", end="\n" if broken else "")
    print(f"{len(html(site))} pages, {len(broken)} broken links; {len(outside)} addresses outside, not fetched")
    return int(bool(broken))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
