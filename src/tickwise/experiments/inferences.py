"""What is inferred from the collections of a study: formulas, by each protocol."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from tickwise._seeding import generator
from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.gridworld import GridWorld
from tickwise.experiments.artefacts import Artefacts
from tickwise.experiments.job import Job, Outcome, Report, formulas_job
from tickwise.experiments.study import StudySpec, environment_of, full_settings
from tickwise.inference.exact import ExactSettings
from tickwise.inference.fit import Fit
from tickwise.inference.information import information_gain
from tickwise.inference.prior import PathPrior
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.template import fit_transferable
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import DecisionTree, InferenceSettings, Search, classification_rate
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.transfer.hypothesis import PARTS, Task, transfer_structure


def labelled_data(
    spec: StudySpec, store: Artefacts, task: str, run: int, protocol: str = "paper"
) -> LabelledTrajectories:
    """The labelled trajectories of a collection that a protocol uses; the state is the robot's position.

    Where label 1 is for lasting long, the last state of these trajectories is left out (Case Study 2). Where there
    is to be noise, labels are turned round after that.
    """
    mdp = environment_of(spec, task).mdp()
    content = store.load(Job("collect", task, run).name)
    paths, labels = content["paths"], content["labels"]
    if protocol == "full":
        paths = np.concatenate([paths, content["rest"]])
        labels = np.concatenate([labels, np.full(len(content["rest"]), -1, labels.dtype)])
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


def inference_task(spec: StudySpec, store: Artefacts, task: str, run: int, protocol: str = "paper") -> Task:
    """What inference needs: the data, the uniform prior over the MDP's paths, and whole cells as regions."""
    environment = environment_of(spec, task)
    data = labelled_data(spec, store, task, run, protocol)
    return Task(data, uniform_prior(environment), search_space(environment))


def uniform_prior(environment: EnvironmentSpec) -> PathPrior:
    """The uniform prior over the paths of a world's MDP until the deadline."""
    mdp, horizon = environment.mdp(), environment.task.deadline
    return PathPrior(mdp.support_graph(), mdp.coordinates, variables=mdp.variables, horizon=horizon)


def search_space(environment: EnvironmentSpec) -> SearchSpace:
    """Whole cells of a world as regions, and windows until the deadline."""
    return SearchSpace.grid(environment.world.size, environment.task.deadline, environment.mdp().variables)


def settings_of(spec: StudySpec, protocol: str, data: LabelledTrajectories) -> InferenceSettings:
    """The constants of Problem 1 that a protocol uses on the data of a task."""
    if protocol == "paper":
        return spec.inference
    return full_settings(spec.inference, data.positives, data.negatives, spec.collection.negatives)


STEPS = (*PARTS, "plain")
"""What an inference consists of: the parts of Steps 1 and 2, and Step 2 without the information gain."""


def infer(job: Job, spec: StudySpec, store: Artefacts, report: Report) -> Outcome:
    """Steps 1 and 2 (Section IV-B), and φ'^T, which is Step 2 without the information gain.

    φ'^T is Method II's, and is left out where nobody learns with it. The cost has the processor time in seconds of each
    of `STEPS` that was taken: it depends less than the time on the wall on what else the machine does.
    """
    protocol = job.subject or "paper"
    search: Search = spec.swarm if protocol == "paper" else spec.exact
    source, target = (inference_task(spec, store, task, job.run, protocol) for task in ("source", "target"))
    ours, theirs = (settings_of(spec, protocol, task.data) for task in (source, target))
    rngs = [generator(spec.seed, spec.name, "infer", what, job.run) for what in ("source", "target", "plain")]
    report(0, len(STEPS))
    _compile_inference(protocol)
    marks = [time.thread_time()]  # a cluster's worker may have other jobs in other threads

    def done(step: str) -> None:
        marks.append(time.thread_time())
        report(STEPS.index(step) + 1, len(STEPS))

    found = transfer_structure(source, target, ours, search, rngs[0], rngs[1], done, target_settings=theirs)
    manifest: dict[str, Any] = {
        "run": job.run,
        "source": {
            **_formula_facts(found.source, source, ours),
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
    learned_with = protocol == spec.protocol and "II" in spec.learning.most_episodes
    if found.source is not None and found.source_satisfying and learned_with:
        plain = replace(theirs, information_weight=0.0)
        fit = fit_transferable(target.data, target.prior, target.space, found.source, plain, search, rngs[2])
        manifest["target_without_information"] = _fit(fit.attempts[-1])
        done("plain")
    seconds = {name: round(now - before, 4) for name, (before, now) in zip(STEPS, pairwise(marks), strict=False)}
    return Outcome(manifest, cost={"step_seconds": seconds})


@cache
def _compile_inference(protocol: str) -> None:
    """Infer from next to nothing, once a process: what is timed after it has nothing left to compile or to load."""
    mdp = GridWorld(2).mdp()
    ends = np.array([[0, -1], [0, -1], [0, 0], [-1, -1]])  # two primitives tell them apart, one does not
    values = mdp.coordinates[np.repeat(ends, [6, 7], axis=1)]
    names = tuple("abcd")
    data = LabelledTrajectories(values, np.full(4, 13), np.array([1, 1, -1, -1], np.int8), mdp.variables, names)
    prior = PathPrior(mdp.support_graph(), mdp.coordinates, variables=mdp.variables, horizon=12)
    task = Task(data, prior, SearchSpace.grid(2, 12, mdp.variables))
    swarm = SwarmSettings(particles=4, iterations=2, restarts=1, climbers=1)
    search: Search = swarm if protocol == "paper" else ExactSettings(joint=True)
    settings = InferenceSettings(size=4, rate=1.0, depth=1)
    transfer_structure(task, task, settings, search, np.random.default_rng(0), np.random.default_rng(0))


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


def study_formulas(spec: StudySpec, store: Artefacts) -> dict[str, SDNF | None]:
    """The formulas that all runs learn with.

    φ^T and φ'^T are None where they are not satisfying formulas of the target task (Problem 1).
    """
    found = store.load(formulas_job(spec).name)
    plain = found["target_without_information"]
    texts = {
        "source": found["source"]["formula"],
        "target": found["target"]["formula"],
        "target_without_information": plain["formula"] if plain and plain["satisfying"] else None,
    }
    return {name: None if text is None else to_sdnf(parse(text)) for name, text in texts.items()}


def satisfying_source(spec: StudySpec, store: Artefacts) -> SDNF | None:
    """φ^S, if it is a satisfying formula of the source task (Problem 1), so that its structure is worth looking for."""
    satisfying = store.load(formulas_job(spec).name)["source"]["satisfying"]
    return study_formulas(spec, store)["source"] if satisfying else None
