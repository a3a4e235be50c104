"""Places to write to: refused before the work where nothing can be written, not after it."""

from __future__ import annotations

import os
import tempfile

from driftwise.engine.errors import CommandError


def refuse_targets(job) -> None:
    """Refuse what --save, --report and --json of a job name where it cannot be written, or is what is read."""
    refuse_files([("--save", job.save), ("--report", job.report), ("--json", job.json)], [job.file])
    if job.save and not job.save.lower().endswith((".parquet", ".csv")):
        raise CommandError(f"--save writes .parquet or .csv, got {job.save}; the ending says which.")
    if job.save and getattr(job, "smooth", None) and _is_pipe(job.save):
        raise CommandError(f"--save: {job.save} is a pipe, and what is smoothed is added to a file; give one.")


def refuse_files(named: list[tuple[str, str | None]], read: list[str]) -> None:
    """Refuse options that name a file which cannot be written, is being ``read``, or which another writes as well."""
    taken: dict[str, str] = {}
    for option, path in named:
        if path is None or (path == "-" and option == "--json"):
            continue
        refuse_file(option, path)
        if os.path.exists(path) and any(os.path.samefile(path, file) for file in read if os.path.exists(file)):
            raise CommandError(f"{option} would overwrite what is being read, {path}; give another name.")
        other = taken.setdefault(os.path.realpath(path), option)
        if other != option and (os.path.isfile(path) or not os.path.exists(path)):
            raise CommandError(f"{other} and {option} would both write {path}; give one of them another name.")


def refuse_file(option: str, path: str) -> None:
    """Refuse a file that cannot be written; a link is followed, a pipe takes what is written in one go."""
    if path in ("", "-"):
        raise CommandError(f"{option} wants the name of a file, got {path!r}; only --json writes to standard output.")
    if os.path.islink(path):
        path = os.path.realpath(path)
    folder = os.path.dirname(path) or "."
    if not os.path.isdir(folder):
        raise CommandError(
            f"{option}: there is no folder {folder} to write {os.path.basename(path)} into; make it first."
        )
    if os.path.isdir(path):
        raise CommandError(f"{option}: {path} is a folder; give the name of a file in it.")
    if path.lower().endswith(".parquet") and _is_pipe(path):
        raise CommandError(f"{option}: {path} is a pipe, and Parquet is written to and fro; give a file, or .csv.")
    if not os.path.exists(path):
        _try(option, folder)
    elif not os.access(path, os.W_OK):
        raise CommandError(f"{option}: {path} is there and may not be written; give another name.")


def refuse_folder(option: str, path: str) -> None:
    """Refuse a folder into which nothing can be written, or which cannot be made."""
    if os.path.exists(path) and not os.path.isdir(path):
        raise CommandError(f"{option} {path}: this is a file, and a folder is wanted.")
    there = path
    while not os.path.exists(there):
        there = os.path.dirname(os.path.abspath(there))
    if os.path.isdir(there):
        _try(option, there)
    else:
        raise CommandError(f"{option} {path}: {there} is a file, and a folder is wanted.")


def _is_pipe(path: str) -> bool:
    """Say whether something is there that is no file: a pipe, a device."""
    return os.path.exists(path) and not os.path.isfile(path)


def _try(option: str, folder: str) -> None:
    """Make a nameless file in a folder that is there: no question to the system tells as much."""
    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise CommandError(
            f"{option}: nothing can be written into the folder {folder} ({error.strerror or error}); give another one."
        ) from None
