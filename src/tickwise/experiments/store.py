"""A run folder: finished pieces of work as npz and JSON, written atomically, so that a study can be resumed."""

from __future__ import annotations

import io
import json
import os
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import MissingFileError, StoreError

FORMAT = 2
"""Changes whenever old artefacts can no longer be read or would be computed in another way."""

_EPOCH = (1980, 1, 1, 0, 0, 0)
_TEMPORARY = ".tmp"


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
        return path.exists() and (not _named(read_json(path), path) or self._arrays(name).exists())

    def save(self, name: str, manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write an artefact, all or nothing; the same content gives the same bytes.

        Raises:
            StoreError: If it cannot be written.
        """
        if arrays:
            write_bytes(self._arrays(name), _npz(arrays))
        write_json(self._manifest(name), {**manifest, "arrays": sorted(arrays)})

    def load(self, name: str) -> dict[str, Any]:
        """An artefact's manifest and arrays, as one mapping.

        Raises:
            MissingFileError: If there is no such artefact.
            StoreError: If a file cannot be read.
        """
        path = self._manifest(name)
        manifest = read_json(path)
        named = _named(manifest, path)
        arrays = _load_npz(self._arrays(name), named) if named else {}
        return {key: value for key, value in manifest.items() if key != "arrays"} | arrays

    def sweep(self) -> None:
        """Remove what writers left that were killed half-way; call it when nothing is writing any more."""
        for left in (self.folder / "artefacts").glob(f".*{_TEMPORARY}"):
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
    write_text(path, json.dumps(content, indent=1, ensure_ascii=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically; see `write_bytes`."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file atomically: a reader, or a resumed run, sees all of it or nothing.

    Raises:
        StoreError: If it cannot be written, for instance because the disk is full; nothing is left behind.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}{_TEMPORARY}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        for old in path.parent.glob(f".{path.name}.*{_TEMPORARY}"):  # of a process that was killed
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


def read_json(path: Path) -> Any:
    """Read a JSON file.

    Raises:
        MissingFileError: If it does not exist.
        StoreError: If it cannot be read or is no JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise MissingFileError(f"there is no file {path}; run the same study again, it goes on there") from error
    except OSError as error:
        raise StoreError(f"cannot read {path}: {error.strerror}; check its permissions") from error
    except ValueError as error:
        raise _broken(path, error) from error


def _named(manifest: Any, path: Path) -> list[str]:
    """The names of the arrays that belong to a manifest."""
    if not isinstance(manifest, dict) or not isinstance(manifest.get("arrays"), list):
        raise _broken(path, "it does not name its arrays")
    return [str(name) for name in manifest["arrays"]]


def _broken(path: Path, reason: object) -> StoreError:
    return StoreError(f"{path} is broken ({reason}); remove it and run the same study again")


def _holds_files(folder: Path) -> bool:
    """Whether there is anything in a folder but what a killed process left of its first file."""
    try:
        return folder.exists() and any(_foreign(folder))
    except OSError as error:
        raise StoreError(f"cannot read the folder {folder}: {error.strerror}; choose another one") from error


def _foreign(folder: Path) -> Iterator[Path]:
    return (path for path in folder.iterdir() if not path.match(f".config.json.*{_TEMPORARY}"))


def _npz(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """An npz file whose bytes depend on the arrays alone: NumPy's own carries the time of writing."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=3) as archive:
        for name, array in sorted(arrays.items()):
            entry = io.BytesIO()
            np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)
            info = zipfile.ZipInfo(f"{name}.npy", _EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, entry.getvalue())
    return buffer.getvalue()


def _load_npz(path: Path, names: list[str]) -> dict[str, NDArray[Any]]:
    try:
        # from memory, since NumPy leaves a file open where it is broken
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in names}
    except FileNotFoundError as error:
        raise MissingFileError(f"there is no file {path}; run the same study again, it goes on there") from error
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise _broken(path, error) from error


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
