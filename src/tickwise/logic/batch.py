"""Trajectories as users have them, brought to one padded array."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import DataError, UnknownVariableError


class Table(Protocol):
    """A data frame, of pandas or another library: one row a tick, one named column a variable."""

    @property
    def columns(self) -> Any:
        """The names of the columns."""

    def __getitem__(self, name: Any, /) -> Any:
        """One column."""


Trajectories: TypeAlias = NDArray[Any] | Table | Sequence[Any]
"""What `as_batch` takes: an array, a data frame, or a list of either."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Checked trajectories in one array.

    Attributes:
        values: Shape (n, ticks, variables); what lies past a trajectory's length means nothing and may be
            NaN.
        lengths: The number of states of each trajectory, at least 1, shape (n,).
        single: Whether one trajectory was given, and so one answer is wanted.
    """

    values: NDArray[np.float64]
    lengths: NDArray[np.int64]
    single: bool


def as_batch(
    X: Trajectories,
    names: Sequence[str],
    *,
    variables: Sequence[str] | None = None,
    lengths: NDArray[Any] | None = None,
) -> Batch:
    """Bring trajectories in any accepted form to one array with the wanted columns.

    Args:
        X: One trajectory as a (ticks, variables) array, a data frame, or a (ticks,) array where there is one
            variable; or a batch as an (n, ticks, variables) array or a list of single trajectories.
        names: The variables wanted, in the order wanted.
        variables: The names of the columns of `X`; by default a data frame's own, and for an array `names`.
        lengths: The number of states of each trajectory of an (n, ticks, variables) array, shape (n,).

    Returns:
        The batch; the last axis of its values is `names`.

    Raises:
        UnknownVariableError: If a wanted variable is not among the columns.
        DataError: If the array has a wrong shape or number of columns, is ragged or not numeric, or a
            trajectory is empty or has NaN within its length.
    """
    batch = arranged(X, names, variables=variables, lengths=lengths)
    require_no_nan(batch, names)
    return batch


def arranged(
    X: Trajectories,
    names: Sequence[str],
    *,
    variables: Sequence[str] | None = None,
    lengths: NDArray[Any] | None = None,
) -> Batch:
    """The same as `as_batch`, but for NaN, which is not looked for: a kernel that reads the data finds it too."""
    if _is_list_of_trajectories(X):
        if lengths is not None:
            raise DataError("lengths go with an (n, ticks, variables) array; a list of arrays has its own")
        items = enumerate(cast(Sequence[Any], X))
        batch = _stack([_trajectory(one, names, variables, f"trajectory {i}") for i, one in items], names)
    else:
        array = None if _is_table(X) else _numeric(X, "the data")
        if array is not None and array.ndim == 3:
            batch = _rectangular(array, names, variables, lengths)
        else:
            if lengths is not None:
                raise DataError("lengths go with an (n, ticks, variables) array; cut a single one instead")
            values = _trajectory(X if array is None else array, names, variables, "the trajectory")
            batch = Batch(values[None], np.array([len(values)]), single=True)
    return batch


def _is_table(X: Any) -> bool:
    return hasattr(X, "columns") and hasattr(X, "to_numpy")


def _is_list_of_trajectories(X: Any) -> bool:
    if not isinstance(X, Sequence):
        return False
    return len(X) == 0 or any(_is_table(one) or getattr(one, "ndim", 0) > 0 for one in X)


def _numeric(X: Any, what: str) -> NDArray[np.float64]:
    try:
        if np.iscomplexobj(X):
            raise DataError(f"{what} is complex; give real numbers only")
        return np.asarray(X, dtype=np.float64)
    except DataError:
        raise
    except (TypeError, ValueError) as error:
        if "inhomogeneous" in str(error) or "sequence" in str(error):
            raise DataError(f"{what} is ragged; give a list of (ticks, variables) arrays") from None
        raise DataError(f"{what} is not numeric ({error}); give numbers only") from None


def _trajectory(X: Any, names: Sequence[str], variables: Sequence[str] | None, what: str) -> NDArray[np.float64]:
    """One trajectory's wanted columns, shape (ticks, names)."""
    if _is_table(X):
        values, variables = _table(X, names, variables, what)
    else:
        values = _numeric(X, what)
        if values.ndim == 1 and len(names if variables is None else variables) == 1:
            values = values[:, None]
    if values.ndim != 2:
        raise DataError(
            f"{what} has shape {values.shape}; give (ticks, variables), or (n, ticks, variables) for a batch"
        )
    if len(values) == 0:
        raise DataError(f"{what} is empty; it needs at least one state")
    return _select(values, names, variables, what)


