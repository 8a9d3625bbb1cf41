"""Data frames in long form, one row a tick, of pandas or any library whose frames have the same few methods."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import DataError
from tickwise.inference.longform import FIXED, LongTable
from tickwise.inference.trajectories import LabelledTrajectories


def is_frame(data: object) -> bool:
    """Whether this is a data frame, rather than an array or a list of arrays."""
    return hasattr(data, "columns") and hasattr(data, "to_numpy")


def split_frame(frame: Any) -> tuple[LabelledTrajectories, NDArray[Any] | None]:
    """The trajectories of a long data frame, and their labels of whatever kind.

    Args:
        frame: Has the columns ``trajectory, tick, <variables…>`` and perhaps ``label``, one row a tick, with ticks
            0, 1, 2, … in each trajectory and one label a trajectory.

    Returns:
        The trajectories in the order of their first rows, all with label 1; and the label of each, shape ``(n,)``, or
        None where there is no such column.

    Raises:
        DataError: If the frame is not of this form; the message names the row.
    """
    names = [str(name) for name in frame.columns]
    columns = {name: frame[column].to_numpy().tolist() for name, column in zip(names, frame.columns, strict=True)}
    kept = [name for name in names if name != FIXED[2]]
    table = LongTable("the data frame", kept, labelled=False)
    for number, row in enumerate(zip(*(columns[name] for name in kept), strict=True)):
        table.add(row, f"row {number}")
    data = table.finish()
    return data, _labels(columns[FIXED[0]], columns[FIXED[2]]) if FIXED[2] in columns else None


def _labels(trajectories: list[Any], labels: list[Any]) -> NDArray[Any]:
    """The one label of each trajectory, in the order of their first rows."""
    found: dict[str, Any] = {}
    for number, (trajectory, label) in enumerate(zip(trajectories, labels, strict=True)):
        name = str(trajectory).strip()
        if found.setdefault(name, label) != label:
            raise DataError(
                f"the data frame, row {number}, column 'label': {label!r}; trajectory {name!r} had {found[name]!r} "
                "before; use one label"
            )
    return np.array(list(found.values()))
