"""The service as a process: killed while it follows a file, it has the bits of a fleet on all of it."""

import os
import random
import signal
import time

from live_plant import configuration, found, lines, opened, outputs, states
from live_process import asked, ended, started

SAMPLES, SERIES, KILLS = 240, 12, 3


def test_a_file_that_grows_is_followed_through_kills(tmp_path):
    y, drawn = outputs(SERIES, SAMPLES), random.Random(5)
    data = tmp_path / "samples.jsonl"
    data.touch()
    config = configuration(tmp_path, f'[[source]]\nkind = "file"\npath = "{data}"\n')
    process, step = started(config), SAMPLES // KILLS
    for kill in range(KILLS):
        text = lines(y, kill * step, (kill + 1) * step)
        cut = drawn.randrange(len(text))  # anywhere, in the middle of a line too
        for part in (text[:cut], text[cut:]):
            with data.open("a") as file:
                file.write(part)
            time.sleep(drawn.uniform(0.0, 0.6))
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        process = started(config)

    until = time.monotonic() + 120
    while b'"offset": %d' % data.stat().st_size not in _place(tmp_path) and time.monotonic() < until:
        time.sleep(0.2)
    assert ended(process) == 0
    assert found(opened(tmp_path / "store")) == states(y)


def _place(folder):
    return " ".join(row[0] for row in asked(folder, "SELECT json FROM places")).encode()
