"""What each protocol inferred, as the rows of a report's tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

from tickwise.experiments.regions import ranges_text, read_formula
from tickwise.experiments.study import PROTOCOLS, StudySpec, environment_of

_KEYS = {"source": "S", "target": "T"}


def protocol_rows(protocols: Mapping[str, Any], seconds: Mapping[str, Sequence[float]]) -> list[dict[str, Any]]:
    """How often each protocol is exactly right, a row a protocol.

    Args:
        protocols: What `tickwise.experiments.protocols.gather_protocols` gave.
        seconds: The processor time of each protocol and collection.
    """
    rows = []
    for name, found in protocols.items():
        counts = (*(found["exact"][key] for key in ("source", "target", "both")), found["transferable"])
        taken = seconds[name]
        rows.append({
            "name": name, "meaning": PROTOCOLS[name], "cells": [f"{count} of {found['of']}" for count in counts],
            "seconds": f"{median(taken):.1f}",
            "range": f"{min(taken):.1f} to {max(taken):.1f}" if len(taken) > 1 else "",
        })  # fmt: skip
    return rows


def inference_rows(
    protocols: Mapping[str, Any], seconds: Mapping[str, Sequence[float]], spec: StudySpec
) -> list[list[dict[str, Any]]]:
    """What each collection gave, a list a collection with a row a protocol.

    Args:
        protocols: What `tickwise.experiments.protocols.gather_protocols` gave.
        seconds: The processor time of each protocol and collection.
        spec: The study.
    """
    rows: dict[int, list[dict[str, Any]]] = {}
    for protocol, found in protocols.items():
        for run, taken in zip(found["runs"], seconds[protocol], strict=True):
            rows.setdefault(run["run"], []).append({
                "run": run["run"] + 1, "protocol": protocol, "seconds": f"{taken:.1f}",
                "formulas": [_formula(run[task], task, spec) for task in _KEYS],
            })  # fmt: skip
    return [rows[run] for run in sorted(rows)]


def _formula(found: Mapping[str, Any], task: str, spec: StudySpec) -> dict[str, Any]:
    formula = read_formula(found["formula"], _KEYS[task], environment_of(spec, task))
    names = {} if formula is None else formula.names
    errors = "" if found["errors"] is None else f", {found['errors']:,} of {found['of']:,} wrong"
    verdict = "exactly right" if found["exact"] else "other operators" if found["exact_regions"] else "other regions"
    return {
        "named": None if formula is None else formula.plain,
        "regions": "; ".join(f"{name.plain} = {ranges_text(box)}" for box, name in names.items()),
        "exact": found["exact"],
        "verdict": verdict,
        "errors": errors,
    }
