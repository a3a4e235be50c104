"""Speed and memory of driftwise, as ratios within one run: `python -m bench` prints them and writes bench.json."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads inside a small matrix product are CPU time for nothing
