"""A piece of work of a study: what it is called, and what it is made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from tickwise.experiments.study import StudySpec

Report = Callable[[int, int], None]
"""Told how much of a job is done, and out of how much."""


@dataclass(frozen=True, slots=True)
class Job:
    """A piece of work: its kind, what it is about, and the run.

    Attributes:
        kind: ``collect``, ``infer`` or ``learn``.
        subject: The task ``source`` or ``target`` of a collection; the protocol of an inference, where it is not the
            paper's; or what learns: ``source``, ``I`` … ``V``.
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
            "infer": "infer formulas" + " from all trajectories" * (self.subject == "full"),
            "learn": "learn the source task" if self.subject == "source" else f"Method {self.subject}",
        }
        return f"{what[self.kind]}, run {self.run + 1}"

    @property
    def unit(self) -> str:
        """What its progress counts."""
        return "formulas" if self.kind == "infer" else "episodes"

    def needs(self, spec: StudySpec) -> tuple[str, ...]:
        """The names of the artefacts that it is made from."""
        if self.kind == "infer":
            return tuple(Job("collect", task, self.run).name for task in ("source", "target"))
        if self.kind == "collect" or self.subject == "I":
            return ()
        learned = (Job("learn", "source", self.run).name,) if self.subject == "IV" else ()
        return (formulas_job(spec).name, *learned)


def inference_job(protocol: str, run: int) -> Job:
    """What infers formulas from a collection by a protocol."""
    return Job("infer", "" if protocol == "paper" else protocol, run)


def formulas_job(spec: StudySpec) -> Job:
    """What gives the formulas that all runs learn with: those of the first collection, as the paper has one of each."""
    return inference_job(spec.protocol, 0)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a job gave, apart from what else it cost than time and memory as a whole."""

    manifest: dict[str, Any]
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)
    cost: dict[str, Any] = field(default_factory=dict)
