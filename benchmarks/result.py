"""One line of what was measured."""

from __future__ import annotations

from dataclasses import dataclass

AXES = ("trajectories", "ticks", "world", "runs", "none")
"""What grows: the number of trajectories, their ticks, the side of the world, the number of runs; or nothing."""

OURS = "tickwise"
"""The contender that all others are compared with."""


@dataclass(frozen=True, slots=True)
class Result:
    """The time that a contender took, or why it did not run.

    Attributes:
        benchmark: What is done.
        axis: What `size` counts; one of `AXES`.
        size: How much of it; 0 where nothing grows.
        contender: Who did it.
        seconds: Median time of a repetition, in seconds; None if it did not run.
        work: Units of work in a repetition.
        unit: The unit of work.
        skipped: Why it did not run; empty if it did.
        memory: Bytes that it took at most beside what the process had before; None if that was not measured.
    """

    benchmark: str
    axis: str
    size: int
    contender: str
    seconds: float | None
    work: float = 1.0
    unit: str = "run"
    skipped: str = ""
    memory: float | None = None

    def __post_init__(self) -> None:
        if self.axis not in AXES:
            raise ValueError(f"the axis is {self.axis!r}; use one of {', '.join(AXES)}")
        if (self.seconds is None) != bool(self.skipped):
            raise ValueError(f"{self.contender} in {self.benchmark}: give either its seconds or why it was skipped")

    @property
    def cost(self) -> float | None:
        """Seconds a unit of work; None if it did not run."""
        return None if self.seconds is None else self.seconds / self.work


def size_of(memory: float) -> str:
    """Bytes for people, in units of a million, with three digits."""
    return f"{memory / 1e6:.3g} MB"


def duration(seconds: float) -> str:
    """A time for people, with three digits."""
    for unit, length in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"
