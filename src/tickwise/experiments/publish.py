"""Turns a finished run folder into what people look at: ``summary.json``, figures and ``report.html``."""

from __future__ import annotations

import os
import platform
import shlex
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tickwise.errors import MissingFileError, StoreError
from tickwise.experiments.case_studies import find_study
from tickwise.experiments.figures import draw_figures
from tickwise.experiments.jobs import peak_memory_mib
from tickwise.experiments.report import render_report
from tickwise.experiments.runner import planned_jobs, unfinished
from tickwise.experiments.store import Store, read_configuration, read_json, write_json, write_text
from tickwise.experiments.study import StudySpec
from tickwise.experiments.summary import command, gather

PACKAGES = ("numpy", "numba", "scipy", "gymnasium", "matplotlib")
"""Packages whose versions a report names."""


def publish(spec: StudySpec, store: Store, workers: int, seconds: float) -> dict[str, Any]:
    """Write the summary, the figures and the report of a finished run folder.

    Args:
        spec: The study.
        store: Its artefacts.
        workers: Processes that worked at the same time.
        seconds: How long this call worked; earlier calls that finished in the same folder are added.

    Returns:
        The summary.

    Raises:
        StoreError: If a file cannot be read or written.
    """
    path = store.folder / "environment.json"
    before = read_json(path) if path.exists() else {}
    costs = [store.load(f"cost-{job.name}") for job in planned_jobs(spec, store)]
    largest = max(cost["memory_mib"] for cost in costs)
    memory = peak_memory_mib() + (workers * largest if workers > 1 else 0.0)
    environment = {
        "command": shlex.join([*command(spec).split(), "--out", str(store.folder), "--workers", str(workers)]),
        "version": version("tickwise"),
        "python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "cores": os.cpu_count(),
        "workers": workers,
        "seconds": round(before.get("seconds", 0.0) + seconds, 1),
        "job_seconds": round(sum(cost["seconds"] for cost in costs), 1),
        "peak_memory_mib": round(max(before.get("peak_memory_mib", 0.0), memory), 1),
    }
    write_json(path, environment)
    return _render(spec, store, environment)


def republish(folder: Path) -> dict[str, Any]:
    """Render the report of a finished run folder again; returns the summary.

    Raises:
        MissingFileError: If the folder holds no run.
        StoreError: If the run is not finished, or a file cannot be read or written.
    """
    config = read_configuration(folder)
    if config is None:
        raise MissingFileError(f"{folder} holds no run (there is no config.json); name a folder that reproduce wrote")
    try:
        spec = find_study(config["name"], quick=config["short"], runs=config["runs"], seed=config["seed"])
    except KeyError as error:
        raise StoreError(
            f"{folder / 'config.json'} holds no configuration of a run (there is no {error}); name another folder"
        ) from None
    store = Store.open(folder, spec.as_dict())
    path = folder / "environment.json"
    missing = unfinished(spec, store)
    if missing is not None or not path.exists():
        what = "its report" if missing is None else missing.title
        remedy = shlex.join([*command(spec).split(), "--out", str(folder)])
        raise StoreError(f"the run in {folder} is not finished ({what} is missing); go on with `{remedy}`")
    return _render(spec, store, read_json(path))


def _render(spec: StudySpec, store: Store, environment: dict[str, Any]) -> dict[str, Any]:
    """Write the summary, the figures and the report anew from the artefacts; returns the summary."""
    results = gather(spec, store, environment["version"])
    results["environment"] = environment
    summary: dict[str, Any] = results["summary"]
    write_json(store.folder / "summary.json", summary)
    figures = draw_figures(results, spec, store.folder / "figures")
    write_text(store.folder / "report.html", render_report(results, spec, figures))
    return summary
