"""A small study, as its runs grow, with one worker and with two.

It is Case Study 1 with a short search and method I alone: what a real study adds is more of the same. The time is that
of the clock, the start of the workers included, and two workers on a machine that is busy with other things are not
twice as fast.
"""

from __future__ import annotations

import functools
import io
import itertools
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from benchmarks.contest import Contender, Turn, contest
from benchmarks.result import OURS, Result
from tickwise.experiments.case_studies import CASE_STUDY_1
from tickwise.experiments.progress import Display
from tickwise.experiments.runner import run_study
from tickwise.experiments.study import StudySpec
from tickwise.inference.swarm import SwarmSettings

RUNS = (1, 2, 4, 8)


def small(runs: int, quick: bool) -> StudySpec:
    """Collect and infer once and briefly, then learn on τ-states in every run."""
    learning = replace(CASE_STUDY_1.learning, most_episodes={"I": 20_000 if quick else 150_000}, window=1_000)
    swarm = SwarmSettings(particles=8, iterations=5, restarts=1, stall=2)
    return replace(CASE_STUDY_1, learning=learning, swarm=swarm, runs=runs, collections=1, short=True)


def carried_out(spec: StudySpec, workers: int, folder: Path) -> Turn:
    numbers = itertools.count()

    def turn() -> list[str]:
        into = folder / f"{spec.runs}-{workers}-{next(numbers)}"
        run_study(spec, into, workers, Display(Console(file=io.StringIO())))
        return sorted(path.name for path in (into / "artefacts").iterdir())

    return turn


def measure(quick: bool) -> list[Result]:
    results = []
    with tempfile.TemporaryDirectory() as name:
        carried_out(small(1, quick=True), 1, Path(name) / "first")()  # compiles
        for runs in RUNS[:2] if quick else RUNS:
            spec = small(runs, quick)
            contenders = [
                Contender(label, functools.partial(carried_out, spec, workers, Path(name)), 1, 1, warm=False)
                for label, workers in ((OURS, 1), ("2 workers", 2))
            ]
            results += contest(
                "study", "study", contenders, axis="runs", size=runs, agree=list.__eq__, clock=time.perf_counter
            )
    return results
