"""What an effect is measured by: numbers that the finished run folder of one collection holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from tickwise.envs.planning import optimal_value
from tickwise.experiments.inferences import labelled_data
from tickwise.experiments.job import Job
from tickwise.experiments.measures import final_mean
from tickwise.experiments.regions import boxes_of, overlap
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec, environment_of
from tickwise.inference.tree import classification_rate
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.logic.structure import structure


@dataclass(frozen=True, slots=True)
class Finished:
    """One collection with all that came of it: a study of a single run.

    Attributes:
        spec: The study.
        store: Its artefacts.
    """

    spec: StudySpec
    store: Store

    def load(self, kind: str, subject: str = "") -> dict[str, Any]:
        """The artefact of a job."""
        return self.store.load(Job(kind, subject, 0).name)

    def facts(self, task: str) -> dict[str, Any]:
        """Formula, rate, gain and size: of φ^S, or of the last φ^T that Step 2 tried; empty where there is none."""
        found = self.load("infer")[task]
        if task == "target":
            return dict(found["attempts"][-1]) if found["attempts"] else {}
        return dict(found) if found["formula"] is not None else {}

    def formula(self, task: str) -> SDNF | None:
        """The formula of `facts`."""
        facts = self.facts(task)
        return to_sdnf(parse(facts["formula"])) if facts else None

    def blocks(self, method: str) -> Any:
        """The mean return of each block of a method's training episodes; None where it was not carried out."""
        return self.load("learn", method)["blocks"] if self.store.has(Job("learn", method, 0).name) else None


Number = Callable[[Finished], float | None]
"""What is measured of one collection; None where there is nothing to measure."""


@dataclass(frozen=True, slots=True)
class Measure:
    """Something that an effect is measured by.

    Attributes:
        key: Its name in the results.
        title: What it is, in a few words.
        unit: What it is counted in; ``{window}`` stands for the study's window of episodes.
        form: The format of a number.
        number: What it is, as a function of a finished run folder.
        share: Whether it is 0 or 1, so that its mean over the collections is the share of them.
        mark: A number of the study to compare it with, and that number's name; for instance ζ.
    """

    key: str
    title: str
    unit: str
    form: str
    number: Number
    share: bool = False
    mark: Callable[[StudySpec], tuple[str, float]] | None = None


def _fact(task: str, key: str) -> Number:
    return lambda finished: finished.facts(task).get(key)


def _overlap(task: str) -> Number:
    """How well a formula's regions fit: the mean of each one's greatest overlap with a true one."""

    def number(finished: Finished) -> float | None:
        formula, environment = finished.formula(task), environment_of(finished.spec, task)
        if formula is None:
            return None
        size, true = environment.world.size, [landmark.box for landmark in environment.task.landmarks]
        best = [max(overlap(box, other, size) for other in true) for box in boxes_of(formula)]
        return sum(best) / len(best)

    return number


def _size(task: str) -> Number:
    return lambda finished: finished.facts(task).get("size", 0)


def _splits(finished: Finished) -> float:
    """Non-leaf nodes of the source's decision tree: so many primitives were searched for."""

    def count(node: dict[str, Any] | None) -> int:
        return 0 if node is None or node["left"] is None else 1 + count(node["left"]) + count(node["right"])

    return count(finished.load("infer")["source"]["tree"])


def _true_rate(finished: Finished) -> float:
    """The classification rate of φ^S by the labels as they were before noise."""
    spec = replace(finished.spec, collection=replace(finished.spec.collection, noise=0.0))
    data = labelled_data(spec, finished.store, "source", 0)
    return classification_rate(finished.formula("source"), data, spec.inference.class_weight)


def _disjuncts(finished: Finished) -> float:
    formula = finished.formula("target")
    return 0 if formula is None else len(formula.disjuncts)


def _structure_found(finished: Finished) -> float:
    formula = finished.formula("source")
    return float(formula is not None and structure(formula) == structure(parse(finished.spec.true["source"])))


def _transferable(finished: Finished) -> float:
    return float(finished.load("infer")["target"]["transferable"])


