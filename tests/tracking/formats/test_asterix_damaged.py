"""ASTERIX that is damaged never crashes, and what is not is read fast."""

import math
import time

import numpy as np
import pytest

pytest.importorskip("asterix.generated", reason='pip install "driftwise[tracking]"')

import asterix_oracle as oracle
from asterix_written import NEWEST, classic, ethernet, file_of, next_generation, polar

from driftwise.engine.errors import InputError
from driftwise.tracking.formats import asterix_records as structure
from driftwise.tracking.formats.asterix import decode, placed, read_asterix
from driftwise.tracking.sites import Site


def test_two_thousand_records_in_half_a_second():
    rng, made = oracle.generator("speed"), []
    for k in range(40):
        items = {"070": (0, 0, 0, 0, ("MODE3A", "4271")), "220": 0x4BAA00 + k, "240": "DLH65A", "161": k, "170": (5,)}
        items |= {"130": {"SRL": 1, "SAM": 2}, "250": [rng.getrandbits(64) for _ in range(3)], "230": 8, "200": 5}
        made.append(polar(3600 + k, 10 + 240 * rng.random(), 360 * rng.random(), **items).unparse().to_bytes())
    at = structure.record(structure.table()[48]["1.32"]["-"], made[0], 0, len(made[0]))[0]["140"]
    again = [r[:at] + (k * 40 + j).to_bytes(3, "big") + r[at + 3 :] for k in range(50) for j, r in enumerate(made)]
    data = b"".join(oracle.block(48, again[k : k + 40]) for k in range(0, 2000, 40))
    best = math.inf
    for _ in range(3):
        start = time.process_time()
        plots = read_asterix(data, sites="25/1=46,15,700")
        best = min(best, time.process_time() - start)
    assert len(plots) == 2000 and not plots.faults
    assert best < 0.5


def damaged(rng, whole):
    """Return a truncated, a flipped, a spliced or a random input."""
    data, kind = bytearray(rng.choice(whole)), rng.randrange(4)
    if kind == 0:
        return bytes(data[: rng.randrange(len(data))])
    if kind == 1:
        for _ in range(rng.randint(1, 8)):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return bytes(data)
    if kind == 2:
        i, j = sorted(rng.randrange(len(data)) for _ in (0, 1))
        return bytes(data[:i] + rng.randbytes(rng.randrange(20)) + data[j:])
    head = bytes([rng.choice([1, 2, 21, 34, 48, 62, 65, 0xD4])]) + rng.randrange(3, 80).to_bytes(2, "big")
    return head + rng.randbytes(rng.randrange(200))


class Everywhere(dict):
    """Sites of all radars there may be."""

    def __contains__(self, name):
        return True

    def __missing__(self, name):
        return Site(46.0, 15.0)


def fuzz(seed, inputs):
    rng = oracle.generator(seed)
    whole = []
    for category in NEWEST:
        records = [oracle.random_record(rng, category, NEWEST[category], s)[1] for s in (0.2, 0.5, 0.8)]
        good = file_of(*records, *(polar(3600 + k) for k in range(6)), category=category)
        good += file_of(*(polar(3600 + k, sic=k) for k in range(3)))
        whole += [good, classic([ethernet(good), ethernet(good[:60])]), next_generation([ethernet(good)], ">")]
    sites = Everywhere({"25/1": Site(48, 12, 500)})
    read = refused = 0  # plots, inputs
    for _ in range(inputs):
        data, start = damaged(rng, whole), time.perf_counter()
        try:
            plots = placed(decode(data), sites, None, "bytes")  # what read_asterix does, with a site for any radar
        except InputError:
            refused += 1
            continue
        assert time.perf_counter() - start < 5
        read += len(plots)
        assert np.isfinite(plots.time).all() and (np.abs(plots.position) < 6.4e6).all()
        assert not (np.abs(plots.altitude) > 65_000).any()
        polar_only = np.isfinite(plots.covariance[:, 0, 0])
        assert (np.linalg.eigvalsh(plots.covariance[polar_only]) > 0).all()
        assert all(0 <= f.offset <= len(data) for f in plots.faults)
    assert read > inputs / 10 and refused > inputs / 50


def test_damaged_input_never_crashes():
    fuzz("damage", 600)


@pytest.mark.slow
def test_damaged_input_never_crashes_a_hundred_thousand_times():
    fuzz("more damage", 100_000)
