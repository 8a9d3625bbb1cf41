"""A folder of entries: what was learned before, by name."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tickwise._archives import json_bytes
from tickwise._files import TEMPORARY, write_bytes
from tickwise._wording import brief, listed
from tickwise.errors import ConfigurationError, MissingFileError, StoreError
from tickwise.library.entry import Entry, check_name, stamped
from tickwise.library.entry_files import damaged, read_entry, read_manifest, write_entry
from tickwise.library.opening import read_file

_MARK = {"format": "tickwise library", "version": 1}
"""What ``library.json`` holds, which makes a folder a library."""


@dataclass(frozen=True, slots=True)
class Library:
    """A folder of entries, each a pair of files in ``entries``; see `tickwise.library.entry_files.write_entry`.

    Attributes:
        folder: The folder.
    """

    folder: Path

    @classmethod
    def open(cls, folder: str | Path, *, create: bool = False) -> Library:
        """Open a library.

        Args:
            folder: Its folder.
            create: Whether to make one where there is no folder, or an empty one.

        Raises:
            MissingFileError: If there is no such folder.
            StoreError: If the folder holds something else, or cannot be read or written.
        """
        library = cls(Path(folder))
        mark = library.folder / "library.json"
        try:
            if not mark.exists():
                found = library.folder.exists() and any(_foreign(library.folder))
                if found or not create:
                    raise _no_library(library.folder, found)
                write_bytes(mark, json_bytes(_MARK))
        except OSError as error:
            if isinstance(error, StoreError | MissingFileError):
                raise
            raise StoreError(f"cannot read the folder {folder}: {error.strerror}; choose another one") from error
        _check_mark(mark)
        return library

    def names(self) -> tuple[str, ...]:
        """The names of its entries, sorted."""
        return tuple(sorted(path.stem for path in self._entries.glob("*.json") if not path.name.startswith(".")))

    def manifest(self, name: str) -> dict[str, Any]:
        """What is written of an entry, without its arrays: formula, facts, provenance, automata; see `read`."""
        found = read_manifest(self._manifest(name))
        if found.get("name") != name:
            raise damaged(self._manifest(name), f"it is named {brief(found.get('name'))} within")
        return found

    def read(self, name: str) -> Entry:
        """An entry.

        Raises:
            ConfigurationError: If there is none of that name.
            MissingFileError: If one of its files is missing.
            FileAccessError: If one may not be read.
            StoreError: If it is damaged.
        """
        self.manifest(name)
        return read_entry(self._manifest(name))

    def add(self, entry: Entry) -> Path:
        """Add an entry, wholly or not at all.

        Args:
            entry: The entry; to its provenance version and date are added, where it has none.

        Returns:
            The path of its manifest.

        Raises:
            ConfigurationError: If there is an entry of that name.
            StoreError: If it cannot be written; nothing of it is left behind.
        """
        self.require_free(entry.name)
        stamped_entry = replace(entry, provenance=stamped(entry.provenance))
        return write_entry(self._entries / f"{entry.name}.json", stamped_entry)[1]

    def require_free(self, name: str) -> None:
        """Refuse a name that is none, or that an entry has.

        Raises:
            ConfigurationError: If it is so.
        """
        # on some systems names that differ in upper and lower case only are the same
        taken = {other.casefold(): other for other in self.names()}.get(check_name(name).casefold())
        if taken is not None:
            raise ConfigurationError(
                f"{self.folder} has an entry {taken} already; choose another name, or remove "
                f"{self._entries / taken}.json first"
            )

    @property
    def _entries(self) -> Path:
        return self.folder / "entries"

    def _manifest(self, name: str) -> Path:
        path = self._entries / f"{check_name(name)}.json"
        if not path.exists():
            raise ConfigurationError(
                f"there is no entry {name!r} in {self.folder}; it has {listed(self.names()) or 'none yet'}"
            )
        return path


def _foreign(folder: Path) -> Iterator[Path]:
    """What is in a folder but what a killed process left of its first file."""
    return (path for path in folder.iterdir() if not path.match(f".library.json.*{TEMPORARY}"))


def _no_library(folder: Path, found: bool) -> StoreError | MissingFileError:
    if found:
        return StoreError(f"{folder} holds files but no library (there is no library.json); choose another folder")
    return MissingFileError(f"there is no library {folder}; check the path, or make one with tickwise library add")


def _check_mark(path: Path) -> None:
    try:
        mark = json.loads(read_file(path))
    except (ValueError, RecursionError):
        mark = None
    if mark != _MARK:
        raise StoreError(f"{path} is not that of a library which this Tickwise can read; choose another folder")
