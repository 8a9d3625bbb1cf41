"""Reading files whose content is not trusted: they are what they should be, or one line says which is not."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._archives import npz_arrays
from tickwise._wording import listed, reason
from tickwise.errors import DataError, FileAccessError, MissingFileError


def read_file(path: Path) -> bytes:
    """The bytes of a file.

    Raises:
        MissingFileError: If there is no such file.
        FileAccessError: If it may not be read.
    """
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise MissingFileError(f"there is no file {path}; check the path") from None
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror}; check its permissions") from None


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of an npz file.

    Raises:
        MissingFileError: If there is no such file.
        FileAccessError: If it may not be read.
        DataError: If it is no npz file of plain arrays.
    """
    content = read_file(path)
    try:
        return npz_arrays(content)
    except ValueError as error:
        raise DataError(f"it is not an npz file of plain arrays ({error})") from None


def read_array(path: Path, name: str) -> NDArray[Any]:
    """An array from a file of its own, or by name from one of several.

    Args:
        path: An npy file, or an npz file that has an array of the name.
        name: The name.

    Raises:
        MissingFileError: If there is no such file.
        FileAccessError: If it may not be read.
        DataError: If there is no such array in it.
    """
    content = read_file(path)
    if content[:6] == b"\x93NUMPY":
        try:
            return np.asarray(np.load(io.BytesIO(content), allow_pickle=False))
        except Exception as error:  # as many ways to fail as a damaged archive has
            raise DataError(f"{path} is no file of an array ({reason(error)}); write it with numpy.save") from None
    try:
        arrays = npz_arrays(content)
    except ValueError as error:
        raise DataError(f"{path} is no npy or npz file of plain arrays ({error}); write one with numpy") from None
    if name not in arrays:
        raise DataError(f"{path} has no array {name!r}; it has {listed(arrays) or 'none'}")
    return arrays[name]
