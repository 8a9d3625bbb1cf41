"""The pieces of work of a study, each a function of the specification and of earlier artefacts."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._seeding import generator, seed_sequence
from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import optimal_value
from tickwise.errors import ConfigurationError, DataError
from tickwise.experiments.artefacts import Artefact, Artefacts
from tickwise.experiments.measures import block_means, goal_reached
from tickwise.experiments.memory import peak_memory_mib
from tickwise.experiments.store import Store
from tickwise.experiments.study import Collection, StudySpec
from tickwise.inference.fit import Fit
from tickwise.inference.information import information_gain
from tickwise.inference.prior import PathPrior
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.template import fit_transferable
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import DecisionTree, InferenceSettings, classification_rate
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.rl.qlearning import Problem, collect, evaluate, learn
from tickwise.rl.states import automaton_memory, disjunct_choice, tau_memory
from tickwise.transfer.hypothesis import PARTS, Task, tick_tables, transfer_structure
from tickwise.transfer.qtransfer import transfer_q

Report = Callable[[int, int], None]
"""Told how much of a job is done, and out of how much."""


@dataclass(frozen=True, slots=True)
class Job:
    """A piece of work: its kind, what it is about, and the run.

    Attributes:
        kind: ``collect``, ``infer`` or ``learn``.
        subject: The task ``source`` or ``target`` of a collection, or what learns: ``source``, ``I`` … ``IV``.
        run: The number of the run, from 0.
    """

    kind: str
    subject: str
    run: int

    @property
    def name(self) -> str:
        """The name of the artefact."""
        return "-".join(part for part in (self.kind, self.subject, str(self.run)) if part)

    @property
    def title(self) -> str:
        """What a person reads while it runs."""
        what = {
            "collect": f"collect in the {self.subject} task",
            "infer": "infer formulas",
            "learn": "learn the source task" if self.subject == "source" else f"Method {self.subject}",
        }
        return f"{what[self.kind]}, run {self.run + 1}"

    @property
    def unit(self) -> str:
        """What its progress counts."""
        return "formulas" if self.kind == "infer" else "episodes"

    @property
    def needs(self) -> tuple[str, ...]:
        """The names of the artefacts that it is made from."""
        if self.kind == "infer":
            return tuple(Job("collect", task, self.run).name for task in ("source", "target"))
        if self.kind == "collect" or self.subject == "I":
            return ()
        learned = (Job("learn", "source", self.run).name,) if self.subject == "IV" else ()
        return (_FORMULAS.name, *learned)


_FORMULAS = Job("infer", "", 0)
"""All runs learn with the formulas of the first collection, as the paper has one of each."""


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


@dataclass(frozen=True, slots=True)
class _Outcome:
    """What a job gave, apart from what else it cost than time and memory as a whole."""

    manifest: dict[str, Any]
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)
    cost: dict[str, Any] = field(default_factory=dict)


def _collect(job: Job, spec: StudySpec, store: Artefacts, report: Report) -> _Outcome:
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
    return _labelled(job, phase, np.concatenate(returns), np.concatenate(paths), rng)


def desired(phase: Collection, returns: NDArray[np.float32], paths: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which episodes get label 1, by the study's criterion of performance, shape ``(episodes,)``."""
    if phase.least_ticks is None:
        return np.asarray(returns > 0)
    return np.asarray(paths[:, phase.least_ticks] >= 0)


def _labelled(
    job: Job, phase: Collection, returns: NDArray[np.float32], paths: NDArray[np.int32], rng: np.random.Generator
) -> _Outcome:
    """All trajectories with label 1, and some of the others at random, which get label -1."""
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
    return _Outcome(facts, {"paths": paths[picked], "labels": labels})


