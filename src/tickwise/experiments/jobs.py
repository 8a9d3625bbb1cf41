"""The pieces of work of a study, each a function of the specification and of earlier artefacts."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._seeding import generator
from tickwise.errors import ConfigurationError, DataError
from tickwise.experiments.artefacts import Artefact, Artefacts
from tickwise.experiments.closing import learn_in_closed_loop
from tickwise.experiments.course import learning_course
from tickwise.experiments.inferences import infer, study_formulas
from tickwise.experiments.job import Job, Outcome, Report
from tickwise.experiments.memory import peak_memory_mib
from tickwise.experiments.store import Store
from tickwise.experiments.study import Collection, StudySpec, environment_of
from tickwise.rl.learner import Learner, QLearning
from tickwise.rl.qlearning import Problem, collect
from tickwise.rl.states import automaton_memory, disjunct_choice, tau_memory
from tickwise.rl.trusting import Trusting, TrustingLearner
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.variants import transfer


def perform(job: Job, spec: StudySpec, store: Store, report: Report) -> None:
    """Do a job and write its artefact, and before that what it cost; nothing is done where it is there already.

    Raises:
        DataError: If a collection gives no trajectory of label 1.
        StoreError: If the artefact cannot be written.
    """
    if store.has(job.name):
        return
    for artefact in compute(job, spec, store, report):
        store.put(artefact)


def compute(job: Job, spec: StudySpec, artefacts: Artefacts, report: Report) -> tuple[Artefact, Artefact]:
    """What a job cost, and what it gives: a function of the specification and of the artefacts that it needs.

    Raises:
        DataError: If a collection gives no trajectory of label 1.
    """
    began = time.perf_counter()
    outcome = _KINDS[job.kind](job, spec, artefacts, report)
    cost = {"seconds": round(time.perf_counter() - began, 3), "memory_mib": peak_memory_mib(), **outcome.cost}
    return Artefact.pack(f"cost-{job.name}", cost, {}), Artefact.pack(job.name, outcome.manifest, outcome.arrays)


def _collect(job: Job, spec: StudySpec, store: Artefacts, report: Report) -> Outcome:
    """The data collection phase (Section IV-A): label the first episodes of Q-learning on τ-states."""
    del store
    phase = spec.collection
    environment = environment_of(spec, job.subject)
    mdp = environment.mdp()
    problem = Problem(mdp, environment.task_table(), tau_memory(mdp, phase.tau))
    settings = spec.learning.settings
    if phase.epsilon is not None:
        settings = replace(settings, epsilon=phase.epsilon)
    q = problem.initial_q(settings)
    rng = generator(spec.seed, spec.name, "collect", job.subject, job.run)
    step = max(phase.episodes // 10, 1)
    returns: list[NDArray[np.float32]] = []
    paths: list[NDArray[np.int32]] = []
    episodes = positives = 0
    while episodes < phase.episodes or (positives < phase.positives[job.subject] and episodes < phase.most_episodes):
        report(episodes, max(episodes, phase.episodes))
        # the phase ends at its exact length, whatever the step
        count = min(step, phase.episodes - episodes) if episodes < phase.episodes else step
        part = collect(problem, q, settings, rng, count)
        returns.append(part[0])
        paths.append(part[1])
        episodes += count
        positives += int(desired(phase, *part).sum())
    everything = np.concatenate(paths).astype(np.min_scalar_type(-mdp.n_states))
    return _labelled(job, spec, np.concatenate(returns), everything, rng)


def desired(phase: Collection, returns: NDArray[np.float32], paths: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which episodes get label 1, by the study's criterion of performance, shape ``(episodes,)``."""
    if phase.least_ticks is None:
        return np.asarray(returns > 0)
    return np.asarray(paths[:, phase.least_ticks] >= 0)


