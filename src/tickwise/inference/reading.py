"""Read and write labelled trajectories: long CSV, Parquet and NPZ."""

from __future__ import annotations

import csv
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from tokenize import TokenError
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import DataError, MissingExtraError, MissingFileError
from tickwise.inference.trajectories import LabelledTrajectories

_FIXED = ("trajectory", "tick", "label")


def read_trajectories(path: str | Path, *, labelled: bool = True) -> LabelledTrajectories:
    """Read a data file.

    A long table (``.csv``, ``.parquet``) has the columns ``trajectory, tick, <variables…>, label``, one row per tick,
    with ticks 0, 1, 2, … in each trajectory and one label, 1 or -1, per trajectory. An ``.npz`` file has ``X``
    (n, ticks, variables), ``y`` (n,), ``names`` and perhaps ``lengths`` and ``ids``; no pickle is ever loaded.

    Args:
        path: The file; its ending tells the format.
        labelled: Whether labels are needed. If not, they may be missing, and every label is then 1.

    Returns:
        The trajectories, in the order of the file.

    Raises:
        MissingFileError: If there is no such file.
        MissingExtraError: If Parquet support is not installed.
        DataError: If the file cannot be read as trajectories; the message names the file, and the line and column.
    """
    file = Path(path)
    if not file.is_file():
        raise MissingFileError(f"there is no file {file}; check the path")
    readers = {".csv": _read_csv, ".parquet": _read_parquet, ".npz": _read_npz}
    reader = readers.get(file.suffix.lower())
    if reader is None:
        raise DataError(f"{file} is not a .csv, .parquet or .npz file; convert it to one of these")
    return reader(file, labelled)


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
            table = _Table(file, header, labelled)
            for row in rows:
                if row:
                    table.add(row, f"line {rows.line_num}")
    except (UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{file} is not a CSV file in UTF-8: {error}") from None
    return table.finish()


def _read_parquet(file: Path, labelled: bool) -> LabelledTrajectories:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtraError("reading Parquet needs pyarrow; pip install tickwise[parquet]") from None
    try:
        columns: dict[str, list[Any]] = pyarrow.parquet.read_table(file).to_pydict()
    except (pyarrow.ArrowException, OSError) as error:
        raise DataError(f"{file} is not a Parquet file: {str(error).splitlines()[0]}") from None
    table = _Table(file, list(columns), labelled)
    for number, row in enumerate(zip(*columns.values(), strict=True), start=1):
        table.add(row, f"row {number}")
    return table.finish()


class _Table:
    """Gathers the rows of a long table; knows where each came from, for the messages."""

    def __init__(self, file: Path, header: Sequence[str], labelled: bool) -> None:
        self.file = file
        self.header = list(header)
        needed = _FIXED if labelled or "label" in header else _FIXED[:2]
        for name in needed:
            if name not in header:
                raise DataError(f"{file} has no column {name!r}; it has {', '.join(header) or 'no header'}")
        for name in header:
            if list(header).count(name) > 1:
                raise DataError(f"{file} has two columns {name!r}; rename one")
        self.variables = [name for name in header if name not in _FIXED]
        if not self.variables:
            raise DataError(f"{file} has no variable column beside {', '.join(_FIXED)}; add one")
        self.states: dict[str, list[list[float]]] = {}
        self.labels: dict[str, float] = {}

    def add(self, row: Sequence[Any], where: str) -> None:
        """Add one row; ``where`` names it."""
        if len(row) != len(self.header):
            raise DataError(f"{self.file}, {where}: {len(row)} fields for {len(self.header)} columns; fix the row")
        cells = dict(zip(self.header, row, strict=True))
        name = str(cells["trajectory"]).strip()
        states = self.states.setdefault(name, [])
        tick = self._number(cells, "tick", where)
        if tick != len(states):
            raise DataError(
                f"{self.file}, {where}, column 'tick': {tick:g} where trajectory {name!r} needs {len(states)}; "
                "ticks go 0, 1, 2, … in order"
            )
        label = self._number(cells, "label", where) if "label" in cells else 1.0
        if self.labels.setdefault(name, label) != label or abs(label) != 1:
            known = self.labels[name]
            reason = "use 1 or -1" if abs(label) != 1 else f"trajectory {name!r} had {known:g} before; use one label"
            raise DataError(f"{self.file}, {where}, column 'label': {label:g}; {reason}")
        states.append([self._number(cells, variable, where) for variable in self.variables])

    def _number(self, cells: dict[str, Any], column: str, where: str) -> float:
        try:
            number = float(cells[column])
        except (TypeError, ValueError):
            shown = repr(cells[column])
            raise DataError(f"{self.file}, {where}, column {column!r}: {shown} is not a number; fix it") from None
        if not np.isfinite(number):
            raise DataError(f"{self.file}, {where}, column {column!r}: {number} is not finite; fill it in")
        return number

    def finish(self) -> LabelledTrajectories:
        """The trajectories of all rows."""
        if not self.states:
            raise DataError(f"{self.file} has no rows; give at least one trajectory")
        arrays: Iterator[NDArray[np.float64]] = (np.array(states) for states in self.states.values())
        return LabelledTrajectories.from_arrays(
            list(arrays), list(self.labels.values()), self.variables, ids=list(self.states)
        )
