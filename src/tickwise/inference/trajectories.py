"""Labelled trajectories: the set S_L of Problem 1, checked once so that every kernel may trust it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tickwise._wording import brief
from tickwise.errors import DataError


@dataclass(frozen=True, slots=True, eq=False)
class LabelledTrajectories:
    """Trajectories with labels 1 (desired) and -1 (undesired), possibly of different lengths.

    The arrays are copied and made read-only.

    Attributes:
        values: States, shape ``(n, ticks, variables)``, float64; NaN after a trajectory's end.
        lengths: Number of states s_0 … s_L of each trajectory, shape ``(n,)``, int64.
        labels: 1 or -1, shape ``(n,)``, int8.
        variables: Names of the columns of ``values``.
        ids: One unique name per trajectory.

    Raises:
        DataError: If a shape does not fit, a value inside a trajectory is not finite, a label is not ±1, an id or
            a variable occurs twice, or there is nothing at all.
    """

    values: NDArray[np.float64]
    lengths: NDArray[np.int64]
    labels: NDArray[np.int8]
    variables: tuple[str, ...]
    ids: tuple[str, ...]

    def __post_init__(self) -> None:
        values = _states(self.values).copy()
        n, ticks, width = values.shape
        if n == 0 or ticks == 0:
            raise DataError(f"values have shape {values.shape}: give at least one trajectory of at least one tick")
        variables, ids = tuple(map(str, self.variables)), tuple(map(str, self.ids))
        if len(variables) != width or width == 0:
            raise DataError(f"{width} columns of values but {len(variables)} variable names; name every column")
        for kind, names in (("variable", variables), ("trajectory id", ids)):
            if len(set(names)) < len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise DataError(f"{kind} {brief(twice)} occurs twice; make the names unique")
        lengths = _whole(self.lengths, n, "length")
        labels = _whole(self.labels, n, "label")
        if len(ids) != n:
            raise DataError(f"{n} trajectories but {len(ids)} ids; give one id per trajectory")
        _check_lengths(lengths, ticks, ids)
        _check_labels(labels, ids)
        _check_states(values, lengths, variables, ids)
        values[np.arange(ticks) >= lengths[:, None]] = np.nan
        stored = (values, lengths, labels.astype(np.int8), variables, ids)
        for name, value in zip(("values", "lengths", "labels", "variables", "ids"), stored, strict=True):
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)

    @classmethod
    def from_arrays(
        cls,
        X: ArrayLike | Sequence[ArrayLike],
        y: ArrayLike,
        variables: Sequence[str] | None = None,
        lengths: ArrayLike | None = None,
        ids: Sequence[str] | None = None,
    ) -> LabelledTrajectories:
        """Build from one array, or from a list of arrays of different lengths.

        Args:
            X: States, shape ``(n, ticks, variables)``, or a list of ``(ticks, variables)`` arrays.
            y: Labels 1 or -1, shape ``(n,)``.
            variables: Names of the columns; ``x0, x1, …`` if left out.
            lengths: Number of states of each trajectory, shape ``(n,)``; all ticks if left out.
            ids: Names of the trajectories; ``0, 1, …`` if left out.

        Returns:
            The checked trajectories.

        Raises:
            DataError: As the class, or if the arrays of a list do not fit together or come with ``lengths``.
        """
        if isinstance(X, np.ndarray):
            values = _states(X)
            counts: ArrayLike = np.full(len(values), values.shape[1]) if lengths is None else lengths
        else:
            values, counts = _padded(X)
            if lengths is not None:
                given = np.asarray(lengths)
                if given.shape != np.shape(counts) or (given > counts).any():
                    raise DataError("lengths go beyond the listed arrays; leave lengths out for a list of arrays")
                counts = given
        names = tuple(f"x{column}" for column in range(values.shape[2])) if variables is None else tuple(variables)
        labels = tuple(str(number) for number in range(len(values))) if ids is None else tuple(ids)
        return cls(values, np.asarray(counts), np.asarray(y), names, labels)

    @classmethod
    def from_frame(cls, frame: Any) -> LabelledTrajectories:
        """Build from a data frame in long form, one row a tick, as a CSV file has it.

        Args:
            frame: Has the columns ``trajectory, tick, <variables…>, label``: ticks 0, 1, 2, … in each trajectory, and
                one label, 1 or -1, a trajectory.

        Returns:
            The trajectories, in the order of their first rows.

        Raises:
            DataError: If the frame is not of this form; the message names the row.
        """
        from tickwise.inference.frames import split_frame

        data, labels = split_frame(frame)
        if labels is None:
            raise DataError("the data frame has no column 'label'; add one of 1 and -1")
        return cls(data.values, data.lengths, labels, data.variables, data.ids)

    @classmethod
    def joined(cls, parts: Iterable[LabelledTrajectories]) -> LabelledTrajectories:
        """All trajectories of parts with the same variables, one part after the other.

        Raises:
            DataError: If there is no part, variables differ, or an id occurs twice.
        """
        kept = list(parts)
        variables = {part.variables for part in kept}
        if len(variables) != 1:
            raise DataError(f"{len(variables)} different lists of variables; give one part or more with the same")
        ticks = max(part.values.shape[1] for part in kept)
        values = np.full((sum(map(len, kept)), ticks, kept[0].values.shape[2]), np.nan)
        row = 0
        for part in kept:
            values[row : row + len(part), : part.values.shape[1]] = part.values
            row += len(part)
        lengths, labels = (
            np.concatenate(arrays) for arrays in zip(*((p.lengths, p.labels) for p in kept), strict=True)
        )
        return cls(values, lengths, labels, kept[0].variables, tuple(name for part in kept for name in part.ids))

    def __len__(self) -> int:
        return len(self.labels)

    @property
    def horizon(self) -> int:
        """The last tick L of the longest trajectory."""
        return int(self.lengths.max()) - 1

    @property
    def positives(self) -> int:
        """The number of trajectories with label 1."""
        return int(np.count_nonzero(self.labels == 1))

    @property
    def negatives(self) -> int:
        """The number of trajectories with label -1."""
        return int(np.count_nonzero(self.labels == -1))

    def require_both_classes(self) -> LabelledTrajectories:
        """Return the same data if there are trajectories of both labels.

        Raises:
            DataError: If one label is missing, so that there is nothing to tell apart.
        """
        if self.positives == 0 or self.negatives == 0:
            missing = 1 if self.positives == 0 else -1
            raise DataError(f"no trajectory has label {missing}; give trajectories of both labels, 1 and -1")
        return self

    def select(self, mask: NDArray[Any]) -> LabelledTrajectories:
        """The trajectories where a mask (or an index array) selects.

        Raises:
            DataError: If none is selected.
        """
        rows = np.arange(len(self))[np.asarray(mask)]
        ids = tuple(self.ids[row] for row in rows)
        return LabelledTrajectories(self.values[rows], self.lengths[rows], self.labels[rows], self.variables, ids)

    def drop_last(self, mask: NDArray[np.bool_]) -> LabelledTrajectories:
        """The same data without the last state of the trajectories where ``mask`` is true (Case Study 2).

        Raises:
            DataError: If a trajectory would have no state left.
        """
        lengths = self.lengths - np.asarray(mask, dtype=bool)
        return LabelledTrajectories(self.values, lengths, self.labels, self.variables, self.ids)


def _real(array: ArrayLike, what: str) -> NDArray[np.float64]:
    try:
        found = np.asarray(array)
        if found.dtype.kind in "biufO":  # NumPy would cut complex numbers and read texts and dates as numbers
            with np.errstate(over="ignore"):  # what is infinite then is refused where it may not be
                return found.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise DataError(f"{what} are not real numbers of one shape; use a float array")


def _states(array: ArrayLike) -> NDArray[np.float64]:
    values = _real(array, "the values")
    if values.ndim != 3:
        raise DataError(f"values have shape {values.shape}; use (trajectories, ticks, variables)")
    return values


def _padded(arrays: Any) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    if not hasattr(arrays, "__iter__"):
        raise DataError(f"the trajectories are {brief(arrays)}; give an array, or a list of arrays")
    rows = [_real(array, f"the states of trajectory {index}") for index, array in enumerate(arrays)]
    if not rows:
        raise DataError("there is no trajectory; give at least one")
    for index, row in enumerate(rows):
        if row.ndim != 2 or row.shape[1] != rows[0].shape[-1]:
            raise DataError(
                f"trajectory {index} has shape {row.shape}; use (ticks, variables) with the same variables in each"
            )
    counts = np.array([len(row) for row in rows], dtype=np.int64)
    values = np.full((len(rows), max(int(counts.max()), 1), rows[0].shape[1]), np.nan)
    for index, row in enumerate(rows):
        values[index, : len(row)] = row
    return values, counts


def _whole(numbers: ArrayLike, n: int, what: str) -> NDArray[np.int64]:
    array = _real(numbers, f"the {what}s")
    if array.shape != (n,):
        raise DataError(f"{what}s have shape {array.shape} for {n} trajectories; give one {what} per trajectory")
    wrong = ~np.isfinite(array) | (array != np.round(array))
    if wrong.any():
        raise DataError(
            f"{what} {array[_first(wrong)]} of row {_first(wrong)} is not a whole number; use whole numbers"
        )
    return np.clip(array, -(2.0**53), 2.0**53).astype(np.int64)  # whatever lies beyond is no length and no label


def _first(wrong: NDArray[np.bool_]) -> int:
    return int(np.argmax(wrong))


def _check_lengths(lengths: NDArray[np.int64], ticks: int, ids: tuple[str, ...]) -> None:
    wrong = (lengths < 1) | (lengths > ticks)
    if wrong.any():
        row = _first(wrong)
        raise DataError(f"trajectory {brief(ids[row])} has length {lengths[row]}; use 1 to {ticks} states")


def _check_labels(labels: NDArray[np.int64], ids: tuple[str, ...]) -> None:
    wrong = np.abs(labels) != 1
    if wrong.any():
        row = _first(wrong)
        raise DataError(f"trajectory {brief(ids[row])} has label {labels[row]}; use 1 or -1")


def _check_states(
    values: NDArray[np.float64], lengths: NDArray[np.int64], variables: tuple[str, ...], ids: tuple[str, ...]
) -> None:
    inside = (np.arange(values.shape[1]) < lengths[:, None])[:, :, None]
    wrong = inside & ~np.isfinite(values)
    if wrong.any():
        row, tick, column = (int(index) for index in np.argwhere(wrong)[0])
        raise DataError(
            f"trajectory {brief(ids[row])}, tick {tick}, variable {brief(variables[column])} is "
            f"{values[row, tick, column]}; fill it in, or shorten the trajectory before it"
        )
