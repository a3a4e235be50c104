"""Which cluster is meant: refused here where Spark would print the stack of Java, some of it after a minute."""

from __future__ import annotations

import re
import socket

from ...engine.errors import InputError

KINDS = re.compile(
    r"local(\[(\*|[1-9]\d{0,3})(, *\d{1,4})?\])?|local-cluster\[\d{1,4}, *\d{1,4}, *\d{1,7}\]|"
    r"yarn|k8s://\S+|spark://\S+"
)
ADDRESS = re.compile(r"(\[[0-9a-fA-F:.]+\]|[^\s:/,\[\]]+):(\d{1,5})")
PATIENCE = 5.0  # s that a master may take to be there


def refuse(master: str) -> None:
    """Raise `InputError` where a master is no address that Spark knows, or nothing listens there."""
    if not KINDS.fullmatch(master):
        raise InputError(
            f"{master!r} is no master of Spark: they are local, local[4], local[*], spark://host:7077, yarn, k8s://.."
        )
    if not master.startswith("spark://"):
        return
    found = [ADDRESS.fullmatch(one) for one in master.removeprefix("spark://").split(",")]
    why = ""
    for one in found:
        if one is None or int(one[2]) > 65535:
            raise InputError(
                f"{master!r} is no master of Spark: written spark://host:7077, with commas between several"
            )
        try:
            socket.create_connection((one[1].strip("[]"), int(one[2])), PATIENCE).close()
            return
        except (OSError, UnicodeError) as error:
            why = getattr(error, "strerror", None) or str(error)
    raise InputError(f"no master of Spark answers at {master} ({why}); does it run, and is the port right?")
