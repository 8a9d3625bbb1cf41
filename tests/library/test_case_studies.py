"""The whole loop on the paper's case studies: each target task finds the source task that it was made for."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tickwise.experiments.artefacts import Parcel
from tickwise.experiments.case_studies import find_study
from tickwise.experiments.inferences import labelled_data
from tickwise.experiments.job import Job
from tickwise.experiments.jobs import compute
from tickwise.library.entry import Entry
from tickwise.library.folder import Library
from tickwise.library.handover import transfer
from tickwise.library.ranking import rank
from tickwise.library.target import Target
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.qlearning import Problem, evaluate, learn
from tickwise.rl.states import automaton_memory
from tickwise.transfer.hypothesis import tick_tables

pytestmark = pytest.mark.slow  # fits take minutes

STUDIES = {
    "case1": find_study("case1").true["source"],
    "case2": "G[0,17] F[0,8] (2 <= x <= 3 & 2 <= y <= 3)",  # as it is inferred: its effect ends with the episode
}
"""What is asked for in each source task."""


@cache
def source(study: str) -> Entry:
    """The source task, learned on what it asks for."""
    spec = find_study(study)
    formula, ticks = to_sdnf(parse(STUDIES[study])), spec.source.task.deadline
    mdp = spec.source.mdp()
    problem = Problem(mdp, spec.source.task_table(), automaton_memory(mdp, tick_tables(formula, ticks)))
    q = problem.initial_q(spec.learning.source)
    learn(problem, q, spec.learning.source, np.random.default_rng(0), 300_000)
    return Entry(study, formula, mdp, ticks, q)


@pytest.mark.parametrize("study", STUDIES)
def test_a_target_task_finds_its_source(study: str, tmp_path: Path):
    library = Library.open(tmp_path / "tasks", create=True)
    for name in STUDIES:
        library.add(source(name))
    spec = find_study(study)
    _, collected = compute(Job("collect", "target", 0), spec, Parcel({}), lambda *_: None)
    data = labelled_data(spec, Parcel({collected.name: collected}), "target", 0)
    mdp, ticks = spec.target.mdp(), spec.target.task.deadline
    strategy, form = spec.learning.disjunct, spec.learning.form("IV")
    target = Target.in_world(data, mdp, ticks, spec.inference, spec.swarm, disjunct=strategy, form=form)
    found = rank([library.read(name) for name in library.names()], target)
    assert found.best.entry.name == study

    start = transfer(found.best.entry, found.best.fit, target, "start")
    problem = Problem(mdp, spec.target.task_table(), start.memory())
    fresh, warm = problem.initial_q(spec.learning.settings), start.q.copy()
    seed = np.random.SeedSequence(0)
    assert evaluate(problem, warm, seed, 500) > evaluate(problem, fresh, seed, 500)
    means = [learn(problem, q, spec.learning.settings, np.random.default_rng(0), 3_000).mean() for q in (fresh, warm)]
    assert means[1] > means[0]
