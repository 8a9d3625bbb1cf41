"""The report of a study: one self-contained page that says what was found, beside what the paper says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from tickwise.envs.catalog import EnvironmentSpec
from tickwise.experiments.budget_rows import budget_rows, loop_rows
from tickwise.experiments.captions import captions
from tickwise.experiments.cells import episodes_cell
from tickwise.experiments.choices import capital, choices, signed
from tickwise.experiments.curves import curve_data
from tickwise.experiments.page import Part, inline_svg, json_island, render_page, template
from tickwise.experiments.playback import playback
from tickwise.experiments.protocol_rows import inference_rows, protocol_rows
from tickwise.experiments.regions import NamedFormula, overlap, ranges_text, read_formula
from tickwise.experiments.study import StudySpec
from tickwise.experiments.verdict import count, headline, published, verdict
from tickwise.logic.render import to_english, to_unicode
from tickwise.logic.syntax import Bound, Box

FORMULAS = (("source", "S", False), ("target", "T", False), ("target_without_information", "T", True))
"""The key of each formula, its task, and whether it was inferred without the information gain."""

LEVELS = ("80", "90", "95")

_TITLES = {
    "source": "Source task",
    "target": "Target task",
    "target_without_information": "Target task without the information gain (λ = 0)",
}
_SECTIONS = {
    "player": "Watch what was learned", "transferability": "Transferability", "formulas": "Formulas",
    "protocols": "Protocols", "learning": "Learning", "data": "Data", "robustness": "Robustness",
    "choices": "Choices", "settings": "Settings",
}  # fmt: skip
_METHODS = {
    "I": "Q-learning on τ-states",
    "II": "extended states of φ′ᵀ (λ = 0)",
    "III": "extended states of φᵀ",
    "IV": "extended states of φᵀ, starting with the transferred Q̄",
    "V": "the closed loop: collecting, inferring and learning at once",
}


def render_report(results: Mapping[str, Any], spec: StudySpec, figures: Mapping[str, str]) -> str:
    """The page of one study.

    Args:
        results: The results of the study.
        spec: The study.
        figures: The SVG text of each figure by name; one that is missing is said to be missing.

    Returns:
        The page, as `render_page` gives it.
    """
    part = study_part(results, spec, figures)
    return render_page(spec.title, part.verdict, (part,), results["environment"], seed=spec.seed)


def study_part(
    results: Mapping[str, Any], spec: StudySpec, figures: Mapping[str, str], *, nested: bool = False
) -> Part:
    """One study as a part of a page.

    Args:
        results: The results of the study.
        spec: The study.
        figures: The SVG text of each figure by name.
        nested: Whether other parts stand beside it, so that its anchors need the study's name before them.
    """
    summary = results["summary"]
    prefix = f"{spec.name}-" if nested else ""
    played, curves = playback(results, spec, _METHODS), curve_data(results, spec)
    body = template("study").render(
        h=3 if nested else 2,
        prefix=prefix,
        spec=spec,
        published=bool(spec.published.formulas),
        summary=summary,
        formulas=[_formula_pair(results, spec, *entry) for entry in FORMULAS],
        convergence=[_method_row(name, summary, spec, "reached") for name in _METHODS],
        staying=[_method_row(name, summary, spec, "stays") for name in _METHODS],
        ratios=_ratio_rows(summary, spec),
        budget=budget_rows(summary, spec, _METHODS),
        loops=loop_rows(summary, spec),
        goal=spec.learning.goal.text,
        heading=capital(spec.learning.goal.heading),
        reason=_sentence(summary["reason"]),
        fail=signed(summary["fail"]),
        collections=results["collections"],
        robustness=[_robust_row(inference, spec) for inference in results["inferences"]],
        protocols=protocol_rows(summary["protocols"], results["seconds"]),
        by_protocol=inference_rows(summary["protocols"], results["seconds"], spec),
        figures=_figures(spec, figures, prefix),
        settings=settings_tree(spec.as_dict()),
        choices=choices(spec),
        command=summary["command"],
        player=None if played is None else json_island(played),
        curves=None if curves is None else json_island(curves),
    )
    links = [(prefix + name, label) for name, label in _SECTIONS.items()]
    return Part(spec.name, spec.title, verdict(summary, spec), links, Markup(body), headline(summary, spec), True)


def settings_tree(value: Any) -> Any:
    """Plain data as text, or as pairs of a name and a tree, for a nested table."""
    if isinstance(value, Mapping):
        if set(value) == {"bounds"}:  # a region
            return ranges_text(Box(tuple(Bound(**bound) for bound in value["bounds"])))
        return [(str(key).replace("_", " "), settings_tree(inner)) for key, inner in value.items()]
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "none"}[value]
    if isinstance(value, Sequence) and not isinstance(value, str):
        parts = [settings_tree(item) for item in value]
        if any(isinstance(item, Sequence) and not isinstance(item, str) for item in value):
            return "; ".join(str(part) for part in parts)
        return ", ".join(str(part) for part in parts)
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _sentence(reason: str) -> str:
    """A reason as a sentence of its own, after the answer that it is the reason of."""
    text = reason.removeprefix("Logical transferability is not identified: ")
    return capital(text) + ("" if text.endswith(".") else ".")


def _figures(spec: StudySpec, figures: Mapping[str, str], prefix: str) -> dict[str, dict[str, Any]]:
    return {
        name: {
            "name": prefix + name,
            "title": caption.title,
            "caption": caption.text,
            "counterpart": caption.counterpart if spec.published.formulas else "",
            "svg": inline_svg(prefix + name, figures[name]) if name in figures else None,
        }
        for name, caption in captions(spec).items()
    }


def _formula_pair(results: Mapping[str, Any], spec: StudySpec, key: str, task: str, primed: bool) -> dict[str, Any]:
    """One formula of ours beside the paper's."""
    environment = spec.source if task == "S" else spec.target
    ours = read_formula(results["summary"]["formulas"][key], task, environment, primed=primed)
    theirs = read_formula(spec.published.formulas.get(key), task, environment, primed=primed)
    facts = _facts(results["inferences"][0], key) if results["inferences"] else {}
    return {
        "title": _TITLES[key],
        "ours": _formula(ours, environment),
        "paper": _formula(theirs, environment),
        "facts": facts,
    }


