"""A study so small that all of it runs in seconds; as a program, the command line with it among the studies.

For tests that need a process of their own: ``python -m tests.experiments.tiny reproduce tiny --out DIR`` does all,
``python -m tests.experiments.tiny artefacts tiny DIR WORKERS`` all but the report.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from tickwise.cli import main
from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tasks import ReachStayReach
from tickwise.experiments import case_studies
from tickwise.experiments.case_studies import CASE_STUDY_1
from tickwise.experiments.progress import Display
from tickwise.experiments.runner import run_study
from tickwise.experiments.study import Collection, Learning, StudySpec
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.syntax import Box
from tickwise.rl.qlearning import QSettings

TINY = replace(
    CASE_STUDY_1,
    name="tiny",
    title="A tiny study",
    source=EnvironmentSpec(
        "TinySource",
        GridWorld(4),
        ReachStayReach(first=Box.of(x=(0, 2), y=(0, 2)), stay=2, second=Box.of(x=(2, 4), y=(2, 4)), deadline=14),
    ),
    target=EnvironmentSpec(
        "TinyTarget",
        GridWorld(4),
        ReachStayReach(first=Box.of(x=(2, 4), y=(0, 2)), stay=2, second=Box.of(x=(0, 2), y=(2, 4)), deadline=14),
    ),
    collection=Collection(episodes=150, tau=2, negatives=60, positives={"source": 30, "target": 30}, most_episodes=600),
    inference=InferenceSettings(size=4, rate=0.9, information_weight=0.01, depth=2),
    swarm=SwarmSettings(particles=16, iterations=15, restarts=1, stall=5),
    learning=Learning(
        settings=QSettings(initial=60.0),
        source_episodes=30_000,
        most_episodes={"I": 20_000, "II": 20_000, "III": 20_000, "IV": 20_000},
        window=2_000,
        evaluation_episodes=50,
        evaluation_steps=((1_000, 100), (0, 2_000)),
    ),
    true={
        "source": "F[0,5] G[0,2] (x <= 2 & y <= 2) & F[8,14] (x >= 2 & y >= 2)",
        "target": "F[0,5] G[0,2] (x >= 2 & y <= 2) & F[8,14] (x <= 2 & y >= 2)",
    },
    runs=2,
)
"""Two worlds of 4×4 cells, 14 ticks, two runs: all four methods, as in Case Study 1."""

HOPELESS = replace(TINY, name="hopeless", inference=replace(TINY.inference, rate=1.0, size=1, depth=1))
"""The same with a size and a rate that no formula meets, so that nothing is transferable."""

LONG = replace(
    TINY,
    name="long",
    learning=replace(TINY.learning, source_episodes=40_000_000, most_episodes=dict.fromkeys(("I", "III"), 40_000_000)),
)
"""One that would run for minutes: to be interrupted."""

STUDIES: dict[str, StudySpec] = {study.name: study for study in (TINY, HOPELESS, LONG)}


def write_artefacts(name: str, folder: str, workers: str) -> None:
    run_study(STUDIES[name], Path(folder), int(workers), Display(Console(stderr=True)))


if __name__ == "__main__":
    if sys.argv[1] == "artefacts":
        sys.exit(write_artefacts(*sys.argv[2:]))
    case_studies.STUDIES.update(STUDIES)
    sys.exit(main())
