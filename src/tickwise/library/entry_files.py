"""An entry as two files: a JSON manifest for people and programs, and an npz file with its arrays."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._archives import json_bytes, npz_arrays, npz_bytes
from tickwise._files import write_bytes
from tickwise._wording import brief, reason
from tickwise.automata.interchange import to_json
from tickwise.automata.ticks import TickTable
from tickwise.errors import DataError, StoreError, TickwiseError
from tickwise.library.entry import Entry
from tickwise.library.opening import read_file
from tickwise.library.worlds import world_arrays, world_of
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf

FORMAT, VERSION = "tickwise library entry", 1
"""What a manifest begins with; the version changes whenever older ones can no longer be read."""


def write_entry(path: str | Path, entry: Entry) -> tuple[Path, Path]:
    """Write an entry, the manifest last, so that an entry is there if and only if its manifest is.

    The arrays are ``q``, those of the world with ``world_`` before their names, ``landmarks_0`` and so on for each
    disjunct, and ``delta_0``, ``location_0`` and ``clocks_0``, which say what the rows of ``q`` are: row
    ``1 + … + u`` is state u of the first table, and so on (see `tickwise.automata.ticks.TickTable`).

    Args:
        path: Where: a file that ends in ``.npz``, or in ``.json``; the other one is beside it.
        entry: The entry.

    Returns:
        The paths of the arrays and of the manifest.

    Raises:
        DataError: If the path has another ending.
        StoreError: If a file cannot be written.
    """
    arrays_path, manifest_path = entry_paths(path)
    arrays = npz_bytes(_arrays(entry))
    manifest = _manifest(entry)
    try:
        write_bytes(arrays_path, arrays)
        write_bytes(manifest_path, json_bytes({**manifest, "checksum": _checksum(manifest, arrays)}))
    except BaseException:
        if not manifest_path.exists():  # Ctrl-C or a full disk between the two
            arrays_path.unlink(missing_ok=True)
        raise
    return arrays_path, manifest_path


def read_entry(path: str | Path) -> Entry:
    """Read an entry that `write_entry` wrote, and check that it is whole.

    Args:
        path: One of its two files.

    Raises:
        MissingFileError: If a file does not exist.
        FileAccessError: If one may not be read.
        StoreError: If it is no entry, damaged, or of a version that numbers its states in another way.
    """
    arrays_path, manifest_path = entry_paths(path)
    manifest, content = read_manifest(manifest_path), read_file(arrays_path)
    checksum = manifest.pop("checksum", None)
    if checksum != _checksum(manifest, content):
        raise damaged(manifest_path, "its checksum is not that of its files")
    try:
        return _entry(manifest, npz_arrays(content))
    except (TickwiseError, KeyError, TypeError, ValueError) as error:
        raise damaged(manifest_path, reason(error)) from error


def read_manifest(path: Path) -> dict[str, Any]:
    """A manifest alone, as plain data; what else there is of the entry is not looked at.

    Raises:
        MissingFileError: If there is no such file.
        FileAccessError: If it may not be read.
        StoreError: If it is no manifest of an entry, or one of another version.
    """
    try:
        manifest = json.loads(read_file(path))
    except (ValueError, RecursionError) as error:
        raise damaged(path, f"it is no JSON: {reason(error)}") from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise StoreError(f"{path} is no entry of a library; name one that tickwise wrote")
    if manifest.get("version") != VERSION:
        raise StoreError(f"{path} is of version {brief(manifest.get('version'))}; this Tickwise reads {VERSION}")
    return manifest


def entry_paths(path: str | Path) -> tuple[Path, Path]:
    """The paths of an entry's arrays and of its manifest, given either.

    Raises:
        DataError: If the path has another ending.
    """
    file = Path(path)
    if file.suffix not in (".npz", ".json"):
        raise DataError(f"{file} does not end in .npz; use that ending")
    return file.with_suffix(".npz"), file.with_suffix(".json")


def damaged(path: Path, why: str) -> StoreError:
    """The error for an entry that cannot be read."""
    return StoreError(f"{path} is damaged ({why}); remove it and add the entry again")


def _manifest(entry: Entry) -> dict[str, Any]:
    mdp, tables = entry.mdp, entry.tables
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": entry.name,
        "formula": str(entry.formula),
        "horizon": entry.horizon,
        "disjunct": entry.disjunct,
        "world": {"states": mdp.n_states, "actions": mdp.n_actions, "variables": list(mdp.variables)},
        "facts": dict(entry.facts),
        "provenance": dict(entry.provenance),
        "automata": [json.loads(to_json(table.automaton)) for table in tables],
    }


def _arrays(entry: Entry) -> dict[str, NDArray[Any]]:
    world = {f"world_{name}": array for name, array in world_arrays(entry.mdp).items()}
    places = {f"landmarks_{number}": array for number, array in enumerate(entry.landmarks)}
    return {"q": entry.q, **world, **places, **_rows(entry.tables)}


def _rows(tables: tuple[TickTable, ...]) -> dict[str, NDArray[Any]]:
    """What the rows of a Q-function are, so that it is of use where tables may be numbered in another way."""
    named = (
        ((f"delta_{i}", table.delta), (f"location_{i}", table.location), (f"clocks_{i}", table.clocks))
        for i, table in enumerate(tables)
    )
    return dict(chain.from_iterable(named))


def _entry(manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Entry:
    formula = to_sdnf(parse(manifest["formula"]))
    entry = Entry(
        name=manifest["name"],
        formula=formula,
        mdp=world_of({name.removeprefix("world_"): arrays[name] for name in arrays if name.startswith("world_")}),
        horizon=manifest["horizon"],
        q=arrays["q"],
        disjunct=manifest["disjunct"],
        landmarks=tuple(arrays[f"landmarks_{number}"] for number in range(len(formula.disjuncts))),
        facts=manifest["facts"],
        provenance=manifest["provenance"],
    )
    for name, array in _rows(entry.tables).items():
        if not np.array_equal(array, arrays[name]):
            raise DataError("the states of its automata are not numbered as this Tickwise numbers them")
    return entry


def _checksum(manifest: Mapping[str, Any], arrays: bytes) -> str:
    """The checksum of both files together: a change of either is noticed."""
    return f"sha256:{hashlib.sha256(json_bytes(manifest) + arrays).hexdigest()}"
