"""Who carries out jobs: the seam that a cluster fits too, and the cores of this machine."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from multiprocessing import active_children, get_context
from typing import Any, Protocol

from tickwise.errors import ConfigurationError, TickwiseError
from tickwise.experiments.job import Job
from tickwise.experiments.jobs import perform
from tickwise.experiments.progress import Board
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec


@dataclass(frozen=True, slots=True)
class Task:
    """A job to carry out, and where.

    Attributes:
        index: Its row on the board.
        job: The job.
        spec: Its study.
        store: Has the artefacts that it needs, and gets its own.
    """

    index: int
    job: Job
    spec: StudySpec
    store: Store


Run = Callable[[Sequence[Task], Board], Iterator[int]]
"""Carries out tasks that do not need each other, and notes on the board how far they are.

The index of each comes back when its artefact is in its store. An error or Ctrl-C gives up those that are left.
"""


class Executor(Protocol):
    """Something that carries out jobs."""

    @property
    def workers(self) -> int:
        """Jobs that it has carried out at the same time, at the most."""
        ...

    def start(self, say: Callable[[str], None]) -> AbstractContextManager[Run]:
        """Be ready for tasks; what a person has to know goes to ``say``, a line at a time."""
        ...


@dataclass(frozen=True, slots=True)
class Local:
    """Processes on this machine.

    Attributes:
        workers: Processes that work at the same time; with 1 the work is done in this process.

    Raises:
        ConfigurationError: If there is not at least one.
    """

    workers: int

    def __post_init__(self) -> None:
        if self.workers < 1:
            raise ConfigurationError(f"there are {self.workers} workers; use 1 or more")

    @contextmanager
    def start(self, say: Callable[[str], None]) -> Iterator[Run]:
        """Start processes as they are needed.

        An error or Ctrl-C ends them at once: artefacts are written atomically, so that nothing is lost but the work
        at hand.
        """
        del say
        if self.workers == 1:
            yield _run_here
            return
        others = set(active_children())
        pool = ProcessPoolExecutor(
            self.workers, mp_context=get_context("spawn"), initializer=_end_with, initargs=(os.getpid(),)
        )
        try:
            yield lambda tasks, shared: _run_in(pool, tasks, shared)
        except BaseException:
            for child in set(active_children()) - others:
                child.kill()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


def executor(workers: int | None, cluster: str | None) -> Executor:
    """What carries out jobs: a cluster, so many processes, or a process a core.

    Raises:
        ConfigurationError: If both are named, or one is not possible.
        TickwiseError: If there cannot be a cluster; see `tickwise.experiments.cluster.Cluster`.
    """
    if cluster is None:
        return Local(default_workers() if workers is None else workers)
    if workers is not None:
        raise ConfigurationError("a cluster has its own workers; leave --workers out")
    from tickwise.experiments.cluster import Cluster

    return Cluster(cluster)


def default_workers() -> int:
    """The number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _run_here(tasks: Sequence[Task], shared: Board) -> Iterator[int]:
    for task in tasks:
        yield _work(task, shared)


def _run_in(pool: ProcessPoolExecutor, tasks: Sequence[Task], shared: Board) -> Iterator[int]:
    try:
        for future in as_completed(_submitted(pool, tasks, shared)):
            yield future.result()
    except BrokenProcessPool as error:
        raise TickwiseError(
            "a worker process was killed, perhaps for want of memory; run the same command again with fewer "
            "--workers: what is finished is kept"
        ) from error


def _submitted(pool: ProcessPoolExecutor, tasks: Sequence[Task], shared: Board) -> list[Future[int]]:
    try:
        # the workers that start now go on ignoring Ctrl-C, and show no traceback
        with _on_signal(signal.SIG_IGN, signal.SIGINT):
            return [pool.submit(_work, task, shared) for task in tasks]
    except OSError as error:  # one was killed while another one started
        raise BrokenProcessPool(str(error)) from error


def _work(task: Task, shared: Board) -> int:
    """Do a task; its index comes back."""
    perform(task.job, task.spec, task.store, shared.reporter(task.index))
    return task.index


def _end_with(parent: int) -> None:
    """Let this worker end soon after the process that started it, even if that was killed, and before any work came."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C, or being told to end (SIGTERM), interrupt the work; only the first counts, so it ends well."""
    with _on_signal(_interrupt_once, signal.SIGINT, signal.SIGTERM):
        yield


def _interrupt_once(number: int, frame: object) -> None:
    del frame
    signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt


@contextmanager
def _on_signal(action: Callable[[int, Any], None] | signal.Handlers, *numbers: int) -> Iterator[None]:
    """Let signals do something else for a while; one that is ignored stays so."""
    main = threading.current_thread() is threading.main_thread()  # no other thread has a say in signals
    before = {number: signal.getsignal(number) for number in numbers if main}
    changed = {number: handler for number, handler in before.items() if handler not in (None, signal.SIG_IGN)}
    for number in changed:
        signal.signal(number, action)
    try:
        yield
    finally:
        for number, handler in changed.items():
            signal.signal(number, handler)
