"""Read and write labelled trajectories: long CSV, Parquet and NPZ."""

from __future__ import annotations

import csv
import logging
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._wording import brief, listed, reason
from tickwise.errors import DataError, FileAccessError, MissingFileError, TickwiseError
from tickwise.inference.longform import LongTable
from tickwise.inference.parquet import ParquetParts, read_parquet
from tickwise.inference.trajectories import LabelledTrajectories

_log = logging.getLogger(__name__)


def read_trajectories(path: str | Path, *, labelled: bool = True) -> LabelledTrajectories:
    """Read a data file, or a folder of Parquet files.

    A long table (``.csv``, ``.parquet``) has the columns ``trajectory, tick, <variables…>, label``, one row per tick,
    with ticks 0, 1, 2, … in each trajectory and one label, 1 or -1, per trajectory. An ``.npz`` file has ``X``
    (n, ticks, variables), ``y`` (n,), ``names`` and perhaps ``lengths`` and ``ids``; no pickle is ever loaded. A
    folder is read as `read_parts` reads it, and its parts are joined.

    Args:
        path: The file, whose ending tells the format, or the folder.
        labelled: Whether labels are needed. If not, they may be missing, and every label is then 1.

    Returns:
        The trajectories, in the order of the file, or of the files by name.

    Raises:
        MissingFileError: If there is no such file or folder.
        FileAccessError: If it may not be read.
        MissingExtraError: If Parquet support is not installed.
        DataError: If the file cannot be read as trajectories; the message names the file, and the line and column.
    """
    if not isinstance(path, str | os.PathLike):
        raise DataError(f"the path {brief(path)} is of type {type(path).__name__}; give text or a Path")
    with _access(Path(path), "read"):
        found = _read(Path(path), labelled)
    _log.debug(
        "%s: %d trajectories of %s, %d ticks at the most", path, len(found), listed(found.variables), found.horizon + 1
    )
    return found


def _read(file: Path, labelled: bool) -> LabelledTrajectories:
    if file.is_dir():
        return LabelledTrajectories.joined(read_parts(file, labelled=labelled))
    if not file.is_file():
        if file.exists():
            raise DataError(f"{file} is neither a file nor a folder; copy what it gives to a file")
        raise MissingFileError(f"there is no file {file}; check the path")
    readers = {".csv": _read_csv, ".parquet": read_parquet, ".npz": _read_npz}
    reader = readers.get(file.suffix.lower())
    if reader is None:
        raise DataError(f"{file} is not a .csv, .parquet or .npz file; convert it to one of these")
    with file.open("rb"):  # the libraries that read it would say that it is damaged where it may not be read
        pass
    return reader(file, labelled)


@contextmanager
def _access(path: Path, verb: str) -> Iterator[None]:
    """Say which file the system would not give."""
    try:
        yield
    except TickwiseError:
        raise
    except OSError as error:
        raise FileAccessError(
            f"cannot {verb} {path}: {error.strerror or reason(error)}; check its permissions, and the room on the disk"
        ) from error


def read_parts(folder: str | Path, *, labelled: bool = True) -> ParquetParts:
    """Read a folder of Parquet files, one at a time, for data that are too large to be held at once.

    Each file is a long table as `read_trajectories` has it, with the same variables in all. A trajectory lies wholly
    in one file.

    Args:
        folder: The folder.
        labelled: As for `read_trajectories`.

    Returns:
        The trajectories of each file, in the order of the files' names. Nothing is read until this is iterated, each
        time anew; see `ParquetParts` for what may then be raised.

    Raises:
        MissingFileError: If there is no such folder.
    """
    if not Path(folder).is_dir():
        raise MissingFileError(f"there is no folder {folder}; check the path")
    return ParquetParts(Path(folder), labelled)


def write_npz(path: str | Path, data: LabelledTrajectories) -> None:
    """Write trajectories so that `read_trajectories` gives them back.

    Args:
        path: The file, with ending ``.npz``.
        data: The trajectories.

    Raises:
        FileAccessError: If it cannot be written.
        DataError: If it has another ending.
    """
    file = Path(path)
    if file.suffix.lower() != ".npz":
        raise DataError(f"{file} does not end in .npz; use that ending")
    with _access(file, "write"), file.open("wb") as stream:
        np.savez_compressed(
            stream, X=data.values, y=data.labels, names=np.array(data.variables), lengths=data.lengths,
            ids=np.array(data.ids),
        )  # fmt: skip


def _read_npz(file: Path, labelled: bool) -> LabelledTrajectories:
    arrays = _load_arrays(file)
    needed = ("X", "names", "y") if labelled else ("X", "names")
    for name in needed:
        if name not in arrays:
            raise DataError(f"{file} has no array {name!r}; it has {listed(arrays) or 'none'}")
    labels = arrays.get("y", np.ones(len(np.atleast_1d(arrays["X"])), dtype=np.int8))
    names = _texts(file, arrays, "names")
    ids = _texts(file, arrays, "ids") if "ids" in arrays else None
    try:
        return LabelledTrajectories.from_arrays(arrays["X"], labels, names, arrays.get("lengths"), ids)
    except DataError as error:
        raise DataError(f"{file}: {error}") from None


def _texts(file: Path, arrays: dict[str, NDArray[Any]], name: str) -> list[str]:
    """An array of texts, or of numbers that are names."""
    array = arrays[name]
    if array.ndim != 1:
        raise DataError(f"{file}: {name!r} has shape {array.shape}; use a list of texts")
    try:
        if array.dtype.kind == "S":
            return [text.decode() for text in array.tolist()]
        if array.dtype.kind in "Uiu":
            return [str(text) for text in array]
    except (SystemError, ValueError):  # NumPy's words for signs beyond Unicode
        pass
    raise DataError(f"{file}: {name!r} has type {array.dtype}, or signs that are none; use a list of texts")


def _load_arrays(file: Path) -> dict[str, NDArray[Any]]:
    try:
        with file.open("rb") as stream, warnings.catch_warnings():  # np.load would leave a damaged file open
            warnings.simplefilter("ignore")  # of headers that were written long ago
            archive = np.load(stream, allow_pickle=False)
            if isinstance(archive, np.ndarray):
                raise ValueError("it is one array alone")
            with archive:
                return {name: np.asarray(archive[name]) for name in archive.files}
    except Exception as error:  # a damaged archive fails in a dozen ways: what is in it has lengths and code of its own
        raise DataError(
            f"{file} is not an npz file of plain arrays: {reason(error)}; write X, y and names with numpy.savez"
        ) from None


def _read_csv(file: Path, labelled: bool) -> LabelledTrajectories:
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            rows = csv.reader(stream)
            header = [name.strip() for name in next(rows, [])]
            table = LongTable(file, header, labelled)
            for row in rows:
                if row:
                    table.add(row, f"line {rows.line_num}")
    except UnicodeDecodeError as error:
        raise DataError(f"{file} is not a CSV file in UTF-8: {reason(error)}; save it as UTF-8") from None
    except csv.Error as error:
        raise DataError(f"{file} is not a CSV file, at line {rows.line_num}: {error}; check the quotes there") from None
    return table.finish()
