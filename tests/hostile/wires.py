"""What comes over a wire, whole and damaged, through `Wire` and `Tracker`: each is read, or refused in words.

Run (from tests/): python -m hostile.wires --inputs 20000 [--seed 1]
"""

from __future__ import annotations

import argparse
import json
import sys
import time

import numpy as np

import driftwise as dw
from driftwise.tracking.forgetting import forget
from driftwise.tracking.formats.logs import checksum
from driftwise.tracking.sockets import Packet
from driftwise.tracking.wire import Wire

from .plots import FORMATS, mutated

START, OFTEN = 1_700_000_000.0, 1000
FRAMES = ["8D40621D58C382D690C8AC2863A7", "8D40621D58C386435CC412692AD6"]


def beast(k):
    """Return a Beast message, 1a doubled."""
    body = (12_000_000 * k + 0x1A).to_bytes(6, "big") + b"\x1a" + bytes.fromhex(FRAMES[k % 2])
    return b"\x1a3" + body.replace(b"\x1a", b"\x1a\x1a")


def sbs(k):
    cells = [
        "MSG",
        3,
        1,
        1,
        "40621D",
        1,
        *["2023/11/14", "22:13:20.000"] * 2,
        "",
        38000,
        "",
        "",
        f"{52 + 0.001 * k:.4f}",
    ]
    return ",".join(map(str, [*cells, 3.9, "", "", 0, 0, 0, 0])).encode() + b"\r\n"


def sentence(body):
    return f"!{body}*{checksum(body):02X}\r\n".encode()


AIS = sentence("AIVDM,1,1,,A,13u?etPv2;0n:dDPwUM1U1Cb069D,0")
STREAMS = {  # what comes, how often, and how many plots that is
    "beast": (lambda k: beast(k), 10, 9),
    "avr": (lambda k: f"*{FRAMES[k % 2]};\n".encode(), 10, 9),
    "sbs": (sbs, 10, 10),
    "ais": (lambda k: AIS, 5, 5),
    "csv": (lambda k: (b"time,east,north\n" if k == 0 else b"") + b"%d,%d,5\n" % (k, 100 * k), 10, 10),
    "json": (lambda k: json.dumps({"time": START + k, "lat": 46 + 0.001 * k, "lon": 15.0}).encode() + b"\n", 10, 10),
}


def trial(seed) -> str:
    """Feed one damaged stream in pieces; return what became of it."""
    rng = np.random.default_rng([26, *np.atleast_1d(seed)])
    name = str(rng.choice([*FORMATS, *STREAMS]))
    make = STREAMS[name][0] if name in STREAMS else None
    data = b"".join(make(k) for k in range(10)) if make else FORMATS[name](rng)
    data = mutated(data, rng, int(rng.choice([1, 3, 30])))
    wire, tracker = Wire(name, bool(rng.integers(2))), dw.tracking.Tracker("boat")
    size, said = int(rng.choice([13, 200, 60_000])), "read"
    try:
        for k in range(0, len(data), size):
            if (found := wire.take([Packet(START + k, data[k : k + size])])) is not None:
                tracker.feed(found)
                forget(tracker.targets, tracker.inbox.newest - 3600)
    except dw.InputError:
        said = "refused"
    assert np.isfinite([track.trace.position[-1] for track in tracker.tracks]).all()
    return said


def main() -> None:
    """Run many, and say what became of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    found: dict[str, int] = {}
    slowest = 0.0
    for number in range(asked.inputs):
        began = time.process_time()
        try:
            said = trial((asked.seed, number))
        except Exception as error:
            said = f"{type(error).__name__} at {number}: {error}"[:120]
        found[said] = found.get(said, 0) + 1
        slowest = max(slowest, time.process_time() - began)
        if number % OFTEN == OFTEN - 1:
            print(f"{number + 1}: {found}", file=sys.stderr, flush=True)
    print(f"{asked.inputs} inputs, slowest {slowest:.1f} CPU s: {found}")


if __name__ == "__main__":
    main()
