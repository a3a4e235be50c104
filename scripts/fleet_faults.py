"""Print who is found of the demonstration's faulty pumps, and draw docs/figures/fleet.png: the page of that fleet.

The picture is taken by Chromium, where there is one on the PATH.
"""

import csv
import shutil
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

from PIL import Image

from driftwise.cli.demo_fleet import FAULTS, pumps, write_fleet
from driftwise.cli.fleet import FleetRunJob

OUT = Path(__file__).parents[1] / "docs" / "figures" / "fleet.png"
SERIES, SAMPLES = 1000, 500
BROWSERS = "chromium", "chromium-browser", "google-chrome", "chrome"


def main(seeds: int):
    named: dict[str, Counter] = defaultdict(Counter)
    there: Counter = Counter()
    for seed in range(seeds):
        with tempfile.TemporaryDirectory() as place:
            folder, out = Path(place) / "pumps", Path(place) / "results"
            write_fleet(folder, SERIES, SAMPLES, seed)
            FleetRunJob(str(folder), "asset", ["flow"], str(out), ["speed"], "time", quiet=True).run()
            with open(out / "outliers.csv") as file:
                kinds = defaultdict(set)
                for row in csv.DictReader(file):
                    kinds[row["key"]].add(row["kind"])
            for pump in pumps(SERIES, SAMPLES, seed):
                there[pump.fault] += 1
                named[pump.fault].update(kinds[pump.name] | ({"anything"} if kinds[pump.name] else set()))
            if not seed:
                draw(out / "summary.html")
    columns = ["anything", "jumped", "drifts", "differs", "noise", "untaught", "bars", "data"]
    print(f"| what is wrong | pumps | {' | '.join(columns)} |\n|---|---|{'---|' * len(columns)}")
    for fault in [*FAULTS, ""]:
        counts = " | ".join(str(named[fault][kind] or "") for kind in columns)
        print(f"| {FAULTS.get(fault, 'nothing')} | {there[fault]} | {counts} |")


def draw(page: Path) -> None:
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        print("no Chromium on the PATH: no picture", file=sys.stderr)
        return
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1200,1430"]
    options += ["--virtual-time-budget=8000", f"--screenshot={OUT}", page.as_uri()]
    subprocess.run([program, *options], check=True, stderr=subprocess.DEVNULL)
    Image.open(OUT).quantize(48).save(OUT, optimize=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