def labelled_data(spec: StudySpec, store: Artefacts, task: str, run: int) -> LabelledTrajectories:
    """The labelled trajectories of a collection; the state is the robot's position.

    Where label 1 is for lasting long, the last state of these trajectories is left out (Case Study 2). Where there
    is to be noise, labels are turned round after that.
    """
    mdp = environment_of(spec, task).mdp()
    content = store.load(Job("collect", task, run).name)
    paths, labels = content["paths"], content["labels"]
    lengths = (paths >= 0).sum(axis=1)
    values = np.where(paths[..., None] >= 0, mdp.coordinates[paths], np.nan)
    ids = tuple(str(number) for number in range(len(paths)))
    data = LabelledTrajectories(values, lengths, labels, mdp.variables, ids)
    data = data if spec.collection.least_ticks is None else data.drop_last(labels == 1)
    wrong = round(spec.collection.noise * len(data))
    if not wrong:
        return data
    rng = generator(spec.seed, spec.name, "noise", task, run)
    turned = np.isin(np.arange(len(data)), rng.choice(len(data), wrong, replace=False))
    return replace(data, labels=np.where(turned, -data.labels, data.labels))


def environment_of(spec: StudySpec, task: str) -> EnvironmentSpec:
    """The environment of ``source`` or ``target``."""
    return spec.source if task == "source" else spec.target


def inference_task(spec: StudySpec, store: Artefacts, task: str, run: int) -> Task:
    """What inference needs: the data, the uniform prior over the MDP's paths, and whole cells as regions."""
    environment = environment_of(spec, task)
    mdp, horizon = environment.mdp(), environment.task.deadline
    prior = PathPrior(mdp.support_graph(), mdp.coordinates, variables=mdp.variables, horizon=horizon)
    space = SearchSpace.grid(environment.world.size, horizon, mdp.variables)
    return Task(labelled_data(spec, store, task, run), prior, space)


STEPS = (*PARTS, "plain")
"""What an inference consists of: the parts of Steps 1 and 2, and Step 2 without the information gain."""


def _infer(job: Job, spec: StudySpec, store: Artefacts, report: Report) -> _Outcome:
    """Steps 1 and 2 (Section IV-B), and φ'^T, which is Step 2 without the information gain.

    φ'^T is Method II's, and is left out with it. The cost has the processor time in seconds of each of `STEPS` that
    was taken: it depends less than the time on the wall on what else the machine does.
    """
    source, target = (inference_task(spec, store, task, job.run) for task in ("source", "target"))
    rngs = [generator(spec.seed, spec.name, "infer", what, job.run) for what in ("source", "target", "plain")]
    report(0, len(STEPS))
    _compile_inference()
    marks = [time.thread_time()]

    def done(step: str) -> None:
        marks.append(time.thread_time())
        report(STEPS.index(step) + 1, len(STEPS))

    found = transfer_structure(source, target, spec.inference, spec.swarm, rngs[0], rngs[1], done)
    manifest: dict[str, Any] = {
        "run": job.run,
        "source": {
            **_formula_facts(found.source, source, spec.inference),
            "satisfying": found.source_satisfying,
            "tree": _tree(found.tree),
        },
        "target": {
            "formula": _text(found.target),
            "transferable": found.transferable,
            "reason": found.reason,
            "attempts": [_fit(attempt) for attempt in found.fit.attempts] if found.fit else [],
        },
        "target_without_information": None,
    }
    if found.source is not None and found.source_satisfying and "II" in spec.learning.most_episodes:
        plain = replace(spec.inference, information_weight=0.0)
        fit = fit_transferable(target.data, target.prior, target.space, found.source, plain, spec.swarm, rngs[2])
        manifest["target_without_information"] = _fit(fit.attempts[-1])
        done("plain")
    seconds = {name: round(now - before, 4) for name, (before, now) in zip(STEPS, pairwise(marks), strict=False)}
    return _Outcome(manifest, cost={"step_seconds": seconds})


@cache
def _compile_inference() -> None:
    """Infer from next to nothing, once a process: what is timed after it has nothing left to compile or to load."""
    mdp = GridWorld(2).mdp()
    values = np.repeat(mdp.coordinates[[0, 0, -1, -1], None], 13, axis=1)
    names = tuple("abcd")
    data = LabelledTrajectories(values, np.full(4, 13), np.array([1, 1, -1, -1], np.int8), mdp.variables, names)
    prior = PathPrior(mdp.support_graph(), mdp.coordinates, variables=mdp.variables, horizon=12)
    task = Task(data, prior, SearchSpace.grid(2, 12, mdp.variables))
    swarm = SwarmSettings(particles=4, iterations=2, restarts=1, climbers=1)
    settings = InferenceSettings(size=4, rate=1.0, depth=1)
    transfer_structure(task, task, settings, swarm, np.random.default_rng(0), np.random.default_rng(0))


