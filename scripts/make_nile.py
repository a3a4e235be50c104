"""Make src/driftwise/data/nile.csv, the yearly flow of the Nile at Aswan, from the copy in statsmodels.

pip install statsmodels==0.15.0
python scripts/make_nile.py src/driftwise/data/nile.csv
"""

import argparse
import hashlib
from pathlib import Path


def main():
    """Write year and flow (1e8 cubic metres a year) and print the hash."""
    from statsmodels import __version__
    from statsmodels.datasets import nile

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("out", help="the CSV to write")
    out = Path(parser.parse_args().out)
    frame = nile.load_pandas().data
    rows = [f"{year:.0f},{flow:.0f}" for year, flow in zip(frame["year"], frame["volume"], strict=True)]
    out.write_text("\n".join(["year,flow", *rows]) + "\n", encoding="utf-8", newline="\n")
    print("statsmodels", __version__, "rows", len(rows))
    print("sha256 of", out, hashlib.sha256(out.read_bytes()).hexdigest())


if __name__ == "__main__":
    main()
