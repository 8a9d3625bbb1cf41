"""Read and write labelled trajectories: long CSV, Parquet and NPZ."""

from __future__ import annotations

import csv
import zlib
from pathlib import Path
from tokenize import TokenError
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import DataError, MissingFileError
from tickwise.inference.longform import LongTable
from tickwise.inference.parquet import ParquetParts, read_parquet
from tickwise.inference.trajectories import LabelledTrajectories


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
        MissingExtraError: If Parquet support is not installed.
        DataError: If the file cannot be read as trajectories; the message names the file, and the line and column.
    """
    file = Path(path)
    if file.is_dir():
        return LabelledTrajectories.joined(read_parts(file, labelled=labelled))
    if not file.is_file():
        raise MissingFileError(f"there is no file {file}; check the path")
    readers = {".csv": _read_csv, ".parquet": read_parquet, ".npz": _read_npz}
    reader = readers.get(file.suffix.lower())
    if reader is None:
        raise DataError(f"{file} is not a .csv, .parquet or .npz file; convert it to one of these")
    return reader(file, labelled)


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
    """
    file = Path(path)
    if file.suffix.lower() != ".npz":
        raise DataError(f"{file} does not end in .npz; use that ending")
    with file.open("wb") as stream:
        np.savez_compressed(
            stream, X=data.values, y=data.labels, names=np.array(data.variables), lengths=data.lengths,
            ids=np.array(data.ids),
        )  # fmt: skip


def _read_npz(file: Path, labelled: bool) -> LabelledTrajectories:
    arrays = _load_arrays(file)
    needed = ("X", "names", "y") if labelled else ("X", "names")
    for name in needed:
        if name not in arrays:
            raise DataError(f"{file} has no array {name!r}; it has {', '.join(arrays) or 'none'}")
    for name in ("names", "ids"):
        if name in arrays and arrays[name].ndim != 1:
            raise DataError(f"{file}: {name!r} has shape {arrays[name].shape}; use a list of texts")
    labels = arrays.get("y", np.ones(len(np.atleast_1d(arrays["X"])), dtype=np.int8))
    names, ids = [str(name) for name in arrays["names"]], arrays.get("ids")
    try:
        return LabelledTrajectories.from_arrays(
            arrays["X"], labels, names, arrays.get("lengths"), None if ids is None else [str(name) for name in ids]
        )
    except DataError as error:
        raise DataError(f"{file}: {error}") from None


def _load_arrays(file: Path) -> dict[str, NDArray[Any]]:
    try:
        with file.open("rb") as stream:  # np.load itself would leave a damaged file open
            archive = np.load(stream, allow_pickle=False)
            if isinstance(archive, np.ndarray):
                raise ValueError("it is one array alone")
            with archive:
                return {name: np.asarray(archive[name]) for name in archive.files}
    # a damaged archive may fail in any of these ways; RuntimeError is that of an encrypted or unknown one
    except (ValueError, OSError, EOFError, RuntimeError, BadZipFile, zlib.error, TokenError) as error:
        reason = "".join(str(error).splitlines()[:1])
        raise DataError(
            f"{file} is not an npz file of plain arrays: {reason}; write X, y and names with numpy.savez"
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
    except (UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{file} is not a CSV file in UTF-8: {error}") from None
    return table.finish()
