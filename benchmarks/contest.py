"""Contenders take turns at the same work, so that what else the machine does disturbs all of them alike."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks.result import Result

Turn = Callable[[], Any]
"""One repetition; what comes back is the answer."""


class UnavailableError(Exception):
    """A contender cannot run here; the message says why."""


@dataclass(frozen=True, slots=True)
class Contender:
    """One who does the work.

    Attributes:
        name: What it is called in tables and pictures.
        prepare: Makes everything ready, without being timed, and returns the repetition to time. Its first turn is
            not timed either: it compiles. An `ImportError` or `UnavailableError` means that it is skipped.
        work: Units of work in a repetition: a slow contender is given less.
        repetitions: How often it is timed.
        warm: Whether there is such a first turn.
        rounds: Turns in a repetition, for what is too short to be timed alone; the time is that of one.
    """

    name: str
    prepare: Callable[[], Turn]
    work: float
    repetitions: int
    warm: bool = True
    rounds: int = 1


def contest(
    benchmark: str,
    unit: str,
    contenders: Sequence[Contender],
    *,
    axis: str = "none",
    size: int = 0,
    agree: Callable[[Any, Any], bool] | None = None,
    clock: Callable[[], float] = time.process_time,
) -> list[Result]:
    """Time the contenders in turns.

    Args:
        benchmark: What is done.
        unit: The unit of work.
        contenders: Who does it; the first is the one that answers are compared with.
        axis: What `size` counts.
        size: How much of it.
        agree: Whether two answers, the first's and another's, are the same; asked of the last answers of all that
            have the first's units of work. None asks nothing.
        clock: Says the time in seconds; by default this process's processor time.

    Returns:
        The results, in the order of the contenders.

    Raises:
        SystemExit: If two answers do not agree: then the times mean nothing.
    """
    turns: dict[str, Turn] = {}
    skipped: dict[str, str] = {}
    for one in contenders:
        try:
            turns[one.name] = one.prepare()
            if one.warm:
                turns[one.name]()
        except (ImportError, UnavailableError) as error:
            turns.pop(one.name, None)
            skipped[one.name] = str(error).splitlines()[0]
    seconds: dict[str, list[float]] = {name: [] for name in turns}
    answers: dict[str, Any] = {}
    gc.collect()
    for repetition in range(max(one.repetitions for one in contenders)):
        for one in contenders:
            if one.name in turns and repetition < one.repetitions:
                begin = clock()
                for _ in range(one.rounds):
                    answers[one.name] = turns[one.name]()
                seconds[one.name].append((clock() - begin) / one.rounds)
    first = contenders[0]
    for one in contenders[1:]:
        comparable = one.name in answers and one.work == first.work
        if agree is not None and comparable and not agree(answers[first.name], answers[one.name]):
            raise SystemExit(f"{benchmark} at size {size}: {one.name} and {first.name} do not agree")
    return [
        Result(benchmark, axis, size, one.name, None, one.work, unit, skipped[one.name])
        if one.name in skipped
        else Result(benchmark, axis, size, one.name, statistics.median(seconds[one.name]), one.work, unit)
        for one in contenders
    ]
