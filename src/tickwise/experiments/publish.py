"""Turns finished run folders into what people look at: ``summary.json``, figures and ``report.html``."""

from __future__ import annotations

import os
import platform
import shlex
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tickwise.errors import MissingFileError, StoreError
from tickwise.experiments.case_studies import study_of
from tickwise.experiments.effect_catalog import EFFECTS
from tickwise.experiments.effect_part import effect_part
from tickwise.experiments.effects import effect_results
from tickwise.experiments.figures import draw_effect, draw_figures, draw_pairs
from tickwise.experiments.memory import peak_memory_mib
from tickwise.experiments.page import Part, render_page
from tickwise.experiments.pairs import gather_pairs
from tickwise.experiments.pairs_part import pairs_part
from tickwise.experiments.protocols import inference_seconds
from tickwise.experiments.report import study_part
from tickwise.experiments.runner import Unit, planned_jobs, unfinished
from tickwise.experiments.store import Store, read_configuration, read_json, write_json, write_text
from tickwise.experiments.study import StudySpec
from tickwise.experiments.suites import Suite, Units, suite_of
from tickwise.experiments.summary import command, gather
from tickwise.experiments.tables import TIMES

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
    unit = Unit("", spec, store.folder)
    environment = _environment(command(spec), store.folder, [unit], [store], workers, seconds)
    return _publish_study(spec, store, environment)


def publish_suite(
    suite: Suite, folder: Path, units: Units, stores: Sequence[Store], workers: int, seconds: float
) -> dict[str, Any]:
    """Write the summary, the figures and the report of a finished suite, and those of each of its studies.

    Args:
        suite: The suite.
        folder: Its run folder.
        units: All that belongs to it.
        stores: The artefacts of each of them.
        workers: Processes that worked at the same time.
        seconds: How long this call worked; earlier calls that finished in the same folder are added.

    Returns:
        The summary.

    Raises:
        StoreError: If a file cannot be read or written.
    """
    environment = _environment(suite.command, folder, units.all, stores, workers, seconds)
    return _publish_suite(suite, folder, units, stores, environment)


def republish(folder: Path) -> dict[str, Any]:
    """Render the report of a finished run folder again; returns the summary.

    Raises:
        MissingFileError: If the folder holds no run.
        StoreError: If the run is not finished, or a file cannot be read or written.
    """
    config = read_configuration(folder)
    if config is None:
        raise MissingFileError(f"{folder} holds no run (there is no config.json); name a folder that reproduce wrote")
    if "suite" in config:
        return _republish_suite(suite_of(config, folder), folder)
    spec = study_of(config, folder)
    store = Store.open(folder, spec.as_dict())
    _require_finished([Unit("", spec, folder)], [store], folder, command(spec))
    return _publish_study(spec, store, read_json(folder / "environment.json"))


def _republish_suite(suite: Suite, folder: Path) -> dict[str, Any]:
    Store.open(folder, suite.as_dict())
    units = suite.units(folder)
    stores = [Store.open(unit.folder, unit.spec.as_dict()) for unit in units.all]
    _require_finished(units.all, stores, folder, suite.command)
    return _publish_suite(suite, folder, units, stores, read_json(folder / "environment.json"))


def _require_finished(units: Sequence[Unit], stores: Sequence[Store], folder: Path, remedy: str) -> None:
    """Refuse to render what has pieces missing."""
    pairs = zip(units, stores, strict=True)
    jobs = ((unit, unfinished(unit.spec, store)) for unit, store in pairs)
    missing = next((f"{unit.label} {job.title}".strip() for unit, job in jobs if job is not None), None)
    if missing is None and not (folder / "environment.json").exists():
        missing = "its report"
    if missing is not None:
        again = shlex.join([*remedy.split(), "--out", str(folder)])
        raise StoreError(f"the run in {folder} is not finished ({missing} is missing); go on with `{again}`")


def _environment(
    text: str, folder: Path, units: Sequence[Unit], stores: Sequence[Store], workers: int, seconds: float
) -> dict[str, Any]:
    """Command, versions and costs of a run folder, which are also written there."""
    path = folder / "environment.json"
    before = read_json(path) if path.exists() else {}
    costs = [
        store.load(f"cost-{job.name}")
        for unit, store in zip(units, stores, strict=True)
        for job in planned_jobs(unit.spec, store)
    ]
    largest = max(cost["memory_mib"] for cost in costs)
    memory = peak_memory_mib() + (workers * largest if workers > 1 else 0.0)
    environment = {
        "command": shlex.join([*text.split(), "--out", str(folder), "--workers", str(workers)]),
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
    return environment


def _publish_study(spec: StudySpec, store: Store, environment: dict[str, Any]) -> dict[str, Any]:
    """Write the summary, the figures and the report anew from the artefacts; returns the summary."""
    summary, part = _study(spec, store, environment, nested=False)
    page = render_page(spec.title, part.verdict, (part,), environment, seed=spec.seed)
    write_text(store.folder / "report.html", page)
    return summary


def _study(spec: StudySpec, store: Store, environment: dict[str, Any], *, nested: bool) -> tuple[dict[str, Any], Part]:
    """A study's summary and figures, which are also written, and its part of a page."""
    results = gather(spec, store, environment["version"])
    results |= {"environment": environment, "seconds": inference_seconds(spec, store)}
    summary: dict[str, Any] = results["summary"]
    write_json(store.folder / "summary.json", summary)
    write_json(store.folder / TIMES, results["seconds"])
    figures = draw_figures(results, spec, store.folder / "figures")
    return summary, study_part(results, spec, figures, nested=nested)


def _publish_suite(
    suite: Suite, folder: Path, units: Units, stores: Sequence[Store], environment: dict[str, Any]
) -> dict[str, Any]:
    """Write the summary, the figures and the report anew from the artefacts; returns the summary."""
    store_of = {unit.folder: store for unit, store in zip(units.all, stores, strict=True)}
    summary: dict[str, Any] = {
        **suite.as_dict(), "version": environment["version"], "command": suite.command, "studies": {},
    }  # fmt: skip
    parts: list[Part] = []
    for unit in units.studies:
        found, part = _study(unit.spec, store_of[unit.folder], environment, nested=True)
        summary["studies"][unit.spec.name] = found
        parts.append(part)
    if units.pairs:
        specs = [unit.spec for unit in units.pairs]
        random = gather_pairs(specs, [store_of[unit.folder] for unit in units.pairs], environment["version"])
        summary["random"] = random
        parts.append(pairs_part(random, specs, draw_pairs(random, folder / "figures"), suite.command))
    summary["effects"] = {}
    for name, variations in units.effects.items():
        results = effect_results(EFFECTS[name], variations, [store_of[unit.folder] for unit in variations])
        summary["effects"][name] = results["summary"]
        write_json(folder / "times" / f"{name}.json", results["times"])
        figures = draw_effect(results, folder / "figures")
        parts.append(effect_part(EFFECTS[name], results, figures, nested=suite.effect is None))
    write_json(folder / "summary.json", summary)
    several = len(parts) > 1
    verdict = [part.headline for part in parts if part.headline] if several else parts[0].verdict
    page = render_page(suite.title, verdict, parts, environment, seed=suite.seed)
    write_text(folder / "report.html", page)
    return summary
