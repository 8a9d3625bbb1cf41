"""Long tables, one row a tick, as labelled trajectories."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._wording import brief, listed
from tickwise.errors import DataError
from tickwise.inference.trajectories import LabelledTrajectories

FIXED = ("trajectory", "tick", "label")
"""The columns that are not variables."""


class LongTable:
    """Gathers the rows of a long table; knows where each came from, for the messages."""

    def __init__(self, file: Path | str, header: Sequence[str], labelled: bool) -> None:
        self.file = file
        self.header = list(header)
        needed = FIXED if labelled or "label" in header else FIXED[:2]
        for name in needed:
            if name not in header:
                raise DataError(f"{file} has no column {name!r}; it has {listed(header) or 'no header'}")
        for name in header:
            if list(header).count(name) > 1:
                raise DataError(f"{file} has two columns {brief(name)}; rename one")
        self.variables = [name for name in header if name not in FIXED]
        if not self.variables:
            raise DataError(f"{file} has no variable column beside {', '.join(FIXED)}; add one")
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
                f"{self.file}, {where}, column 'tick': {tick:g} where trajectory {brief(name)} needs {len(states)}; "
                "ticks go 0, 1, 2, … in order"
            )
        label = self._number(cells, "label", where) if "label" in cells else 1.0
        if self.labels.setdefault(name, label) != label or abs(label) != 1:
            known = self.labels[name]
            before = f"trajectory {brief(name)} had {known:g} before; use one label"
            reason = "use 1 or -1" if abs(label) != 1 else before
            raise DataError(f"{self.file}, {where}, column 'label': {label:g}; {reason}")
        states.append([self._number(cells, variable, where) for variable in self.variables])

    def _number(self, cells: dict[str, Any], column: str, where: str) -> float:
        try:
            number = float(cells[column])
        except (TypeError, ValueError, OverflowError):
            place = f"{self.file}, {where}, column {brief(column)}"
            raise DataError(f"{place}: {brief(cells[column])} is not a number; fix it") from None
        if not np.isfinite(number):
            raise DataError(f"{self.file}, {where}, column {brief(column)}: {number} is not finite; fill it in")
        return number

    def finish(self) -> LabelledTrajectories:
        """The trajectories of all rows."""
        if not self.states:
            raise DataError(f"{self.file} has no rows; give at least one trajectory")
        arrays: Iterator[NDArray[np.float64]] = (np.array(states) for states in self.states.values())
        return LabelledTrajectories.from_arrays(
            list(arrays), list(self.labels.values()), self.variables, ids=list(self.states)
        )
