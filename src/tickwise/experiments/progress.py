"""The progress display of long work: what runs, how far it is, and how long it will take."""

from __future__ import annotations

import logging
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

_log = logging.getLogger(__name__)

_MOST_SHOWN = 16
"""Running jobs that are shown at once."""


@dataclass(frozen=True, slots=True)
class Board:
    """Shared memory in which workers note how far their jobs are: a row (done, total) a job.

    Attributes:
        path: The file behind it; every process maps it.
        jobs: The number of jobs.
    """

    path: Path
    jobs: int

    def rows(self) -> NDArray[np.float64]:
        """The rows, shape ``(jobs, 2)``, shared with all other processes; a total of 0 means: not begun."""
        return np.memmap(self.path, dtype=np.float64, mode="r+", shape=(self.jobs, 2))

    def reporter(self, job: int) -> Callable[[int, int], None]:
        """What a worker calls with (done, total) for its job."""
        rows = self.rows()

        def report(done: int, total: int) -> None:
            rows[job] = done, total

        return report


@contextmanager
def board(jobs: int) -> Iterator[Board]:
    """A board for a number of jobs, at least 1; it is removed at the end."""
    with tempfile.TemporaryDirectory(prefix="tickwise-", ignore_cleanup_errors=True) as folder:
        path = Path(folder) / "progress"
        path.write_bytes(bytes(16 * jobs))
        yield Board(path, jobs)


@dataclass(frozen=True, slots=True)
class Item:
    """A job as a person sees it.

    Attributes:
        title: What it is.
        unit: What its progress counts, such as ``episodes``.
        weight: How long it takes relative to the others.
    """

    title: str
    unit: str
    weight: float


class Display:
    """Shows phases of jobs: a live table on a terminal, a line for each finished tenth elsewhere.

    Args:
        console: Where to show them.
    """

    def __init__(self, console: Console) -> None:
        self._console = console

    def skip(self, name: str, jobs: int) -> None:
        """Say that a phase was finished by an earlier call."""
        self._console.print(f"{name}: {_jobs(jobs)} finished before")

    def say(self, line: str) -> None:
        """Tell a person something while the work goes on."""
        self._console.print(line)

    @contextmanager
    def phase(
        self, name: str, items: Sequence[Item], shared: Board, before: int = 0
    ) -> Iterator[Callable[[int], None]]:
        """Show a phase while its jobs run.

        Args:
            name: What the phase does.
            items: Its jobs.
            shared: Where the workers note how far they are, a row for each of the items.
            before: Jobs of the phase that were finished by an earlier call.

        Yields:
            What to call with the index of a job that is done.
        """
        phase = _Phase(name, items, shared)
        if self._console.is_interactive:
            live = Live(get_renderable=phase.render, console=self._console, refresh_per_second=4, transient=True)
            with live:
                yield phase.finish
        else:
            already = f" ({before} finished before)" if before else ""
            self._console.print(f"{name}: {_jobs(len(items))}{already}")
            yield self._line_for_each_tenth(phase)
        self._console.print(f"{name}: done in {_duration(phase.elapsed)}")

    def _line_for_each_tenth(self, phase: _Phase) -> Callable[[int], None]:
        shown = 0

        def finish(job: int) -> None:
            nonlocal shown
            phase.finish(job)
            tenth = int(10 * phase.share())
            if shown < tenth < 10:
                shown = tenth
                self._console.print(f"{phase.name}: {10 * tenth} %{phase.remaining()}")

        return finish


class _Phase:
    """The state of one phase; read by the thread that draws while jobs finish."""

    def __init__(self, name: str, items: Sequence[Item], shared: Board) -> None:
        self.name = name
        self._items = items
        self._rows = shared.rows()
        self._finished = np.zeros(len(items), dtype=np.bool_)
        weights = np.array([item.weight for item in items])
        self._weights = weights / weights.sum()
        self._began = time.monotonic()

    @property
    def elapsed(self) -> float:
        """Seconds since the phase began."""
        return time.monotonic() - self._began

    def finish(self, job: int) -> None:
        """Note that a job is done."""
        self._finished[job] = True
        _log.debug("%s: %s is done after %.1f s", self.name, self._items[job].title, self.elapsed)

    def share(self) -> float:
        """How much of the phase is done, from 0 to 1."""
        return min(float(self._done() @ self._weights), 1.0)

    def remaining(self) -> str:
        """The time left, once it can be told."""
        share, elapsed = self.share(), self.elapsed
        if share < 0.02 or elapsed < 2:
            return ""
        return f", {_duration(elapsed * (1 - share) / share)} left"

    def render(self) -> RenderableType:
        """The phase, and below it what runs."""
        done = self._done()
        head = Table.grid(padding=(0, 1))
        head.add_row(
            Text(self.name, style="bold"),
            ProgressBar(total=1.0, completed=self.share(), width=30),
            Text(f"{self._finished.sum()} of {_jobs(len(done))}, {_duration(self.elapsed)}{self.remaining()}"),
        )
        table = Table.grid(padding=(0, 1))
        running = np.flatnonzero((self._rows[:, 1] > 0) & ~self._finished)
        for job in running[:_MOST_SHOWN]:
            item, (now, total) = self._items[job], self._rows[job]
            table.add_row(
                Text(f"  {item.title}"),
                ProgressBar(total=1.0, completed=float(done[job]), width=24),
                Text(f"{now:,.0f} of {total:,.0f} {item.unit}", style="dim"),
            )
        return Group(head, table)

    def _done(self) -> NDArray[np.float64]:
        """The share of each job that is done, shape ``(jobs,)``."""
        share = np.clip(self._rows[:, 0] / np.maximum(self._rows[:, 1], 1.0), 0.0, 1.0)
        return np.where(self._finished, 1.0, share)


def _jobs(count: int) -> str:
    return f"{count} job{'' if count == 1 else 's'}"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"