def _formula(formula: NamedFormula | None, environment: EnvironmentSpec) -> dict[str, Any] | None:
    if formula is None:
        return None
    names = {box: name.plain for box, name in formula.names.items()}
    return {
        "symbol": formula.symbol,
        "named": formula.plain,
        "full": to_unicode(formula.sdnf),
        "english": to_english(formula.sdnf, names),
        "regions": [_region(box, formula, environment) for box in formula.names],
    }


def _region(box: Box, formula: NamedFormula, environment: EnvironmentSpec) -> dict[str, str]:
    """A region of a formula beside the true one that it is named after."""
    name = formula.names[box]
    shares = [
        (overlap(box, landmark.box, environment.world.size), landmark.box)
        for landmark in environment.task.landmarks
        if landmark.label == name.label
    ]
    share, true = max(shares, key=lambda pair: pair[0], default=(0.0, None))
    if true is None:
        relation = "no true region overlaps it"
    elif share == 1:
        relation = "the true region exactly"
    else:
        relation = f"true {ranges_text(true)}, overlap {share:.0%}"
    return {"name": name.plain, "ranges": ranges_text(box), "relation": relation}


def _facts(inference: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """Rate, gain and size of a formula of one inference."""
    if key != "target":
        return inference[key] or {}
    attempts = inference["target"]["attempts"]
    return attempts[-1] if attempts else {}


def _method_row(name: str, summary: Mapping[str, Any], spec: StudySpec, kind: str) -> dict[str, Any]:
    method = summary["methods"].get(name)
    paper = published(spec, name)
    if name in spec.published.settled:
        paper += f"; settled {count(spec.published.settled[name])}"
    row: dict[str, Any] = {"name": name, "meaning": _METHODS[name], "paper": paper, "cells": None}
    if method is None:
        return row
    limit = max(method["episodes"])
    columns = ["goal"] if kind == "reached" else []
    columns += [f"{kind}_{level}" for level in LEVELS]
    columns += ["settled"] if kind == "reached" else []
    row["cells"] = [episodes_cell(method["statistics"][column], len(method["episodes"]), limit) for column in columns]
    row["means"] = [
        {
            "text": signed(found["iqm"], ".1f"),
            "note": f"{signed(found['low'], '.1f')} to {signed(found['high'], '.1f')}",
        }
        for found in (method["statistics"][key] for key in ("window_mean", "end_mean"))
    ]
    return row


def _ratio_rows(summary: Mapping[str, Any], spec: StudySpec) -> list[dict[str, Any]]:
    """How many times fewer episodes one method needs than another."""
    measures = ("goal", *(f"reached_{level}" for level in LEVELS), "settled")
    rows = []
    for pair, ratios in summary["ratios"].items():
        slow, fast = (spec.published.episodes.get(name) for name in pair.split("/"))
        paper = f"{slow / fast:.1f}" if slow and fast else "–"
        cells = [_ratio(ratios.get(measure)) for measure in measures]
        rows.append({"pair": pair.replace("/", " / "), "paper": paper, "cells": cells})
    return rows


def _ratio(ratio: Mapping[str, Any] | None) -> str:
    if ratio is None or ratio["value"] is None:
        return "–"
    return f"{'≥ ' if ratio['at_least'] else ''}{ratio['value']:.1f}"


def _robust_row(inference: Mapping[str, Any], spec: StudySpec) -> dict[str, Any]:
    """What one collection gave."""
    source = read_formula(inference["source"]["formula"], "S", spec.source)
    target = read_formula(inference["target"]["formula"], "T", spec.target)
    return {
        "run": inference["run"] + 1,
        "source": _formula(source, spec.source),
        "satisfying": inference["source"]["satisfying"],
        "target": _formula(target, spec.target),
        "transferable": inference["target"]["transferable"],
        "reason": inference["target"]["reason"],
    }
