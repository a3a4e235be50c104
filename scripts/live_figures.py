"""Take the pictures of the live page for the documentation: both views, light and dark, and on a phone."""

import sys
import tempfile
from pathlib import Path
from urllib.parse import quote

from PIL import Image

HOME = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(HOME / "tests")]


from browser import Browser  # noqa: E402
from live.simulated_board import Simulated  # noqa: E402
from live.simulated_site import Running  # noqa: E402

SCREENS = {"light": (1280, 900, False, False), "dark": (1280, 900, True, False), "phone": (390, 844, False, True)}


def main(folder: Path) -> None:
    """Write live-VIEW-SCREEN.png of every view and screen into `folder`."""
    names = [f"hall {k % 5 + 1}/pump {k + 1:02d}" for k in range(60)]
    board = Simulated(names, seed=4)
    board.time -= 290
    site = Running(board)
    for k in range(290):
        if k == 250:
            board.broken.add(names[16])
        site.do(board.tick)
        site.do(site.app.state.hub.look)
    site.tick = 1.0
    worst = next((seen.key for seen in reversed(board.told) if seen.key == names[16]), names[16])
    for seen in board.told:
        if seen.key != worst:
            board.acknowledge(seen.number)
    views = {"overview": "", "series": f"#/series/{quote(worst, safe='')}"}
    for name, (width, height, dark, mobile) in SCREENS.items():
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            browser = Browser(Path(profile))
            try:
                browser.screen(width, height, dark=dark, mobile=mobile)
                for view, place in views.items():
                    browser.visit(site.address + "/" + place)
                    browser.wait("document.querySelector('#link').dataset.link == 'live'")
                    browser.wait("new Promise(done => setTimeout(() => done(true), 3500))")
                    picture = folder / f"live-{view}-{name}.png"
                    browser.picture(picture, whole=view == "series")
                    with Image.open(picture) as full:
                        full.convert("RGB").quantize(96).save(picture, optimize=True)
                    print(view, name, browser.errors or "", browser.run("document.documentElement.scrollWidth"))
            finally:
                browser.close()
    site.stop()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HOME / "docs" / "figures")
