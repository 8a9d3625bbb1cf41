"""Reading files whose content is not trusted: they are what they should be, or one line says which is not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from tickwise._archives import npz_arrays
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
