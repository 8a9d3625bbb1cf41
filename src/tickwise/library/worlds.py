"""Worlds as files: the arrays of a `TabularMDP` in an npz file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._archives import npz_bytes
from tickwise._files import write_bytes
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import DataError
from tickwise.library.opening import read_arrays

_NUMBERS = ("successor", "probability", "initial", "cell", "cell_coordinates")
ARRAYS = (*_NUMBERS, "variables", "limits")
"""The arrays that make a world, by the names of `TabularMDP`'s attributes; ``variables`` are texts."""


def world_arrays(mdp: TabularMDP) -> dict[str, NDArray[Any]]:
    """A world as arrays, which `world_of` makes a world of again."""
    arrays = {name: getattr(mdp, name) for name in _NUMBERS}
    return {**arrays, "variables": np.array(mdp.variables), "limits": np.array(mdp.limits, dtype=np.float64)}


def world_of(arrays: Mapping[str, NDArray[Any]]) -> TabularMDP:
    """The world that arrays describe.

    Raises:
        DataError: If one is missing, or they do not fit together.
    """
    missing = next((name for name in ARRAYS if name not in arrays), None)
    if missing is not None:
        raise DataError(f"a world needs an array {missing!r}; write it with write_world")
    variables, limits = arrays["variables"], arrays["limits"]
    if variables.ndim != 1 or variables.dtype.kind != "U" or limits.shape != (len(variables), 2):
        raise DataError("a world's variables are no list of texts with a lower and an upper limit for each")
    numbers: dict[str, Any] = {name: arrays[name] for name in _NUMBERS}
    if any(array.dtype.kind not in "biuf" for array in (*numbers.values(), limits)):
        raise DataError("an array of a world has something that is no number")
    ranges = tuple((float(low), float(high)) for low, high in limits.astype(np.float64))
    return TabularMDP(**numbers, variables=tuple(map(str, variables)), limits=ranges)


def write_world(path: str | Path, mdp: TabularMDP) -> None:
    """Write a world to an npz file, wholly or not at all.

    Raises:
        DataError: If the path has another ending.
        StoreError: If it cannot be written.
    """
    file = Path(path)
    if file.suffix != ".npz":
        raise DataError(f"{file} does not end in .npz; use that ending")
    write_bytes(file, npz_bytes(world_arrays(mdp)))


def read_world(path: str | Path) -> TabularMDP:
    """The world of a file that `write_world` wrote, or `numpy.savez` with the same arrays.

    Raises:
        MissingFileError: If there is no such file.
        FileAccessError: If it may not be read.
        DataError: If it holds no world.
    """
    try:
        return world_of(read_arrays(Path(path)))
    except DataError as error:
        raise DataError(f"{path} holds no world: {error}") from None
