"""The rows of a report on all episodes that were spent in the target task, and on the closed loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tickwise.experiments.cells import episodes_cell
from tickwise.experiments.regions import ranges_text, read_formula
from tickwise.experiments.study import StudySpec
from tickwise.experiments.verdict import count


def budget_rows(summary: Mapping[str, Any], spec: StudySpec, meanings: Mapping[str, str]) -> list[dict[str, Any]]:
    """A row a method: the paper's episodes in all, and what collection and all of it took here.

    Args:
        summary: The summary of the study.
        spec: The study.
        meanings: What each method is, in words.
    """
    rows = []
    for name, meaning in meanings.items():
        row: dict[str, Any] = {"name": name, "meaning": meaning, "paper": _published(spec, name), "cells": None}
        method = summary["methods"].get(name)
        if method is not None:
            found, runs = method["statistics"]["target_episodes"], len(method["episodes"])
            limit = max(
                (run["collection"] if name != "V" else 0) + most
                for run, most in zip(method["target_episodes"], method["episodes"], strict=True)
            )
            row["cells"] = [episodes_cell(found[key], runs, limit) for key in ("collection", "total")]
        rows.append(row)
    return rows


def _published(spec: StudySpec, name: str) -> str:
    """The paper's collection and the episodes until its goal, which is another measure than ours."""
    if name not in spec.published.episodes or spec.published.collection is None:
        return "–"
    episodes = spec.published.episodes[name]
    if episodes is None:
        return "not within 2,000,000"
    return count(episodes + (0 if name == "I" else spec.published.collection))


def loop_rows(summary: Mapping[str, Any], spec: StudySpec) -> list[dict[str, Any]]:
    """A row a run of the closed loop; none where it was not carried out."""
    rows = []
    for loop in summary["methods"].get("V", {}).get("loops", ()):
        formula = read_formula(loop["formula"], "T", spec.target)
        names = {} if formula is None else formula.names
        rows.append({
            "run": loop["run"] + 1, "first": count(loop["first_good"]), "attempts": len(loop["attempts"]),
            "collected": count(loop["collected"]), "named": None if formula is None else formula.plain,
            "regions": ", ".join(f"{name.plain}: {ranges_text(box)}" for box, name in names.items()),
            "reason": loop["reason"],
        })  # fmt: skip
    return rows
