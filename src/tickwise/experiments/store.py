"""A run folder: finished pieces of work as npz and JSON, written atomically, so that a study can be resumed."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from tickwise._archives import json_bytes
from tickwise._files import TEMPORARY, write_bytes
from tickwise.errors import MissingFileError, StoreError
from tickwise.experiments.artefacts import Artefact, named_arrays, parse_json

FORMAT = 2
"""Changes whenever old artefacts can no longer be read or would be computed in another way."""


@dataclass(frozen=True, slots=True)
class Store:
    """The artefacts of one configuration in one folder.

    An artefact has a name such as ``learn-III-4``, a JSON manifest and, where there are arrays, an npz file. The
    manifest is written last and names the arrays: an artefact exists iff its manifest and what that names do.

    Attributes:
        folder: The run folder.
    """

    folder: Path

    @classmethod
    def open(cls, folder: Path, configuration: Mapping[str, Any]) -> Store:
        """Open a run folder, or make one.

        Args:
            folder: The run folder.
            configuration: All that determines the results, as plain data.

        Raises:
            StoreError: If the folder belongs to another configuration, or cannot be read or written.
        """
        store = cls(Path(folder))
        wanted = json.loads(json.dumps({"format": FORMAT, **configuration}))
        found = read_configuration(store.folder)
        if found is None:
            if _holds_files(store.folder):
                raise StoreError(
                    f"{store.folder} holds files but no run (there is no config.json); "
                    "choose an empty folder with --out"
                )
            write_json(store.folder / "config.json", wanted)
        elif found != wanted:
            raise StoreError(
                f"{store.folder} holds a run of another configuration ({_difference(found, wanted)}); "
                "choose another folder with --out, or remove this one"
            )
        return store

    def has(self, name: str) -> bool:
        """Whether an artefact is finished.

        Raises:
            StoreError: If its manifest cannot be read.
        """
        path = self._manifest(name)
        return path.exists() and (not named_arrays(read_json(path), path) or self._arrays(name).exists())

    def save(self, name: str, manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write an artefact, all or nothing; the same content gives the same bytes.

        Raises:
            StoreError: If it cannot be written.
        """
        self.put(Artefact.pack(name, manifest, arrays))

    def put(self, artefact: Artefact) -> None:
        """Write an artefact that is bytes already; see `save`."""
        if artefact.arrays is not None:
            write_bytes(self._arrays(artefact.name), artefact.arrays)
        write_bytes(self._manifest(artefact.name), artefact.manifest)

    def load(self, name: str) -> dict[str, Any]:
        """An artefact's manifest and arrays, as one mapping.

        Raises:
            MissingFileError: If there is no such artefact.
            StoreError: If a file cannot be read.
        """
        return self.get(name).content()

    def get(self, name: str) -> Artefact:
        """An artefact as bytes; see `load`."""
        path = self._manifest(name)
        manifest = _read(path)
        named = named_arrays(parse_json(manifest, path), path)
        return Artefact(name, manifest, _read(self._arrays(name)) if named else None, path.parent)

    def sweep(self) -> None:
        """Remove what writers left that were killed half-way; call it when nothing is writing any more."""
        for left in (self.folder / "artefacts").glob(f".*{TEMPORARY}"):
            left.unlink(missing_ok=True)

    def _manifest(self, name: str) -> Path:
        return self.folder / "artefacts" / f"{name}.json"

    def _arrays(self, name: str) -> Path:
        return self.folder / "artefacts" / f"{name}.npz"


def read_configuration(folder: Path) -> dict[str, Any] | None:
    """The configuration of a run folder; None if there is no run.

    Raises:
        StoreError: If it cannot be read.
    """
    path = folder / "config.json"
    if not path.exists():
        return None
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StoreError(f"cannot read {path}: {error.strerror}; choose another folder") from error
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise StoreError(f"{path} holds no configuration of a run; choose another folder, or remove this one")
    return found


def write_json(path: Path, content: Any) -> None:
    """Write plain data as a JSON file, atomically; see `write_bytes`."""
    write_bytes(path, json_bytes(content))


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically; see `write_bytes`."""
    write_bytes(path, text.encode())


def read_json(path: Path) -> Any:
    """Read a JSON file.

    Raises:
        MissingFileError: If it does not exist.
        StoreError: If it cannot be read or is no JSON.
    """
    return parse_json(_read(path), path)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        raise MissingFileError(f"there is no file {path}; run the same study again, it goes on there") from error
    except OSError as error:
        raise StoreError(f"cannot read {path}: {error.strerror}; check its permissions") from error


def _holds_files(folder: Path) -> bool:
    """Whether there is anything in a folder but what a killed process left of its first file."""
    try:
        return folder.exists() and any(_foreign(folder))
    except OSError as error:
        raise StoreError(f"cannot read the folder {folder}: {error.strerror}; choose another one") from error


def _foreign(folder: Path) -> Iterator[Path]:
    return (path for path in folder.iterdir() if not path.match(f".config.json.*{TEMPORARY}"))


def _difference(found: Any, wanted: Any, path: str = "") -> str:
    """The first place where two configurations differ, in words."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        for key in sorted(found.keys() | wanted.keys()):
            if found.get(key) != wanted.get(key):
                return _difference(found.get(key), wanted.get(key), f"{path}.{key}" if path else key)
    return f"its {path} is {_short(found)}, not {_short(wanted)}"


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}…"
