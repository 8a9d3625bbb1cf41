"""Labelled trajectories in Parquet: one file, or a folder of files that are read one at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._wording import brief, listed, reason
from tickwise.errors import DataError, MissingExtraError, TickwiseError
from tickwise.inference.longform import FIXED, LongTable
from tickwise.inference.trajectories import LabelledTrajectories


def read_parquet(file: Path, labelled: bool) -> LabelledTrajectories:
    """Read one file; see `tickwise.inference.reading.read_trajectories`."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtraError("reading Parquet needs pyarrow; pip install tickwise[parquet]") from None
    try:
        with pyarrow.parquet.ParquetFile(file) as stored:
            # pandas stores the index of a data frame that was cut out of another
            names = [name for name in stored.schema_arrow.names if not name.startswith("__index_level_")]
            rows = LongTable(file, names, labelled)

            def read(name: str) -> Any:  # a column at a time takes the least memory
                return stored.read(columns=[name], use_threads=False).combine_chunks()[name]

            data = _by_columns(read, names)
            if data is None:
                for number, row in enumerate(zip(*(read(name).to_pylist() for name in names), strict=True), start=1):
                    rows.add(row, f"row {number}")
                data = rows.finish()
            pyarrow.default_memory_pool().release_unused()  # it would keep several times the size of the file
            return data
    except TickwiseError:
        raise
    except MemoryError as error:
        raise DataError(f"{file} does not fit into memory: {reason(error)}; split it into a folder of files") from None
    except Exception as error:  # a damaged file fails in many ways
        raise DataError(f"{file} is not a Parquet file of plain columns: {reason(error)}; write it anew") from None


@dataclass(frozen=True, slots=True)
class ParquetParts:
    """The trajectories of a folder of Parquet files, a part a file, in the order of the files' names.

    It may be iterated any number of times. A file's trajectories are held until the next have been read,
    and 8 bytes of every trajectory to the end.

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
                    f"{file} has variables {listed(part.variables)} where {files[0].name} has "
                    f"{listed(variables)}; use the same in all files"
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
                raise DataError(f"trajectory {brief(name)} of {file} is in {other.name} too; make the names unique")


def _by_columns(read: Callable[[str], Any], names: list[str]) -> LabelledTrajectories | None:
    """What `LongTable` makes of the rows, whole columns at a time; None where something is unusual or wrong.

    Args:
        read: Gives a column by its name, in no more than one chunk.
        names: The columns.
    """
    column = read("trajectory")
    if column.null_count or not len(column):
        return None
    encoded = column.chunk(0).dictionary_encode()
    column = None
    texts = encoded.dictionary.to_pylist()
    used, first, codes = np.unique(encoded.indices.to_numpy(), return_index=True, return_inverse=True)
    order = np.argsort(first)  # of first rows, as a dictionary that was stored may have another
    ids = [str(texts[number]).strip() for number in used[order].tolist()]
    codes = np.argsort(order)[codes]
    rows, lengths = np.argsort(codes, kind="stable"), np.bincount(codes)
    codes = codes[rows]
    ticks = np.arange(len(rows)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    variables = [name for name in names if name not in FIXED]
    values, labels = np.full((len(ids), lengths.max(), len(variables)), np.nan), np.ones(len(ids))
    for name in names:
        if name == "trajectory":
            continue
        numbers = _numbers(read(name))
        if numbers is None:
            return None
        numbers = numbers[rows]
        if name == "label":
            labels = numbers[ticks == 0]
        expected = {"tick": ticks, "label": labels[codes]}.get(name, numbers)
        if not np.array_equal(numbers, expected):
            return None
        if name in variables:
            values[codes, ticks, variables.index(name)] = numbers
    if (np.abs(labels) != 1).any() or len(set(ids)) < len(ids):
        return None
    return LabelledTrajectories.from_arrays(values, labels, variables, lengths, ids)


def _numbers(column: Any) -> NDArray[np.float64] | None:
    """A column of finite numbers; None if it is not one."""
    if column.null_count or not str(column.type).startswith(("int", "uint", "float", "double", "halffloat")):
        return None
    numbers: NDArray[np.float64] = column.to_numpy().astype(np.float64, copy=False)
    return numbers if np.isfinite(numbers).all() else None
