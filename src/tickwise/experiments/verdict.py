"""What a study found, in a few plain sentences with the key numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tickwise.experiments.study import StudySpec


def count(value: float | None) -> str:
    """A number of episodes, for instance ``2,000,000``; a dash for None."""
    return "–" if value is None else f"{value:,.0f}"


def verdict(summary: Mapping[str, Any], spec: StudySpec) -> list[str]:
    """The sentences of a report's first paragraph.

    Args:
        summary: The summary of the study.
        spec: The study.

    Returns:
        Sentences, each with a full stop.
    """
    sentences = [_transferability(summary), *_exactness(summary["protocols"])]
    for name, subject in (
        ("III", "With the inferred formula's clocks and locations in the state (Method III)"),
        ("IV", "With the source's Q-function transferred as well (Method IV)"),
        ("I", "Without a formula (Method I)"),
    ):
        if name in summary["methods"]:
            sentences.append(_method(summary, spec, name, subject))
    if summary["quick"]:
        sentences.append("This was a short run to look at: fewer runs and episodes than the study proper.")
    return sentences


def headline(summary: Mapping[str, Any], spec: StudySpec) -> str:
    """What a study found, in one sentence.

    Args:
        summary: The summary of the study.
        spec: The study.
    """
    title = spec.title.split(":")[0]
    found = []
    for name in ("III", "IV"):
        if name in summary["methods"]:
            mean = summary["methods"][name]["statistics"]["goal"]["mean"]
            paper = f" (paper: {published(spec, name)})" if spec.published.episodes else ""
            found.append(f"Method {name} after {count(mean)} episodes{paper}")
    if not found:
        return f"{title}: {_transferability(summary)}"
    return f"{title}: the first {spec.learning.goal.short} came with {' and with '.join(found)}."


def _transferability(summary: Mapping[str, Any]) -> str:
    structures = summary["structures"]
    share = f"{structures['transferable']} of {structures['of']} collections"
    if summary["transferable"]:
        return f"The target task is logically transferable from the source task; this was identified from {share}."
    return (
        "Logical transferability was not identified from the first collection, so that nothing was transferred and "
        f"Methods III and IV were not carried out (it was identified from {share})."
    )


def _exactness(protocols: Mapping[str, Any]) -> list[str]:
    """How often both protocols are exactly right, where both were followed."""
    if len(protocols) < 2:
        return []
    paper, full = (f"{found['exact']['both']} of {found['of']}" for found in (protocols["paper"], protocols["full"]))
    return [
        "The operators and regions of both formulas are exactly the true ones in "
        f"{paper} collections by the paper's inference, and in {full} by exact inference from all trajectories."
    ]


def _method(summary: Mapping[str, Any], spec: StudySpec, name: str, subject: str) -> str:
    """How fast a method got to the study's goal, beside the paper's number."""
    method = summary["methods"][name]
    found, runs = method["statistics"]["goal"], len(method["episodes"])
    goal = spec.learning.goal.short
    if found["reached"] == runs and found["mean"] is not None:
        text = f"{subject}, the first {goal} came after {count(found['mean'])} episodes on average over {runs} runs"
    else:
        limit = count(max(method["episodes"]))
        text = f"{subject}, {found['reached']} of {runs} runs had {article(goal)} within {limit} episodes"
    paper = f" (paper: {published(spec, name)})" if spec.published.episodes else ""
    return text + _ratio(summary, name) + paper + "."


def _ratio(summary: Mapping[str, Any], name: str) -> str:
    """How the method compares with the next better or worse one, as the end of a sentence."""
    pair = {"IV": "III/IV", "I": "I/III"}.get(name, "")
    ratio = summary["ratios"].get(pair, {}).get("goal")
    if ratio is None or ratio["value"] is None:
        return ""
    least = "at least " if ratio["at_least"] else ""
    if name == "IV":
        return f", {least}{ratio['value']:.1f} times fewer than without the transfer"
    return f", {least}{ratio['value']:.1f} times as many as Method III"


def published(spec: StudySpec, name: str) -> str:
    """The paper's number of episodes of a method; a dash where it has none."""
    if name not in spec.published.episodes:
        return "–"
    episodes = spec.published.episodes[name]
    return "not within 2,000,000" if episodes is None else count(episodes)


def article(noun: str) -> str:
    """A noun with its indefinite article."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"
