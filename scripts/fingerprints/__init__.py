"""What `scripts/fingerprint.py` takes: records, what is done with an estimator, configurations, words.

It says first what has to be the same whenever a fingerprint is taken, before NumPy is loaded.
"""

import os
import time

os.environ |= {"OPENBLAS_NUM_THREADS": "1", "COLUMNS": "110", "NO_COLOR": "1", "TERM": "dumb", "TZ": "UTC"}
time.perf_counter = lambda: 0.0  # reports say how long they took
