"""What was promised about speed and memory, measured."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads inside a small matrix product are CPU time for nothing
