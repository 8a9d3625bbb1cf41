"""Upper bounds on what the boxes of many nodes are worth, by threads side by side."""

from __future__ import annotations

import math
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from tickwise.inference.boxes import Node
from tickwise.inference.gains import GainBound
from tickwise.inference.levels import Coded
from tickwise.inference.scan import Worth, bound_all
from tickwise.inference.space import Gaps


class Bounds:
    """`scan.bound` of many nodes, by threads side by side."""

    def __init__(self, coded: Coded, free: Gaps, worth: Worth, prior: GainBound, threads: int) -> None:
        gaps = np.array(free, dtype=np.int64).reshape(-1, 2)
        self.arguments = (gaps, worth, prior, int((gaps[:, 1] - gaps[:, 0]).max()) + 1)
        self._coded, self._threads = coded, threads
        self._pool = ThreadPoolExecutor(threads)

    def __enter__(self) -> Bounds:
        return self

    def __exit__(self, *error: object) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)

    def __call__(self, nodes: list[Node]) -> list[float]:
        """The bound of each node, in units of J."""
        if self._threads == 1:
            return bound_all(self._coded, np.array(nodes), *self.arguments).tolist() if nodes else []
        parts = [np.array(nodes[k :: self._threads]) for k in range(self._threads) if nodes[k :: self._threads]]
        found = np.empty(len(nodes))
        run = self._pool.map(lambda part: bound_all(self._coded, part, *self.arguments), parts)
        for k, bounds in enumerate(run):
            found[k :: self._threads] = bounds
        return found.tolist()


BATCH = 64
"""Nodes a compiled call; between two of them Ctrl-C, time and memory are looked at."""

TIE = 1e-12
"""Values of J nearer than this are equal."""


class Bounded:
    """What a search found, with a bound on what there is; the attributes are those of the class that takes this up."""

    __slots__ = ()
    value: float
    bound: float

    @property
    def gap(self) -> float:
        """How much better than what was found the best there is can be at most, in units of J."""
        return max(self.bound - self.value, 0.0)

    @property
    def proved(self) -> bool:
        """Whether what was found is proved to be the best."""
        return self.gap <= TIE


class Clock:
    """How long something may take."""

    def __init__(self, seconds: float | None) -> None:
        self._end = math.inf if seconds is None else time.monotonic() + seconds

    @property
    def over(self) -> bool:
        """Whether it has taken that long."""
        return time.monotonic() > self._end
