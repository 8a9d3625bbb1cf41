"""What each protocol inferred from the collections of a study, and how often it is exactly what is true."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tickwise.envs.catalog import EnvironmentSpec
from tickwise.experiments.job import inference_job
from tickwise.experiments.regions import boxes_of, clip, overlap
from tickwise.experiments.store import Store
from tickwise.experiments.study import PROTOCOLS, StudySpec, environment_of
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf

TASKS = ("source", "target")


def gather_protocols(spec: StudySpec, store: Store, collections: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What the protocols gave, side by side; it depends on the artefacts alone.

    Args:
        spec: The study.
        store: Its artefacts.
        collections: The counts of each collection.

    Returns:
        For each of `PROTOCOLS` that infers from any collection: ``chosen``, whether the methods learn with its
        formulas; ``runs``, what each collection gave; ``of``, how many these are; ``transferable``, in how many
        transferability was identified; and ``exact``, in how many the formulas are exactly right, by task and ``both``.

    Raises:
        MissingFileError: If an artefact is missing.
        StoreError: If one cannot be read.
    """
    found = {}
    for protocol in PROTOCOLS:
        loaded = [(run, store.load(inference_job(protocol, run).name)) for run in spec.inferred(protocol)]
        if loaded:
            runs = [_run(spec, protocol, inference, collections[run]) for run, inference in loaded]
            found[protocol] = _together(runs, chosen=protocol == spec.protocol)
    return found


def inference_seconds(spec: StudySpec, store: Store) -> dict[str, list[float]]:
    """The processor time of Steps 1 and 2 in seconds, for each protocol and collection; another number each time."""
    return {
        protocol: [_seconds(store, protocol, run) for run in spec.inferred(protocol)]
        for protocol in PROTOCOLS
        if spec.inferred(protocol)
    }


def _seconds(store: Store, protocol: str, run: int) -> float:
    steps = store.load(f"cost-{inference_job(protocol, run).name}")["step_seconds"]
    return float(round(sum(seconds for step, seconds in steps.items() if step != "plain"), 4))


def _run(
    spec: StudySpec, protocol: str, inference: Mapping[str, Any], counts: Mapping[str, Mapping[str, int]]
) -> dict[str, Any]:
    """What one collection gave."""
    attempts = inference["target"]["attempts"]
    rates = {"source": inference["source"].get("rate"), "target": attempts[-1]["rate"] if attempts else None}
    return {
        "run": inference["run"],
        **{task: _task(spec, protocol, task, inference, rates[task], counts[task]) for task in TASKS},
        "satisfying": inference["source"]["satisfying"],
        "transferable": inference["target"]["transferable"],
    }


def _task(
    spec: StudySpec,
    protocol: str,
    task: str,
    inference: Mapping[str, Any],
    rate: float | None,
    counts: Mapping[str, int],
) -> dict[str, Any]:
    """A formula, and how many of how many trajectories it classifies wrongly."""
    text = inference[task]["formula"]
    rate = None if text is None else rate  # that of an attempt which failed is no formula's
    of = counts["positives"] + counts["candidates" if protocol == "full" else "negatives"]
    weighted = protocol == "paper" and spec.inference.class_weight is not None
    return {
        "formula": text,
        "rate": rate,
        "errors": None if rate is None or weighted else round((1 - rate) * of),
        "of": of,
        "exact_regions": exact_regions(text, environment_of(spec, task)),
        "exact": exactly(text, spec.true[task], environment_of(spec, task)),
    }


def _together(runs: Sequence[Mapping[str, Any]], *, chosen: bool) -> dict[str, Any]:
    exact = {task: sum(run[task]["exact"] for run in runs) for task in TASKS}
    exact["both"] = sum(all(run[task]["exact"] for task in TASKS) for run in runs)
    transferable = sum(bool(run["transferable"]) for run in runs)
    return {"chosen": chosen, "of": len(runs), "transferable": transferable, "exact": exact, "runs": list(runs)}


def exact_regions(formula: str | None, environment: EnvironmentSpec) -> bool:
    """Whether every region of a formula is a true one."""
    if formula is None:
        return False
    true, size = [landmark.box for landmark in environment.task.landmarks], environment.world.size
    return all(any(overlap(box, other, size) == 1 for other in true) for box in boxes_of(to_sdnf(parse(formula))))


def exactly(formula: str | None, true: str, environment: EnvironmentSpec) -> bool:
    """Whether a formula has the operators and regions of the true one, each with its own; times may be others."""
    return formula is not None and _essence(to_sdnf(parse(formula)), environment) == _essence(
        to_sdnf(parse(true)), environment
    )


def _essence(formula: SDNF, environment: EnvironmentSpec) -> list[tuple[Any, ...]]:
    """Operators and regions within the world; the order of disjuncts says nothing."""
    size = environment.world.size
    return sorted(
        tuple((part.operator.value, part.complemented, clip(part.box, size)) for part in disjunct.primitives)
        for disjunct in formula.disjuncts
    )