def _labelled(
    job: Job,
    spec: StudySpec,
    returns: NDArray[np.float32],
    paths: NDArray[np.signedinteger[Any]],
    rng: np.random.Generator,
) -> Outcome:
    """All trajectories with label 1, and some of the others at random, which get label -1.

    The rest of the others is kept where the full protocol infers from it, in an integer type as small as will do.
    """
    phase = spec.collection
    good = desired(phase, returns, paths)
    positive, other = np.flatnonzero(good), np.flatnonzero(~good)
    if not len(positive):
        raise DataError(
            f"no trajectory of the {job.subject} task got label 1 in {len(returns):,} episodes; raise most_episodes"
        )
    if not len(other):
        raise DataError(f"all {len(returns):,} trajectories of the {job.subject} task got label 1; collect fewer")
    chosen = np.sort(rng.choice(other, min(phase.negatives, len(other)), replace=False))
    picked = np.concatenate([positive, chosen])
    labels = np.where(good[picked], 1, -1).astype(np.int8)
    facts = {
        "run": job.run, "positives": len(positive), "negatives": len(chosen), "candidates": len(other),
        "episodes": len(returns), "of_the_first": phase.episodes,
        "positives_of_the_first": int(good[: phase.episodes].sum()),
    }  # fmt: skip
    arrays: dict[str, NDArray[Any]] = {"paths": paths[picked].astype(np.int32), "labels": labels}
    if job.run in spec.inferred("full"):
        arrays["rest"] = paths[np.setdiff1d(other, chosen)]
    return Outcome(facts, arrays)


def learning_problem(spec: StudySpec, store: Artefacts, subject: str) -> Problem:
    """What ``source`` or a method learns on: τ-states for Method I, extended states for all else (Section V).

    Raises:
        ConfigurationError: If the formula that it needs was not inferred.
    """
    environment = environment_of(spec, "source" if subject == "source" else "target")
    mdp = environment.mdp()
    if subject == "I":
        return Problem(mdp, environment.task_table(), tau_memory(mdp, spec.collection.tau))
    names = {"source": "source", "II": "target_without_information", "III": "target", "IV": "target"}
    formula = study_formulas(spec, store)[names[subject]]
    if formula is None:
        raise ConfigurationError(f"{subject} needs a formula, and none was inferred; leave it out")
    tables = tick_tables(formula, environment.task.deadline)
    memory = automaton_memory(mdp, tables, disjunct_choice(spec.learning.disjunct))
    return Problem(mdp, environment.task_table(), memory)


def evaluation_points(spec: StudySpec, episodes: int) -> list[int]:
    """The numbers of episodes after which the greedy policy is evaluated, the last at the end."""
    points = [0]
    while points[-1] < episodes:
        now = points[-1]
        every = next(step for until, step in spec.learning.evaluation_steps if now < until or not until)
        points.append(min((now // every + 1) * every, episodes))
    return points


def _learn(job: Job, spec: StudySpec, store: Artefacts, report: Report) -> Outcome:
    """Q-learning (Step 3) of the source task or of one of Methods I to IV, evaluated, and recorded, on fixed seeds."""
    learning, subject = spec.learning, job.subject
    if subject == "V":
        return learn_in_closed_loop(job, spec, store, report)
    problem = learning_problem(spec, store, subject)
    if subject == "source":
        # what was visited is counted only where transfer asks for it
        form = Trusting(learning.source) if learning.transfer.needs_visits else QLearning(learning.source)
        learner: Learner = form.learner(problem)
    elif subject == "IV":
        learner = _transferred(job, spec, store, problem)
    else:
        learner = learning.form(subject).learner(problem)
    episodes = learning.source_episodes if subject == "source" else learning.most_episodes[subject]
    points = evaluation_points(spec, episodes)
    course = learning_course(job, spec, learner, lambda: problem.memory, points, report)
    if subject == "source":
        course.arrays["q"] = learner.q
        if isinstance(learner, TrustingLearner):
            course.arrays["visits"] = learner.visits
    return course


def _transferred(job: Job, spec: StudySpec, store: Artefacts, problem: Problem) -> Learner:
    """What learns the target from the source's values (Algorithm 2, or what the study has beyond it)."""
    learning = spec.learning
    learned = store.load(Job("learn", "source", job.run).name)
    source = learning_problem(spec, store, "source")
    visits, how = learned.get("visits"), learning.transfer
    moved = transfer(source, learned["q"], visits, problem, learning.settings.initial, how)
    if how.confidence is not None:
        return Trusting(learning.settings).learner(problem, moved.q, moved.confidence)
    return learning.form("IV").learner(problem, moved.q)


_KINDS: dict[str, Callable[[Job, StudySpec, Artefacts, Report], Outcome]] = {
    "collect": _collect,
    "infer": infer,
    "learn": _learn,
}
