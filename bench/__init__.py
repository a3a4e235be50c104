"""Speed and memory of driftwise, as ratios within one run: `python -m bench` prints a table and writes bench.json."""
