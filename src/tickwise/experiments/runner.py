"""Carries out studies: their jobs phase by phase over the cores, skipping what is finished."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tickwise.experiments.executors import Executor, Local, Run, Task, interruptible
from tickwise.experiments.inferences import satisfying_source, study_formulas
from tickwise.experiments.job import Job, inference_job
from tickwise.experiments.progress import Display, Item, board
from tickwise.experiments.store import Store
from tickwise.experiments.study import PROTOCOLS, StudySpec


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


def run_study(spec: StudySpec, folder: Path, workers: int | Executor, display: Display) -> Store:
    """Do all jobs of one study; see `run_units`."""
    return run_units([Unit("", spec, folder)], workers, display)[0]


def run_units(units: Sequence[Unit], workers: int | Executor, display: Display) -> list[Store]:
    """Do all jobs of some studies, phase by phase; what an earlier call finished in the same folders is kept.

    The numbers depend on the specifications alone, not on who does the jobs or on interruptions.

    Args:
        units: The studies, each with a folder of its own.
        workers: Processes that work at the same time, with 1 this one; or something else that carries out jobs.
        display: Shows the progress.

    Returns:
        The artefacts of each study.

    Raises:
        ConfigurationError: If there is not at least one worker.
        StoreError: If a folder belongs to another configuration or cannot be written.
        TickwiseError: If a job cannot be done; finished jobs are kept.
        KeyboardInterrupt: On Ctrl-C or SIGTERM; finished jobs are kept.
    """
    executor = Local(workers) if isinstance(workers, int) else workers
    stores = [Store.open(unit.folder, unit.spec.as_dict()) for unit in units]
    try:
        with interruptible(), executor.start(display.say) as run:
            _carry_out([_preparation(unit.spec) for unit in units], units, stores, run, display)
            learning = [
                _learning(unit.spec, available_methods(unit.spec, store))
                for unit, store in zip(units, stores, strict=True)
            ]
            _carry_out(learning, units, stores, run, display)
    except BaseException:
        for store in stores:
            store.sweep()
        raise
    return stores


def available_methods(spec: StudySpec, store: Store) -> tuple[str, ...]:
    """The methods that can run once the formulas are inferred, and that the specification has episodes for.

    Method I needs no formula; II needs φ'^T, III and IV need φ^T, and so logical transferability; V needs φ^S alone, if
    it is satisfying.
    """
    formulas = {**study_formulas(spec, store), "source": satisfying_source(spec, store)}
    needed = {"II": "target_without_information", "III": "target", "IV": "target", "V": "source"}
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
        ("Infer", [inference_job(protocol, run) for protocol in PROTOCOLS for run in spec.inferred(protocol)]),
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
    run: Run,
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
        _phase(name, pieces, run, display)


def _phase(name: str, pieces: Sequence[_Piece], run: Run, display: Display) -> None:
    left = [piece for piece in pieces if not piece.store.has(piece.job.name)]
    if not left:
        display.skip(name, len(pieces))
        return
    items = [Item(piece.title, piece.job.unit, piece.weight) for piece in left]
    with board(len(left)) as shared, display.phase(name, items, shared, len(pieces) - len(left)) as finish:
        tasks = [Task(index, piece.job, piece.unit.spec, piece.store) for index, piece in enumerate(left)]
        for index in run(tasks, shared):
            finish(index)
