"""A finished piece of work as bytes, which a run folder holds or a network carries."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import NDArray

from tickwise._archives import json_bytes, npz_arrays, npz_bytes
from tickwise.errors import StoreError


class Artefacts(Protocol):
    """Where a job finds what earlier ones gave: a run folder, or what was sent with the job."""

    def load(self, name: str) -> dict[str, Any]:
        """An artefact's manifest and arrays, as one mapping."""
        ...


@dataclass(frozen=True, slots=True)
class Artefact:
    """A manifest in JSON and, where there are arrays, an npz file; the same content has the same bytes.

    Attributes:
        name: Its name, such as ``learn-III-4``.
        manifest: The bytes of the manifest, which names the arrays.
        arrays: The bytes of the npz file; None where there are no arrays.
        folder: The folder that it was read from.
    """

    name: str
    manifest: bytes
    arrays: bytes | None = None
    folder: Path = Path()

    @classmethod
    def pack(cls, name: str, manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Artefact:
        """An artefact of plain data and arrays."""
        return cls(name, json_bytes({**manifest, "arrays": sorted(arrays)}), npz_bytes(arrays) if arrays else None)

    def content(self) -> dict[str, Any]:
        """Manifest and arrays, as one mapping.

        Raises:
            StoreError: If they cannot be read.
        """
        path = self.folder / f"{self.name}.json"
        manifest = parse_json(self.manifest, path)
        names = named_arrays(manifest, path)
        try:
            arrays = {} if self.arrays is None else npz_arrays(self.arrays, names)
        except ValueError as error:
            raise broken(path.with_suffix(".npz"), error) from error
        return {key: value for key, value in manifest.items() if key != "arrays"} | arrays


@dataclass(frozen=True, slots=True)
class Parcel:
    """Artefacts in memory, by name."""

    artefacts: Mapping[str, Artefact]

    def load(self, name: str) -> dict[str, Any]:
        """An artefact's manifest and arrays, as one mapping."""
        return self.artefacts[name].content()


def parse_json(content: bytes, path: Path) -> Any:
    """Plain data from the JSON of a file.

    Raises:
        StoreError: If it is no JSON.
    """
    try:
        return json.loads(content)
    except ValueError as error:
        raise broken(path, error) from error


def named_arrays(manifest: Any, path: Path) -> list[str]:
    """The names of the arrays that belong to a manifest.

    Raises:
        StoreError: If it does not name them.
    """
    if not isinstance(manifest, dict) or not isinstance(manifest.get("arrays"), list):
        raise broken(path, "it does not name its arrays")
    return [str(name) for name in manifest["arrays"]]


def broken(path: Path, reason: object) -> StoreError:
    """The error for a file whose content cannot be read."""
    return StoreError(f"{path} is broken ({reason}); remove it and run the same study again")
