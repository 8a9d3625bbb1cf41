"""What a run folder has learned, as an entry for a library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tickwise.errors import ConfigurationError, MissingFileError, StoreError
from tickwise.experiments.case_studies import study_of
from tickwise.experiments.inferences import study_formulas
from tickwise.experiments.job import Job, formulas_job
from tickwise.experiments.store import Store, read_configuration, read_json
from tickwise.experiments.study import StudySpec, environment_of
from tickwise.library.entry import Entry, stamped

METHODS = {"source": "source", "II": "target_without_information", "III": "target", "IV": "target"}
"""What learns on extended states, and the name of the formula that it learns with."""

TASKS = {"source": "source", "target": "IV"}
"""For each task what learns it if nothing else is asked for."""


def open_run(folder: Path) -> tuple[StudySpec, Store]:
    """The study of a run folder, and its artefacts.

    Raises:
        MissingFileError: If the folder holds no run.
        StoreError: If it holds a suite, or cannot be read.
        ConfigurationError: If there is no such study any more.
    """
    config = read_configuration(folder)
    if config is None:
        raise MissingFileError(f"{folder} holds no run (there is no config.json); name a folder that reproduce wrote")
    if "suite" in config:
        raise StoreError(f"{folder} holds several studies; name the folder of one of them, such as {folder / 'case1'}")
    spec = study_of(config, folder)
    return spec, Store.open(folder, spec.as_dict())


def learned_entry(folder: Path, name: str, task: str = "source", method: str | None = None) -> Entry:
    """What was learned in a run folder, of the runs that which ended with the greatest mean return.

    Args:
        folder: A run folder that ``tickwise reproduce`` wrote.
        name: The name of the entry.
        task: ``source`` or ``target``.
        method: One of `METHODS`; None for the task's of `TASKS`.

    Returns:
        The entry; its provenance names folder, study, seed, run and episodes.

    Raises:
        MissingFileError: If the folder holds no run, or the run has not learned the task.
        StoreError: If the folder holds a suite, or cannot be read.
        ConfigurationError: If there is no such task, method or name, or the run did not keep the Q-function.
    """
    learner = _learner(task, method)
    spec, store = open_run(folder)
    if not store.has(formulas_job(spec).name):
        raise MissingFileError(f"the run in {folder} has inferred no formula yet; go on with tickwise reproduce")
    formula = study_formulas(spec, store)[METHODS[learner]]
    if formula is None:
        raise ConfigurationError(
            f"the run in {folder} has no formula of its {task} task, so that there is nothing to add"
        )
    runs = [run for run in range(spec.runs) if store.has(Job("learn", learner, run).name)]
    if not runs:
        raise MissingFileError(f"the run in {folder} has not learned its {task} task; go on with tickwise reproduce")
    found = {run: store.load(Job("learn", learner, run).name) for run in runs}
    run = max(runs, key=lambda each: (float(found[each]["evaluation_returns"][-1]), -each))
    if "q" not in found[run]:
        raise ConfigurationError(
            f"the run in {folder} did not keep the Q-function of {learner}, only that of the source task; use "
            "--task source, or give your own with --formula, --q and --world"
        )
    environment = environment_of(spec, task)
    return Entry(
        name=name,
        formula=formula,
        mdp=environment.mdp(),
        horizon=environment.task.deadline,
        q=np.asarray(found[run]["q"]),
        disjunct=spec.learning.disjunct,
        facts=_facts(spec, store, learner, task),
        provenance=_provenance(spec, store, folder, task, learner, run, found[run]),
    )


def _learner(task: str, method: str | None) -> str:
    if task not in TASKS:
        raise ConfigurationError(f"there is no task {task!r}; choose {' or '.join(TASKS)}")
    learner = TASKS[task] if method is None else method
    if learner not in METHODS:
        raise ConfigurationError(f"{learner!r} learns no Q-function on extended states; choose {', '.join(METHODS)}")
    if (learner == "source") != (task == "source"):
        raise ConfigurationError(f"the {task} task is not learned by {learner!r}; leave --method out")
    return learner


def _facts(spec: StudySpec, store: Store, learner: str, task: str) -> dict[str, Any]:
    """How well the formula classifies the collection that it was inferred from."""
    inferred = store.load(formulas_job(spec).name)
    found = {
        "source": inferred["source"], "target": (inferred["target"]["attempts"] or [{}])[-1],
        "target_without_information": inferred["target_without_information"] or {},
    }[METHODS[learner]]  # fmt: skip
    counts = store.load(Job("collect", task, 0).name)
    return {
        **{key: found.get(key) for key in ("rate", "gain", "size", "satisfying")},
        **{key: counts[key] for key in ("positives", "negatives")},
    }


def _provenance(
    spec: StudySpec, store: Store, folder: Path, task: str, learner: str, run: int, learned: dict[str, Any]
) -> dict[str, Any]:
    made = store.folder / "environment.json"
    return stamped(
        {
            "folder": str(folder), "study": spec.name, "task": task, "method": learner, "protocol": spec.protocol,
            "seed": spec.seed, "run": run, "runs": spec.runs, "episodes": int(learned["episodes"]),
            "mean_return": float(learned["evaluation_returns"][-1]),
            "made_by": read_json(made).get("version") if made.exists() else None,
        }
    )  # fmt: skip
