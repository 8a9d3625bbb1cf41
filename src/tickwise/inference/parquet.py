"""Labelled trajectories in Parquet: one file, or a folder of files that are read one at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import DataError, MissingExtraError
from tickwise.inference.longform import LongTable
from tickwise.inference.trajectories import LabelledTrajectories


def read_parquet(file: Path, labelled: bool) -> LabelledTrajectories:
    """Read one file; see `tickwise.inference.reading.read_trajectories`."""
    table = _load(file)
    rows = LongTable(file, table.column_names, labelled)
    data = _by_columns(table, rows.variables)
    if data is not None:
        return data
    columns = (column.to_pylist() for column in table.columns)
    for number, row in enumerate(zip(*columns, strict=True), start=1):
        rows.add(row, f"row {number}")
    return rows.finish()


@dataclass(frozen=True, slots=True)
class ParquetParts:
    """The trajectories of a folder of Parquet files, a part a file, in the order of the files' names.

    It may be iterated any number of times. A file's trajectories are held until the next has been
    read, and 8 bytes of every trajectory to the end.

    Attributes:
        folder: The folder; files in it that do not end in ``.parquet`` are left alone.
        labelled: Whether labels are needed.
    """

    folder: Path
    labelled: bool = True

    @property
    def files(self) -> list[Path]:
        """The files, sorted by name.

        Raises:
            DataError: If there is none.
        """
        found = [path for path in self.folder.iterdir() if path.suffix.lower() == ".parquet" and path.is_file()]
        if not found:
            raise DataError(f"{self.folder} has no .parquet file; give a file, or a folder of Parquet files")
        return sorted(found)

    def __iter__(self) -> Iterator[LabelledTrajectories]:
        """Read one file after the other.

        Raises:
            MissingExtraError: If Parquet support is not installed.
            DataError: If a file cannot be read as trajectories, has other variables than the first, or a trajectory
                of a file before it.
        """
        files, variables = self.files, None
        seen = np.zeros(0, dtype=np.int64)
        for number, file in enumerate(files):
            part = read_parquet(file, self.labelled)
            variables = variables or part.variables
            if part.variables != variables:
                raise DataError(
                    f"{file} has variables {', '.join(part.variables)} where {files[0].name} has "
                    f"{', '.join(variables)}; use the same in all files"
                )
            hashes = np.array([hash(name) for name in part.ids], dtype=np.int64)
            if np.isin(hashes, seen).any():
                self._compare(part, file, files[:number])
            seen = np.concatenate([seen, hashes])
            yield part

    def _compare(self, part: LabelledTrajectories, file: Path, before: list[Path]) -> None:
        """Look for a part's trajectories in the files before; two names may have the same hash by chance."""
        for other in before:
            common = set(part.ids) & set(read_parquet(other, self.labelled).ids)
            if common:
                name = next(name for name in part.ids if name in common)
                raise DataError(f"trajectory {name!r} of {file} is in {other.name} too; make the names unique")


def _load(file: Path) -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtraError("reading Parquet needs pyarrow; pip install tickwise[parquet]") from None
    try:
        with pyarrow.parquet.ParquetFile(file) as stored:
            table = stored.read().combine_chunks()
    except (pyarrow.ArrowException, OSError) as error:
        raise DataError(f"{file} is not a Parquet file: {str(error).splitlines()[0]}") from None
    # pandas stores the index of a data frame that was cut out of another
    return table.select([k for k, name in enumerate(table.column_names) if not name.startswith("__index_level_")])


def _by_columns(table: Any, variables: list[str]) -> LabelledTrajectories | None:
    """What `LongTable` makes of the rows, whole columns at a time; None where something is unusual or wrong."""
    found = {name: _numbers(table[name]) for name in table.column_names if name != "trajectory"}
    columns = {name: column for name, column in found.items() if column is not None}
    if len(columns) < len(found) or table["trajectory"].null_count or not len(table):
        return None
    encoded = table["trajectory"].chunk(0).dictionary_encode()
    codes = encoded.indices.to_numpy().astype(np.int64)
    used, first, codes = np.unique(codes, return_index=True, return_inverse=True)
    order = np.argsort(first)  # of first rows, as a dictionary that was stored may have another
    codes = np.argsort(order)[codes]
    names = encoded.dictionary.to_pylist()
    ids = [str(names[number]).strip() for number in used[order].tolist()]
    rows, lengths = np.argsort(codes, kind="stable"), np.bincount(codes)
    ticks = np.arange(len(rows)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    codes = codes[rows]
    labels = columns["label"] if "label" in columns else np.ones(len(rows))
    own = labels[np.sort(first)]
    wrong = (columns["tick"][rows] != ticks) | (labels[rows] != own[codes])
    if wrong.any() or (np.abs(own) != 1).any() or len(set(ids)) < len(ids):
        return None
    values = np.full((len(ids), lengths.max(), len(variables)), np.nan)
    for column, name in enumerate(variables):
        values[codes, ticks, column] = columns[name][rows]
    return LabelledTrajectories.from_arrays(values, own, variables, lengths, ids)


def _numbers(column: Any) -> NDArray[np.float64] | None:
    """A column of finite numbers; None if it is not one."""
    if column.null_count or not str(column.type).startswith(("int", "uint", "float", "double", "halffloat")):
        return None
    numbers: NDArray[np.float64] = column.to_numpy().astype(np.float64, copy=False)
    return numbers if np.isfinite(numbers).all() else None
