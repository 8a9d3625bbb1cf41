"""A reproduction from end to end: all jobs of a study or a suite, then what people look at."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from tickwise.experiments.executors import Executor
from tickwise.experiments.progress import Display
from tickwise.experiments.publish import publish, publish_suite
from tickwise.experiments.runner import run_study, run_units
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec
from tickwise.experiments.suites import Suite


def reproduce_study(spec: StudySpec, folder: Path, executor: Executor, display: Display) -> dict[str, Any]:
    """Do all jobs of a study that are not done, and write its report; returns the summary.

    Raises:
        TickwiseError: See `tickwise.experiments.runner.run_units`.
    """
    began = time.monotonic()
    store = run_study(spec, folder, executor, display)
    return publish(spec, store, executor.workers, time.monotonic() - began)


def reproduce_suite(suite: Suite, folder: Path, executor: Executor, display: Display) -> dict[str, Any]:
    """Do all jobs of a suite that are not done, and write its report; returns the summary.

    Raises:
        TickwiseError: See `tickwise.experiments.runner.run_units`.
    """
    began = time.monotonic()
    Store.open(folder, suite.as_dict())
    units = suite.units(folder)
    stores = run_units(units.all, executor, display)
    return publish_suite(suite, folder, units, stores, executor.workers, time.monotonic() - began)