def _trajectories(finished: Finished) -> float:
    collection = finished.load("collect", "source")
    return float(collection["positives"] + collection["negatives"])


def _positives(task: str) -> Number:
    def number(finished: Finished) -> float:
        collection = finished.load("collect", task)
        return 1000 * float(collection["positives_of_the_first"]) / float(collection["of_the_first"])

    return number


def _window_mean(method: str) -> Number:
    def number(finished: Finished) -> float | None:
        blocks, learning = finished.blocks(method), finished.spec.learning
        return None if blocks is None else float(blocks[: learning.window // learning.block].mean(dtype="float64"))

    return number


def _end_mean(method: str) -> Number:
    def number(finished: Finished) -> float | None:
        blocks = finished.blocks(method)
        return None if blocks is None else final_mean(blocks)

    return number


def _seconds(step: str) -> Number:
    return lambda finished: finished.load("cost-infer")["step_seconds"].get(step)


def _optimum(spec: StudySpec) -> tuple[str, float]:
    return "V*", optimal_value(spec.target.mdp(), spec.target.task_table())


SOURCE_RATE = Measure(
    "source_rate", "Classification rate of φˢ", "share of the trajectories", ".3f", _fact("source", "rate"),
    mark=lambda spec: ("ζ", spec.inference.rate),
)  # fmt: skip
SOURCE_SIZE = Measure(
    "source_size", "Size of φˢ", "primitives", ".0f", _size("source"), mark=lambda spec: ("ϱₜₕ", spec.inference.size)
)
SOURCE_GAIN = Measure("source_gain", "Information gain of φˢ", "nats a tick", ".4f", _fact("source", "gain"))
SOURCE_OVERLAP = Measure(
    "source_overlap", "Overlap of the regions of φˢ with the true ones", "share of the area", ".2f", _overlap("source")
)
TRUE_RATE = Measure(
    "true_rate", "Classification rate by the right labels", "share of the trajectories", ".3f", _true_rate
)
SPLITS = Measure("splits", "Number of splits of the decision tree", "non-leaf nodes", ".0f", _splits)
STRUCTURE = Measure(
    "structure", "Share of φˢ with the true structure", "share of the collections", ".2f", _structure_found, share=True
)
TARGET_RATE = Measure(
    "target_rate", "Classification rate of φᵀ", "share of the trajectories", ".3f", _fact("target", "rate"),
    mark=lambda spec: ("ζ", spec.inference.rate),
)  # fmt: skip
TARGET_OVERLAP = Measure(
    "target_overlap", "Overlap of the regions of φᵀ with the true ones", "share of the area", ".2f", _overlap("target")
)
DISJUNCTS = Measure("disjuncts", "Number of disjuncts of φᵀ", "copies of the structure", ".0f", _disjuncts)
TRANSFERABLE = Measure(
    "transferable",
    "Share found transferable",
    "share of the collections",
    ".2f",
    _transferable,
    share=True,
)
SOURCE_POSITIVES, TARGET_POSITIVES = (
    Measure(
        f"{task}_positives", f"Number of positives in the {task}", "of 1,000 episodes", ".0f",
        _positives(task),
    )
    for task in ("source", "target")
)  # fmt: skip
RETURN_III = Measure(
    "return_III", "Mean return of Method III", "first {window} episodes", ".1f", _window_mean("III"), mark=_optimum
)
RETURN_I = Measure("return_I", "Mean return of Method I", "first {window} episodes", ".1f", _window_mean("I"))
END_I = Measure("end_I", "Final mean return of Method I", "last fifth of the episodes", ".1f", _end_mean("I"))
TRAJECTORIES = Measure("trajectories", "labelled trajectories of the source, N", "trajectories", ".0f", _trajectories)
ALGORITHM_1 = Measure("algorithm_1", "Time of Algorithm 1 (Step 1)", "seconds", ".2f", _seconds("tree"))
STEP_2 = Measure("step_2", "Time of the joint fit of φᵀ (Step 2)", "seconds", ".2f", _seconds("target"))
