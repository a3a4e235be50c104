"""What the compiler is told while a driver is compiled: its loops are of a few turns."""

import contextlib
from collections.abc import Iterator
from typing import Any

KNOWN = range(15, 23)  # versions of LLVM that have the option below; one that had not would end the process


@contextlib.contextmanager
def short_loops() -> Iterator[None]:
    """Neither vectorise a loop nor take eight turns of it at a time: both cost more than they gain in four turns.

    Half the time to compile, and a quarter less to run where the length is not known; the same bits. LLVM's options
    are the process's: afterwards loops are unrolled again, which is the default on the machines that gain by it.
    """
    import llvmlite.binding as llvm
    import numba

    config: Any = numba.config
    before, config.LOOP_VECTORIZE = config.LOOP_VECTORIZE, 0
    has_option = llvm.llvm_version_info[0] in KNOWN
    if has_option:
        llvm.set_option("driftwise", "-unroll-runtime=false")
    try:
        yield
    finally:
        config.LOOP_VECTORIZE = before
        if has_option:
            llvm.set_option("driftwise", "-unroll-runtime=true")
