"""Where `driftwise` begins: asked to stop, by Ctrl-C or SIGTERM, it ends in one line from the first moment on.

A service is ended by SIGTERM and told by SIGHUP to read its configuration, by whoever started it and at any moment:
the one is no failure of `driftwise live`, the other is in vain before the configuration was read at all.
"""

import atexit
import gc
import io
import os
import signal
import sys

CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}
STOPPED = b"driftwise: stopped\n"


def main() -> None:
    """Run the command line."""
    if sys.argv[1:2] == ["live"]:
        CODES[signal.SIGTERM] = 0
        if hasattr(signal, "SIGHUP"):  # not on Windows
            signal.signal(signal.SIGHUP, signal.SIG_IGN)
    atexit.register(_answer, signal.SIG_IGN)  # last of all: an interpreter that is torn down would die without a word
    _answer(_leave)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # neither closed nor what a program reads along with
            stream.reconfigure(errors="backslashreplace")  # what its encoding lacks is spelled
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of matrices as small as ours a second thread only waits
    from driftwise.report.printed import columns

    for name in {"COLUMNS", "TERMINAL_WIDTH"} & set(os.environ):  # of the help, too
        told = columns(os.environ.pop(name))
        if told is not None:
            os.environ[name] = str(told)
    gc.disable()  # nothing of a module is garbage
    from driftwise.cli.main import main as run
    from driftwise.engine.errors import Stopped

    gc.freeze()
    gc.set_threshold(20_000)  # little of a run is garbage, either: looking for it took a fifteenth of the time
    gc.enable()
    asked = []

    def stop(number, frame):
        """Let what is being written be finished or taken away; asked once more, leave."""
        _answer(_leave)
        asked.append(number)
        raise KeyboardInterrupt if number == signal.SIGINT else Stopped(CODES[number])

    _answer(stop)
    try:
        run()
    except BaseException as ended:  # a library may make an error of its own of what was raised in it, or lose it
        if not asked or (isinstance(ended, SystemExit) and (ended.code or not CODES[asked[0]])):
            raise
        os.write(2, STOPPED)
        sys.exit(CODES[asked[0]])
    finally:
        _answer(_leave)


def _answer(how) -> None:
    """Answer signals so, but for those that whoever started this process told it not to hear."""
    for number in CODES:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, how)


def _leave(number, frame) -> None:
    """End at once: nothing has been begun, or nothing is left to do."""
    os.write(2, STOPPED)
    os._exit(CODES[number])


if __name__ == "__main__":
    main()
