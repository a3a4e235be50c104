"""A PostgreSQL of our own, in a folder of its own, on a free port."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
from pathlib import Path

import pytest

USER = "nobody"  # PostgreSQL refuses to be root


class Database:
    """Debian's PostgreSQL; everything on disk before it answers, so it may be killed."""

    def __init__(self):
        pytest.importorskip("psycopg", reason="psycopg is not installed: pip install 'driftwise[postgres]'")
        programs = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
        if not programs:
            pytest.skip("PostgreSQL is not installed: make services")
        self.programs = programs[-1]
        self.folder = Path(tempfile.mkdtemp(prefix="driftwise-pg-"))
        self.user = pwd.getpwnam(USER) if os.geteuid() == 0 else None
        if self.user:
            os.chown(self.folder, self.user.pw_uid, self.user.pw_gid)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.url = f"postgresql://driftwise@127.0.0.1:{self.port}/postgres"
        self.do("initdb", "-D", "data", "-U", "driftwise", "-A", "trust", "--no-sync", "-E", "UTF8")
        self.start()

    def do(self, program: str, *words: str):
        """Run a program of the database as its user."""
        who = {"user": self.user.pw_uid, "group": self.user.pw_gid, "extra_groups": []} if self.user else {}
        with open(self.folder / "out", "ab") as out:
            return subprocess.run([self.programs / program, *words], cwd=self.folder, check=True, stdout=out,
                                  stderr=out, timeout=120, **who)  # fmt: skip

    def start(self):
        options = f"-p {self.port} -h 127.0.0.1 -k {self.folder} -c max_connections=20 -c shared_buffers=16MB"
        self.do("pg_ctl", "-D", "data", "-w", "-o", options, "-l", "log", "start")

    def restart(self):
        """Kill the server, as a power failure would, and start it again."""
        self.do("pg_ctl", "-D", "data", "-w", "-m", "immediate", "stop")
        self.start()

    def stop(self):
        self.do("pg_ctl", "-D", "data", "-w", "-m", "immediate", "stop")
        shutil.rmtree(self.folder)

    def ask(self, text: str):
        """Return the rows of a question, None while there is nothing to ask."""
        import psycopg

        try:
            with psycopg.connect(self.url, connect_timeout=5) as base:
                found = base.execute(text)
                return found.fetchall() if found.description else []
        except (psycopg.OperationalError, psycopg.errors.UndefinedTable):
            return None
