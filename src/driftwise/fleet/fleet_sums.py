"""Checksums of the files that a run has written: a file that was altered, or is gone, is noticed on resume."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

from driftwise.engine.atomic import write_text
from driftwise.engine.errors import InputError

NAME = "SHA256SUMS"  # as `sha256sum --check` reads it


class Sums:
    """The file `NAME` of a folder: a line for each file in it that a run has written and closed.

    A file is written before its line is, and the line goes before the file does: a run that dies in between leaves a
    file of which nothing is said, never a line without its file.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self._known: dict[str, str] | None = None

    @property
    def path(self) -> Path:
        """The file itself."""
        return self.folder / NAME

    @property
    def known(self) -> dict[str, str]:
        """The checksum of each file, by its name in the folder; none where an earlier version wrote it."""
        if self._known is None:
            lines = self.path.read_text(encoding="utf-8", errors="replace").splitlines() if self.path.exists() else []
            self._known = {name: digest for digest, _, name in (line.partition("  ") for line in lines)}
        return self._known

    def add(self, path: Path) -> None:
        """Take down a file as it is."""
        self.known[self._name(path)] = _digest(path)
        self._write()

    def forget(self, paths: Iterable[Path]) -> None:
        """Strike files out."""
        names = {self._name(path) for path in paths} & set(self.known)
        if names:
            self._known = {name: digest for name, digest in self.known.items() if name not in names}
            self._write()

    def verify(self) -> None:
        """Refuse a folder in which a file is not as it was written."""
        for name, digest in self.known.items():
            path = self.folder / name
            why = "its checksum differs" if path.is_file() else "it is gone"
            if not path.is_file() or _digest(path) != digest:
                raise InputError(
                    f"{path} is not as the run wrote it: {why}. Was it altered, or is the disk bad? Put it back from a "
                    "copy, or begin anew (replace=True)"
                )

    def _write(self) -> None:
        if self.known:
            write_text(self.path, "".join(f"{digest}  {name}\n" for name, digest in sorted(self.known.items())))
        else:
            self.path.unlink(missing_ok=True)

    def _name(self, path: Path) -> str:
        return path.relative_to(self.folder).as_posix()


def _digest(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
