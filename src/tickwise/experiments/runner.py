"""Carries out studies: their jobs phase by phase over the cores, skipping what is finished."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

from tickwise.errors import ConfigurationError, TickwiseError
from tickwise.experiments.jobs import Job, perform, study_formulas
from tickwise.experiments.progress import Board, Display, Item, board
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec


@dataclass(frozen=True, slots=True)
class Unit:
    """A study to carry out, and where.

    Attributes:
        label: What tells it from others that are carried out with it; empty where it is alone.
        spec: The study.
        folder: Its run folder.
    """

    label: str
    spec: StudySpec
    folder: Path


@dataclass(frozen=True, slots=True)
class _Piece:
    """A job of a unit."""

    unit: Unit
    store: Store
    job: Job

    @property
    def title(self) -> str:
        return f"{self.unit.label}: {self.job.title}" if self.unit.label else self.job.title

    @property
    def weight(self) -> int:
        """How long it takes, relative to others of its phase."""
        return _episodes(self.unit.spec, self.job.subject) if self.job.kind == "learn" else 1


_Phase = tuple[str, list[Job]]
"""A name, and jobs of a study that need artefacts of earlier phases only."""


def run_study(spec: StudySpec, folder: Path, workers: int, display: Display) -> Store:
    """Do all jobs of one study; see `run_units`."""
    return run_units([Unit("", spec, folder)], workers, display)[0]


def run_units(units: Sequence[Unit], workers: int, display: Display) -> list[Store]:
    """Do all jobs of some studies, phase by phase; what an earlier call finished in the same folders is kept.

    The numbers depend on the specifications alone, not on the number of workers or on interruptions.

    Args:
        units: The studies, each with a folder of its own.
        workers: Processes that work at the same time; with 1 the work is done in this process.
        display: Shows the progress.

    Returns:
        The artefacts of each study.

    Raises:
        ConfigurationError: If there is not at least one worker.
        StoreError: If a folder belongs to another configuration or cannot be written.
        TickwiseError: If a job cannot be done; finished jobs are kept.
        KeyboardInterrupt: On Ctrl-C or SIGTERM; finished jobs are kept.
    """
    if workers < 1:
        raise ConfigurationError(f"there are {workers} workers; use 1 or more")
    stores = [Store.open(unit.folder, unit.spec.as_dict()) for unit in units]
    try:
        with _pool(workers) as pool:
            _carry_out([_preparation(unit.spec) for unit in units], units, stores, pool, display)
            learning = [
                _learning(unit.spec, available_methods(unit.spec, store))
                for unit, store in zip(units, stores, strict=True)
            ]
            _carry_out(learning, units, stores, pool, display)
    except BaseException:
        for store in stores:
            store.sweep()
        raise
    return stores


def default_workers() -> int:
    """The number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def available_methods(spec: StudySpec, store: Store) -> tuple[str, ...]:
    """The methods that can run once the formulas are inferred, and that the specification has episodes for.

    Method I needs no formula; II needs φ'^T, III and IV need φ^T, and so logical transferability.
    """
    formulas = study_formulas(store)
    needed = {"II": "target_without_information", "III": "target", "IV": "target"}
    return tuple(
        method for method in spec.learning.most_episodes if method not in needed or formulas[needed[method]] is not None
    )


def planned_jobs(spec: StudySpec, store: Store) -> list[Job]:
    """All jobs of a study whose formulas are inferred, in order."""
    phases = [*_preparation(spec), *_learning(spec, available_methods(spec, store))]
    return [job for _, jobs in phases for job in jobs]


def unfinished(spec: StudySpec, store: Store) -> Job | None:
    """The first job of a study that is not done; None if all are."""
    prepared = [job for _, jobs in _preparation(spec) for job in jobs]
    for job in prepared:
        if not store.has(job.name):
            return job
    return next((job for job in planned_jobs(spec, store) if not store.has(job.name)), None)


