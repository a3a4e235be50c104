"""`driftwise track --listen`: plots out of sockets, tracks as they grow, for months."""

from __future__ import annotations

import os
import sys
import time
from time import monotonic

from driftwise.cli.follow import asked_to_stop, teller
from driftwise.engine.errors import InputError
from driftwise.tracking.forgetting import forget
from driftwise.tracking.plots import Fault
from driftwise.tracking.sockets import Listener
from driftwise.tracking.wire import Wire, faults_kept

MOST_FAULTS = 1000  # that are remembered one by one
OFTEN = 60.0  # s between two times of letting go


def listen(url: str, wire: Wire, tracker, quiet: bool, keep: float, page=None) -> None:
    """Feed a tracker with what comes from a place until Ctrl-C is pressed or it ends; ``keep`` hours are remembered.

    What has come by then and still waits to be read counts, too.
    """
    source, next_look, lost, dropped = Listener(url), monotonic() + OFTEN, 0, 0
    with teller(quiet, page) as tell, asked_to_stop() as asked:
        try:
            for packets in _read(source, asked):
                found = wire.take(packets)
                if source.has_broken:
                    wire.cut()
                events = _fed(tracker, found) if found is not None else []
                lost += faults_kept(tracker.faults, MOST_FAULTS)
                tell(tracker, events, not packets)
                if monotonic() > next_look:
                    events = tracker.advance(time.time()) if tracker.inbox.newest > 1e9 else []
                    tell(tracker, events, True)
                    forget(tracker.targets, tracker.inbox.newest - 3600 * keep)
                    next_look = monotonic() + OFTEN
            if source.has_ended and (found := wire.end(time.time())) is not None:
                tell(tracker, _fed(tracker, found), False)
            tell(tracker, tracker.finish(), True)
        except BrokenPipeError:  # nobody reads what is told
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            tracker.finish()
        finally:
            dropped = source.dropped
            source.close()
    if lost:
        tracker.faults.append(Fault(wire.title, 0, f"more of such, not told one by one: {lost}, this is the first"))
    if source.lost:
        tracker.faults.append(Fault(wire.title, 0, f"the connection was lost: {source.lost}, this is the first"))
    if dropped:
        words = f"datagrams came faster than they were read, and were lost: {dropped}, this is the first"
        tracker.faults.append(Fault(wire.title, 0, words))
    if not tracker.counts["plots"]:
        raise InputError(f"{url}: nothing came that is a plot")


def _read(source: Listener, asked):
    """Yield what comes until a source ends or somebody asks for the end; then what waits there."""
    while not (source.has_ended or asked()):
        yield source.read()
    yield from source.waiting()


def _fed(tracker, found):
    """Feed plots; what cannot stand beside those before (metres from nowhere beside places on earth) is left out."""
    try:
        return tracker.feed(found)
    except InputError as error:
        tracker.faults.append(Fault("plots", 0, str(error)))
        return []