def _text(formula: SDNF | None) -> str | None:
    return None if formula is None else str(formula)


def _fit(fit: Fit) -> dict[str, Any]:
    return {
        "formula": str(fit.formula), "rate": fit.rate, "gain": fit.gain, "size": fit.size,
        "satisfying": fit.satisfying,
    }  # fmt: skip


def _formula_facts(formula: SDNF | None, task: Task, settings: InferenceSettings) -> dict[str, Any]:
    if formula is None:
        return {"formula": None, "rate": None, "gain": None, "size": None}
    rate = classification_rate(formula, task.data, settings.class_weight)
    gain = information_gain(formula, task.prior)
    return {"formula": str(formula), "rate": rate, "gain": gain, "size": formula.size}


def _tree(node: DecisionTree | None) -> dict[str, Any] | None:
    if node is None:
        return None
    path = node.path_formula
    inner = node.primitive is not None
    return {
        "label": node.label, "formula": str(node.primitive) if inner else None,
        "path": "true" if path is None else str(path),
        "positives": node.positives, "negatives": node.negatives, "stop": node.stop,
        "objective": node.objective if inner else None, "rate": node.rate if inner else None,
        "gain": node.gain if inner else None, "left": _tree(node.left), "right": _tree(node.right),
    }  # fmt: skip


def study_formulas(store: Artefacts) -> dict[str, SDNF | None]:
    """The formulas that all runs learn with.

    φ^T and φ'^T are None where they are not satisfying formulas of the target task (Problem 1).
    """
    found = store.load(_FORMULAS.name)
    plain = found["target_without_information"]
    texts = {
        "source": found["source"]["formula"],
        "target": found["target"]["formula"],
        "target_without_information": plain["formula"] if plain and plain["satisfying"] else None,
    }
    return {name: None if text is None else to_sdnf(parse(text)) for name, text in texts.items()}


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
    formula = study_formulas(store)[names[subject]]
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


def _learn(job: Job, spec: StudySpec, store: Artefacts, report: Report) -> _Outcome:
    """Q-learning (Step 3) of the source task or of one of Methods I to IV, with evaluations on fixed seeds."""
    learning, subject = spec.learning, job.subject
    settings = learning.source if subject == "source" else learning.settings
    problem = learning_problem(spec, store, subject)
    q = problem.initial_q(settings)
    if subject == "IV":
        source = learning_problem(spec, store, "source")
        learned = store.load(Job("learn", "source", job.run).name)["q"]
        q = transfer_q(source.mdp, source.memory, learned, problem.mdp, problem.memory, settings.initial)
    rng = generator(spec.seed, spec.name, "learn", subject, job.run)
    fixed = seed_sequence(spec.seed, spec.name, "evaluate")
    episodes = learning.source_episodes if subject == "source" else learning.most_episodes[subject]
    points = evaluation_points(spec, episodes)
    values = [evaluate(problem, q, fixed, learning.evaluation_episodes)]
    parts = []
    for before, now in pairwise(points):
        report(before, episodes)
        parts.append(learn(problem, q, settings, rng, now - before))
        values.append(evaluate(problem, q, fixed, learning.evaluation_episodes))
    returns = np.concatenate(parts)
    arrays: dict[str, NDArray[Any]] = {
        "blocks": block_means(returns, learning.block),
        "evaluation_episodes": np.array(points, dtype=np.int64),
        "evaluation_returns": np.array(values, dtype=np.float64),
    }
    if subject == "source":
        arrays["q"] = q
    goal = goal_reached(returns, learning.goal, optimal_value(problem.mdp, problem.task))
    return _Outcome({"run": job.run, "episodes": episodes, "goal": goal}, arrays)


_KINDS: dict[str, Callable[[Job, StudySpec, Artefacts, Report], _Outcome]] = {
    "collect": _collect,
    "infer": _infer,
    "learn": _learn,
}
