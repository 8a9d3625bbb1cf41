"""What a finished run folder shows, as plain data: the summary, and all that figures and the report need."""

from __future__ import annotations

from typing import Any

from tickwise.envs.planning import optimal_value, worst_value
from tickwise.experiments.budget import budget_statistics, target_episodes
from tickwise.experiments.inferences import labelled_data, study_formulas
from tickwise.experiments.job import Job, inference_job
from tickwise.experiments.measures import (
    LEVELS,
    episode_statistics,
    final_mean,
    ratio,
    reached,
    return_statistics,
    settled,
    stays,
)
from tickwise.experiments.protocols import TASKS, exact_regions, gather_protocols
from tickwise.experiments.recording import PREFIX
from tickwise.experiments.runner import available_methods
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec, environment_of
from tickwise.logic.parse import parse
from tickwise.logic.structure import structure

LOOP = ("run", "collected", "first_good", "formula", "transferable", "reason", "attempts")
"""What a run of the closed loop gave beside its curves."""

PAIRS = (("I", "III"), ("III", "IV"))
"""Methods whose episodes to convergence are compared: the paper's one order of magnitude, and the next."""


def command(spec: StudySpec) -> str:
    """The command line that gives the study's numbers, whatever the folder and the number of workers."""
    quick = " --quick" if spec.short else ""
    protocol = "" if spec.protocol == "paper" else f" --protocol {spec.protocol}"
    return f"tickwise reproduce {spec.name}{protocol}{quick} --runs {spec.runs} --seed {spec.seed}"


def gather(spec: StudySpec, store: Store, version: str) -> dict[str, Any]:
    """Read a finished run folder. All that is given depends on the artefacts alone, nothing on how they were made.

    Args:
        spec: The study.
        store: Its artefacts.
        version: The version of Tickwise that made them.

    Returns:
        A mapping with ``summary`` (what goes into ``summary.json``), ``collections``, ``inferences``, ``data`` (the
        first run's labelled trajectories), ``methods`` (each run's curves and measures) and ``source_learning``.

    Raises:
        MissingFileError: If an artefact is missing.
        StoreError: If one cannot be read.
    """
    runs = range(spec.runs)
    collections = [{"run": run, **{task: _counts(store, task, run) for task in TASKS}} for run in spec.inferences]
    inferences = [store.load(inference_job(spec.protocol, run).name) for run in spec.inferred(spec.protocol)]
    values = {task: _values(spec, task) for task in TASKS}
    methods = {
        method: [_run(spec, store, method, run, values["target"]) for run in runs]
        for method in available_methods(spec, store)
    }
    formulas = {
        name: None if formula is None else str(formula) for name, formula in study_formulas(spec, store).items()
    }
    summary = {
        "study": spec.name, "quick": spec.short, "seed": spec.seed, "runs": spec.runs, "version": version,
        "command": command(spec), "formulas": formulas,
        "transferable": inferences[0]["target"]["transferable"], "reason": inferences[0]["target"]["reason"],
        "structures": _structures(spec, inferences), "goal": spec.learning.goal.text,
        "v_star": values["target"][0], "fail": values["target"][1], "source_v_star": values["source"][0],
        "methods": {name: _method_summary(spec, name, results, collections) for name, results in methods.items()},
        "ratios": _ratios(spec, methods), "collections": collections,
        "protocols": gather_protocols(spec, store, collections),
    }  # fmt: skip
    return {
        "summary": summary,
        "collections": collections,
        "inferences": inferences,
        "data": {task: labelled_data(spec, store, task, 0) for task in TASKS},
        "methods": methods,
        "source_learning": [_source_curve(store, run) for run in runs] if "IV" in methods else [],
    }


def _source_curve(store: Store, run: int) -> dict[str, Any]:
    learned = store.load(Job("learn", "source", run).name)
    wanted = ("run", "evaluation_episodes", "evaluation_returns")
    return {key: value for key, value in learned.items() if key in wanted or key.startswith(PREFIX)}


def _counts(store: Store, task: str, run: int) -> dict[str, Any]:
    content = store.load(Job("collect", task, run).name)
    return {key: value for key, value in content.items() if key not in ("paths", "labels", "rest", "run")}


def _values(spec: StudySpec, task: str) -> tuple[float, float]:
    environment = environment_of(spec, task)
    mdp, table = environment.mdp(), environment.task_table()
    return optimal_value(mdp, table), worst_value(mdp, table)


def _run(spec: StudySpec, store: Store, method: str, run: int, values: tuple[float, float]) -> dict[str, Any]:
    content = store.load(Job("learn", method, run).name)
    best, fail = values
    episodes, returns = content["evaluation_episodes"], content["evaluation_returns"]
    thresholds = {str(level): fail + level / 100 * (best - fail) for level in LEVELS}
    window = spec.learning.window // spec.learning.block
    return {
        **content,
        "settled": settled(content["blocks"], spec.learning.block, fail),
        "reached": {level: reached(episodes, returns, value) for level, value in thresholds.items()},
        "stays": {level: stays(episodes, returns, value) for level, value in thresholds.items()},
        "window_mean": float(content["blocks"][:window].mean(dtype="float64")),
        "end_mean": final_mean(content["blocks"]),
        "final": float(returns[-1]),
    }


def _measures(results: list[dict[str, Any]]) -> dict[str, list[int | None]]:
    measures = {name: [result[name] for result in results] for name in ("goal", "settled")}
    for kind in ("reached", "stays"):
        for level in LEVELS:
            measures[f"{kind}_{level}"] = [result[kind][str(level)] for result in results]
    return measures


def _method_summary(
    spec: StudySpec, name: str, results: list[dict[str, Any]], collections: list[dict[str, Any]]
) -> dict[str, Any]:
    spent = target_episodes(name, results, collections[0]["target"]["episodes"])
    measures = _measures(results)
    means = {name: [result[name] for result in results] for name in ("window_mean", "end_mean")}
    statistics: dict[str, Any] = {name: episode_statistics(values, spec.seed) for name, values in measures.items()}
    statistics |= {name: return_statistics(values, spec.seed) for name, values in means.items()}
    closed = {"loops": [{key: result[key] for key in LOOP} for result in results]} if name == "V" else {}
    return {
        **measures,
        **means,
        **closed,
        "episodes": [result["episodes"] for result in results],
        "final": [result["final"] for result in results],
        "target_episodes": spent,
        "statistics": statistics | {"target_episodes": budget_statistics(spent, spec.seed)},
    }


def _ratios(spec: StudySpec, methods: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    found = {}
    for slow, fast in PAIRS:
        if slow in methods and fast in methods:
            ours, theirs = _measures(methods[slow]), _measures(methods[fast])
            limit = spec.learning.most_episodes[slow]
            found[f"{slow}/{fast}"] = {name: ratio(ours[name], theirs[name], limit) for name in ours}
    return found


def _structures(spec: StudySpec, inferences: list[dict[str, Any]]) -> dict[str, Any]:
    """In how many collections the structure was found, transferability identified, and all regions exact."""
    wanted = structure(parse(spec.true["source"]))
    found = [
        text is not None and structure(parse(text)) == wanted
        for text in (inference["source"]["formula"] for inference in inferences)
    ]
    transferable = [bool(inference["target"]["transferable"]) for inference in inferences]
    exact = {
        task: sum(exact_regions(inference[task]["formula"], environment_of(spec, task)) for inference in inferences)
        for task in TASKS
    }
    return {"found": sum(found), "transferable": sum(transferable), "exact": exact, "of": len(inferences)}