def _preparation(spec: StudySpec) -> list[_Phase]:
    return [
        ("Collect", _jobs("collect", ("source", "target"), spec.inferences)),
        ("Infer", _jobs("infer", ("",), spec.inferences)),
    ]


def _learning(spec: StudySpec, methods: Sequence[str]) -> list[_Phase]:
    """The phases that learn."""
    transfer = "IV" in methods
    learners = [method for method in methods if method != "IV"] + ["source"] * transfer
    phases = [("Learn", _jobs("learn", learners, range(spec.runs)))] if learners else []
    return phases + [("Transfer", _jobs("learn", ("IV",), range(spec.runs)))] * transfer


def _jobs(kind: str, subjects: Sequence[str], runs: range) -> list[Job]:
    return [Job(kind, subject, run) for subject in subjects for run in runs]


def _episodes(spec: StudySpec, subject: str) -> int:
    return spec.learning.source_episodes if subject == "source" else spec.learning.most_episodes[subject]


def _carry_out(
    plans: Sequence[list[_Phase]],
    units: Sequence[Unit],
    stores: Sequence[Store],
    pool: ProcessPoolExecutor | None,
    display: Display,
) -> None:
    """The phases of all units, those of the same name together."""
    for name in dict.fromkeys(name for plan in plans for name, _ in plan):
        pieces = [
            _Piece(unit, store, job)
            for plan, unit, store in zip(plans, units, stores, strict=True)
            for phase, jobs in plan
            if phase == name
            for job in jobs
        ]
        pieces.sort(key=lambda piece: -piece.weight)  # the longest first, so that the cores have work to the end
        _phase(name, pieces, pool, display)


def _phase(name: str, pieces: Sequence[_Piece], pool: ProcessPoolExecutor | None, display: Display) -> None:
    left = [piece for piece in pieces if not piece.store.has(piece.job.name)]
    if not left:
        display.skip(name, len(pieces))
        return
    items = [Item(piece.title, piece.job.unit, piece.weight) for piece in left]
    with board(len(left)) as shared, display.phase(name, items, shared, len(pieces) - len(left)) as finish:
        tasks = [(index, piece.job, piece.unit.spec, piece.store, shared) for index, piece in enumerate(left)]
        for index in _results(pool, tasks):
            finish(index)


_Task = tuple[int, Job, StudySpec, Store, Board]


def _results(pool: ProcessPoolExecutor | None, tasks: Sequence[_Task]) -> Iterator[int]:
    """The index of each task when it is done."""
    if pool is None:
        for task in tasks:
            yield _work(*task)
        return
    try:
        # the workers that start now go on ignoring Ctrl-C, and show no traceback
        with _on_signal(signal.SIG_IGN, signal.SIGINT):
            futures: list[Future[int]] = [pool.submit(_work, *task) for task in tasks]
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool as error:
        raise TickwiseError(
            "a worker process was killed, perhaps for want of memory; run the same command again with fewer "
            "--workers: what is finished is kept"
        ) from error


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor | None]:
    """Worker processes, started as they are needed; None if this process does the work itself.

    An error or Ctrl-C ends them at once: artefacts are written atomically, so that nothing is lost but the work at
    hand. Only the first Ctrl-C counts, so that no other one disturbs this; being told to end (SIGTERM) is the same.
    """
    others = set(active_children())
    with _on_signal(_interrupt_once, signal.SIGINT, signal.SIGTERM):
        if workers == 1:
            yield None
            return
        pool = ProcessPoolExecutor(
            workers, mp_context=get_context("spawn"), initializer=_end_with, initargs=(os.getpid(),)
        )
        try:
            yield pool
        except BaseException:
            for child in set(active_children()) - others:
                child.kill()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


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


def _work(index: int, job: Job, spec: StudySpec, store: Store, shared: Board) -> int:
    """Do a job; its index comes back."""
    perform(job, spec, store, shared.reporter(index))
    return index


def _end_with(parent: int) -> None:
    """Let this worker end soon after the process that started it, even if that was killed, and before any work came."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