def _table(
    X: Any, names: Sequence[str], variables: Sequence[str] | None, what: str
) -> tuple[NDArray[np.float64], list[str]]:
    """The wanted columns of a data frame that it has, and their names; others need not be numeric."""
    own = list(X.columns)
    labels = [str(name) for name in own] if variables is None else list(variables)
    _require_all_named(len(own), labels, what)
    _require(names, labels, what)
    if not names:
        return np.empty((len(X), 0)), []
    sources = [own[labels.index(name)] for name in names]
    columns = [_numeric(X[source].to_numpy(), f"column {source!r} of {what}") for source in sources]
    return np.stack(columns, axis=1), list(names)


def _select(
    values: NDArray[np.float64], names: Sequence[str], variables: Sequence[str] | None, what: str
) -> NDArray[np.float64]:
    """The wanted columns of an array (..., columns), in the order wanted."""
    columns = values.shape[-1]
    if not names:
        return values[..., :0]
    if variables is None:
        if columns != len(names):
            raise DataError(
                f"{what} has {columns} column(s), but the formula has the variables "
                f"{', '.join(names)}; name the columns with variables=(...)"
            )
        return values
    _require_all_named(columns, variables, what)
    _require(names, variables, what)
    order = [list(variables).index(name) for name in names]
    return values if order == list(range(columns)) else values[..., order]


def _require_all_named(columns: int, variables: Sequence[str], what: str) -> None:
    if columns != len(variables):
        raise DataError(f"{what} has {columns} column(s) but variables names {len(variables)}; name each one")
    for name in variables:
        if list(variables).count(name) > 1:
            raise DataError(f"{what} has two columns of the same name, {name!r}; rename one")


def _require(names: Sequence[str], there: Sequence[str], what: str) -> None:
    for name in names:
        if name not in there:
            known = ", ".join(map(repr, there)) or "nothing"
            raise UnknownVariableError(f"the formula names {name!r}, which {what} does not have; it has {known}")


def _stack(parts: list[NDArray[np.float64]], names: Sequence[str]) -> Batch:
    lengths = np.array([len(part) for part in parts], dtype=np.int64)
    values = np.full((len(parts), int(lengths.max(initial=1)), len(names)), np.nan)
    for row, part in zip(values, parts, strict=True):
        row[: len(part)] = part
    return Batch(values, lengths, single=False)


def _rectangular(
    array: NDArray[np.float64], names: Sequence[str], variables: Sequence[str] | None, lengths: Any
) -> Batch:
    count, ticks, _ = array.shape
    if ticks == 0:
        raise DataError("the trajectories are empty; each needs at least one state")
    values = _select(array, names, variables, "the batch")
    if lengths is None:
        return Batch(values, np.full(count, ticks, dtype=np.int64), single=False)
    given = np.asarray(lengths)
    if given.shape != (count,) or not np.issubdtype(given.dtype, np.integer):
        raise DataError(f"lengths has shape {given.shape} and type {given.dtype}; give {count} whole numbers")
    if count and not (given.min() >= 1 and given.max() <= ticks):
        raise DataError(f"lengths are from {given.min()} to {given.max()}; they must be from 1 to {ticks} ticks")
    return Batch(values, given.astype(np.int64), single=False)


def require_no_nan(batch: Batch, names: Sequence[str]) -> None:
    """Name the first NaN within a trajectory's length.

    Raises:
        DataError: If there is one.
    """
    bad = np.isnan(batch.values)
    if not bad.any():
        return
    bad &= (np.arange(bad.shape[1]) < batch.lengths[:, None])[..., None]
    if bad.any():
        which, tick, variable = (int(index) for index in np.argwhere(bad)[0])
        where = "the trajectory" if batch.single else f"trajectory {which}"
        raise DataError(
            f"{where} has NaN at tick {tick} in {names[variable]!r}; fill it, leave it out, or set its length"
        )
