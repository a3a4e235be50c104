"""What an installation brings compiled is all that a first answer asks for."""

import os
import subprocess
import sys

CODE = """
import driftwise as dw
from driftwise.engine import objects
from driftwise.estimators.common.warm import front
list(front())
brought = set(objects.loaded)
y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.3, seed=1)
found = dw.identify({"heater": u, "temperature": y})
found.update(found.trace.state, 1.0, 0.5)
assert brought, "no loop was compiled"
print(sorted(set(objects.loaded) - brought))
"""


def test_identify_asks_for_no_loop_that_does_not_come_along():
    env = {k: v for k, v in os.environ.items() if k != "DRIFTWISE_ENGINE"}
    done = subprocess.run([sys.executable, "-c", CODE], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
