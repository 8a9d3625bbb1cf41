"""Random pairs of tasks as a part of a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from tickwise.experiments.choices import signed
from tickwise.experiments.page import Part, inline_svg, template
from tickwise.experiments.pairs import KINDS
from tickwise.experiments.report import settings_tree
from tickwise.experiments.study import StudySpec
from tickwise.experiments.verdict import count
from tickwise.logic.parse import parse
from tickwise.logic.render import to_unicode
from tickwise.logic.sdnf import to_sdnf

KEY = "random"

_MEASURES = {"goal": "Goal", "reached_80": "80 % of V*", "reached_90": "90 % of V*"}
_MEANINGS = {"I/III": "what the formula saves", "III/IV": "what the transfer saves"}
_SECTIONS = {
    "identification": "Identification",
    "speed-ups": "Speed-up",
    "budget": "All episodes",
    "pairs": "Every pair",
    "pair-settings": "Settings",
}
_OF_EACH = ("name", "title", "source", "target", "true", "similar", "remarks", "published")


def pairs_part(results: Mapping[str, Any], specs: Sequence[StudySpec], figure: str, command: str) -> Part:
    """What random pairs show.

    Args:
        results: What `tickwise.experiments.pairs.gather_pairs` gave.
        specs: The pairs.
        figure: The SVG text of the figure.
        command: The command that made it.

    Returns:
        The part; all text from data is escaped.
    """
    prefix = f"{KEY}-"
    shared = {key: value for key, value in specs[0].as_dict().items() if key not in _OF_EACH}
    body = template("pairs").render(
        h=3,
        prefix=prefix,
        figure=_figure(prefix, figure, results),
        command=command,
        identification=[_identified(kind, results) for kind in KINDS],
        speed_ups=[_speed_up(pair, results["speed_ups"][pair]) for pair in results["speed_ups"]],
        measures=list(_MEASURES.values()),
        goal=specs[0].learning.goal.text,
        budget=_budget(results["budget"]),
        limit=max(specs[0].learning.most_episodes.values()),
        pairs=[_pair(row) for row in results["pairs"]],
        settings=settings_tree(shared),
    )
    links = [(prefix + name, label) for name, label in _SECTIONS.items() if name != "budget" or results["budget"]["of"]]
    found = pairs_verdict(results)
    return Part(KEY, "Random pairs of tasks", found, links, Markup(body), " ".join(found))


def pairs_verdict(results: Mapping[str, Any]) -> list[str]:
    """What random pairs show, in plain sentences with the key numbers."""
    found = results["identification"]
    parts = [
        f"{name} in {found[kind]['right']} of {found[kind]['of']} {kind} pairs"
        for kind, name in (("similar", "identified"), ("dissimilar", "refused"))
        if found[kind]["of"]
    ]
    sentences = [f"On random pairs of tasks, transferability was {' and '.join(parts)}."]
    for pair, text in (("I/III", "the formula saves a factor of"), ("III/IV", "the transfer saves a further")):
        median = results["speed_ups"][pair]["goal"]
        if median["median"] is not None:
            sentences.append(
                f"In the median over {median['count']} pairs {text} {median['median']:.1f} "
                f"[{median['low']:.1f}, {median['high']:.1f}]."
            )
    budget = results["budget"]
    if budget["ratio"]["median"] is not None:
        found = budget["ratio"]
        sentences.append(
            f"With collection counted, the closed loop gets to 95 % of V* in {found['median']:.1f} "
            f"[{found['low']:.1f}, {found['high']:.1f}] times fewer episodes than Method IV, and on "
            f"{len(budget['slower'])} of {budget['of']} pairs it needs more than learning without transfer; on "
            f"{len(budget['negative'])} it ends worse than that by more than the noise between runs."
        )
    return sentences


def _budget(found: Mapping[str, Any]) -> dict[str, Any]:
    cells = [_episodes(found["median"][name]) for name in ("IV", "V")] + [_times(found["ratio"])]
    cells.append({"text": f"{found['reached']} of {found['of']}", "note": "pairs, most runs"})
    cells.append({"text": f"{len(found['slower'])} of {found['of']}", "note": ", ".join(found["slower"])})
    worse = ", ".join(f"{name} by {amount:.0%}" for name, amount in found["negative"].items())
    cells.append({"text": f"{len(found['negative'])} of {found['of']}", "note": worse})
    return {"of": found["of"], "cells": cells}


def _episodes(found: Mapping[str, Any]) -> dict[str, str]:
    if found["median"] is None:
        return {"text": "–", "note": ""}
    low, high = (count(value) for value in (found["low"], found["high"]))
    return {"text": count(found["median"]), "note": f"{low} to {high}; {found['count']} pairs"}


def _times(found: Mapping[str, Any]) -> dict[str, str]:
    if found["median"] is None:
        return {"text": "–", "note": ""}
    return {"text": f"{found['median']:.1f}", "note": f"{found['low']:.1f} to {found['high']:.1f}"}


def _figure(prefix: str, svg: str, results: Mapping[str, Any]) -> dict[str, Any]:
    pairs = len(results["pairs"])
    return {
        "name": f"{prefix}figure", "title": "Random pairs of tasks", "counterpart": "",
        "svg": inline_svg(f"{prefix}figure", svg),
        "caption": f"Left: how many of the {pairs} pairs were judged rightly, and the 95 % Wilson interval of the "
        "share; the dashed line is at 90 %. Right: how many times fewer episodes to the goal, a point a similar pair; "
        "the thick line is the median, the band its 95 % bootstrap interval, the dashed line where nothing is saved.",
    }  # fmt: skip


def _identified(kind: str, results: Mapping[str, Any]) -> dict[str, Any]:
    found = results["identification"][kind]
    interval = "–" if found["low"] is None else f"{found['low']:.0%} to {found['high']:.0%}"
    verb = {"similar": "identified", "dissimilar": "refused"}[kind]
    return {"kind": f"{kind}, to be {verb}", "right": found["right"], "of": found["of"], "interval": interval}


def _speed_up(pair: str, measures: Mapping[str, Any]) -> dict[str, Any]:
    cells = []
    for measure in _MEASURES:
        found = measures[measure]
        if found["median"] is None:
            cells.append({"text": "–", "note": ""})
            continue
        low, high = found["quartiles"]
        half = f"half of {found['count']} pairs from {low:.1f} to {high:.1f}"
        note = f"{found['low']:.1f} to {found['high']:.1f}; {half}"
        cells.append({"text": f"{found['median']:.1f}", "note": note})
    return {"pair": pair.replace("/", " / "), "meaning": _MEANINGS[pair], "cells": cells}


def _pair(row: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "number": row["name"].removeprefix("pair-"), "kind": "similar" if row["similar"] else "not similar",
        **{task: _task(row, task) for task in ("source", "target")},
        "right": row["right"], "answer": "identified" if row["identified"] else "refused",
        "reason": row["reason"],
        "ratios": [f"{row['speed_ups'][pair]['goal']:.1f}" if row["speed_ups"] else "–" for pair in _MEANINGS]
        + ["–" if row["budget"]["ratio"] is None else f"{row['budget']['ratio']:.1f}"],
    }  # fmt: skip


def _task(row: Mapping[str, Any], task: str) -> dict[str, Any]:
    size, formula, rate = row["worlds"][task], row["inferred"][task], row["rates"][task]
    note = "" if rate is None else f"rate {signed(rate, '.3f')}"
    if task == "source" and formula is not None and not row["satisfying"]:
        note += ", not satisfying"
    return {
        "world": f"{size} × {size}", "true": to_unicode(to_sdnf(parse(row["true"][task]))), "note": note,
        "inferred": "none" if formula is None else to_unicode(to_sdnf(parse(formula))),
    }  # fmt: skip
