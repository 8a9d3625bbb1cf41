"""Files that are written wholly or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from tickwise.errors import StoreError

TEMPORARY = ".tmp"
"""How the name of a file ends while it is being written."""


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file atomically: a reader, or a resumed run, sees all of it or nothing.

    Raises:
        StoreError: If it cannot be written, for instance because the disk is full; nothing is left behind.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}{TEMPORARY}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        for old in path.parent.glob(f".{path.name}.*{TEMPORARY}"):  # of a process that was killed
            old.unlink(missing_ok=True)
        try:
            with temporary.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise StoreError(
            f"cannot write {path}: {error.strerror}; make room or choose another folder, and run the same command "
            "again: what is finished is kept"
        ) from error
