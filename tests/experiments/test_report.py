"""The report of a study: complete, self-contained, escaped, and the same for the same results."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import pytest

from tests.experiments import synthetic
from tickwise.experiments.captions import captions
from tickwise.experiments.case_studies import CASE_STUDY_1
from tickwise.experiments.choices import choices
from tickwise.experiments.figures import FIGURES
from tickwise.experiments.report import render_report, settings_tree
from tickwise.experiments.study import Published
from tickwise.experiments.verdict import verdict

SPEC = synthetic.small()
SVG = (
    '<?xml version="1.0"?><!DOCTYPE svg><!-- made -->\n<svg width="9pt" height="5pt" viewBox="0 0 9 5" '
    'xmlns="http://www.w3.org/2000/svg"><defs><path id="p"/><clipPath id="c"/></defs><!-- text -->'
    '<use xlink:href="#p" xmlns:xlink="http://www.w3.org/1999/xlink"/><g clip-path="url(#c)"/></svg>\n'
)
VOID = {"meta", "br", "hr", "img", "link", "input"}


class Page(HTMLParser):
    """Checks that tags are balanced, and gathers text, tags and identifiers."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: Counter[str] = Counter()
        self.tags: Counter[str] = Counter()
        self.links: list[str] = []
        self.parts: list[str] = []
        self.feed(html)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        for name, value in attrs:
            if name == "id":
                self.ids[value or ""] += 1
            if name in ("href", "src", "xlink:href"):
                self.links.append(value or "")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not self.open or self.open[-1] not in ("style", "script"):
            self.parts.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.parts))


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    return synthetic.results(SPEC)


@pytest.fixture(scope="module")
def html(results: dict[str, Any]) -> str:
    return render_report(results, SPEC, dict.fromkeys(FIGURES, SVG))


@pytest.fixture(scope="module")
def page(html: str) -> Page:
    return Page(html)


def test_both_protocols_stand_side_by_side(html: str, results: dict[str, Any]):
    text = Page(html).text
    for row in ("paper some random negatives", "full all negatives"):
        assert row in text
    assert f"0 of {SPEC.runs} {SPEC.runs} of {SPEC.runs} 0 of {SPEC.runs}" in text  # source, target, both
    assert "exactly right, 3 of 220 wrong" in re.sub(r" (?=,)", "", text)
    assert "3 of 16,020 wrong" in text
    assert "exactly right" in text
    assert "other regions" in text
    assert f"true ones in 0 of {SPEC.runs} collections by the paper's inference, and in" in " ".join(
        verdict(results["summary"], SPEC)
    )
    alone = {**results["summary"], "protocols": {"paper": results["summary"]["protocols"]["paper"]}}
    assert "exact inference" not in " ".join(verdict(alone, SPEC))


def test_the_full_protocol_is_among_the_choices():
    found = next(choice for choice in choices(SPEC) if "full protocol" in choice.subject)
    assert "s = (P + 200) / (P + N)" in found.ours
    assert "do not learn" in found.ours
    learned = next(choice for choice in choices(replace(SPEC, protocol="full")) if "full protocol" in choice.subject)
    assert learned.ours.endswith("The methods learn with its formulas.")


def test_the_page_is_well_formed_and_needs_nothing_else(page: Page):
    assert max(page.ids.values()) == 1
    assert all(link.startswith("#") and link[1:] in page.ids for link in page.links)
    assert page.tags["script"] == 2  # the curves' data, and the program
    assert not page.tags["link"]
    assert page.tags["svg"] == len(FIGURES)


def test_the_page_suits_phones_dark_rooms_and_paper(html: str):
    assert 'name="viewport"' in html
    assert "prefers-color-scheme: dark" in html
    assert "@media print" in html


def test_the_same_results_give_the_same_page(html: str):
    again = render_report(synthetic.results(SPEC), SPEC, dict.fromkeys(FIGURES, SVG))
    assert again == html


def test_the_formulas_stand_beside_the_papers(page: Page):
    assert "◇[0,17] □[0,4] Ḡˢ ∧ ◇[22,40] Ȳˢ" in page.text
    assert "◇[1,15] □[0,4] Ḡˢ ∧ ◇[21,39] Ȳˢ" in page.text
    assert (
        "within ticks 3 to 20, reach Ḡᵀ and stay for 5 more ticks; then, within ticks 27 to 40, reach Ȳᵀ" in page.text
    )
    assert "Ȳᵀ = [4, 7] × [1, 2] true [4, 7] × [0, 2], overlap 50%" in page.text
    assert "◇[3,20] □[0,5] (5 ≤ x ≤ 6 ∧ 6 ≤ y ≤ 7)" in page.text


def test_the_convergence_table_has_ours_and_the_papers(page: Page, results: dict[str, Any]):
    found = results["summary"]["methods"]["III"]["statistics"]["goal"]
    assert f"{found['mean']:,.0f}" in page.text
    assert f"{found['low']:,.0f} to {found['high']:,.0f}; 3 of 3 runs" in page.text
    assert "0 of 3 runs within 60,000" in page.text
    assert "13,850" in page.text
    assert "not within 2,000,000" in page.text
    ratio = results["summary"]["ratios"]["I/III"]["goal"]
    assert ratio["at_least"]
    assert f"≥ {ratio['value']:.1f}" in page.text


def test_every_figure_has_a_caption_with_the_papers_counterpart(page: Page, results: dict[str, Any]):
    entries = captions(SPEC)
    assert tuple(entries) == FIGURES
    for name, caption in entries.items():
        assert page.ids[f"{name}-caption"] == 1
        assert f"Counterpart in the paper: {caption.counterpart}. Made by" in page.text
    assert page.text.count(f"Made by {results['summary']['command']}") == len(FIGURES)


def test_counts_robustness_and_environment_are_there(page: Page):
    assert "26 200 of 9,974 10,000 20 200 of 17,980 18,000" in page.text
    assert "46 200 of 9,954 10,000 19 200 of 9,981 10,000" in page.text
    assert "in 3 of 3 collections; transferability was identified in 3" in page.text
    assert "numba 0.68.1" in page.text
    assert "wall-clock time in seconds 1,234.5" in page.text


def test_every_setting_is_there(page: Page):
    def leaves(value: Any) -> list[str]:
        return [value] if isinstance(value, str) else [leaf for _, inner in value for leaf in leaves(inner)]

    settings = leaves(settings_tree(SPEC.as_dict()))
    assert len(settings) > 50
    assert all(setting in page.text for setting in settings)


def test_settings_become_text_and_pairs():
    bounds = ({"variable": "x", "lower": 1.0, "upper": 2.0, "lower_strict": False, "upper_strict": False},)
    assert settings_tree({"most_episodes": {"I": 2_000_000}, "seed": 0}) == [
        ("most episodes", [("I", "2,000,000")]),
        ("seed", "0"),
    ]
    assert settings_tree({"bounds": bounds}) == "x ∈ [1, 2]"
    assert settings_tree(((10_000, 100), (0, 5_000))) == "10,000, 100; 0, 5,000"
    assert settings_tree([None, True, 0.5, "a"]) == "none, yes, 0.5, a"


def test_text_from_data_is_escaped(results: dict[str, Any]):
    evil = "<script>alert('&')</script>"
    summary = {**results["summary"], "command": evil, "reason": evil}
    found = {**results, "summary": summary, "environment": {**results["environment"], "platform": evil}}
    html = render_report(found, replace(SPEC, title=evil), {})
    assert "<script>alert" not in html
    assert evil in Page(html).text


@pytest.mark.parametrize(
    ("methods", "formulas"),
    [
        (("I",), (None, None, None)),
        (("I", "II"), (synthetic.SOURCE, None, synthetic.PLAIN)),
        ((), (synthetic.SOURCE, synthetic.TARGET, None)),
    ],
)
def test_what_is_missing_is_said_to_be(methods: tuple[str, ...], formulas: tuple[str | None, ...]):
    text = Page(render_report(synthetic.results(SPEC, methods=methods, formulas=formulas), SPEC, {})).text
    assert "Not drawn: there is nothing to show in this run." in text
    assert "not carried out" in text
    assert "No formula was inferred." in text
    assert ("Not identified." in text) == (formulas[1] is None)


def test_the_verdict_has_the_key_numbers(results: dict[str, Any]):
    summary = results["summary"]
    said = " ".join(verdict(summary, SPEC))
    mean = summary["methods"]["IV"]["statistics"]["goal"]["mean"]
    assert "logically transferable" in said
    assert f"after {mean:,.0f} episodes on average over 3 runs" in said
    assert f"{summary['ratios']['III/IV']['goal']['value']:.1f} times fewer" in said
    assert "0 of 3 runs had a block of 10 episodes at the optimum within 60,000 episodes, at least" in said
    assert "(paper: 834,590)" in said
    assert "short run" not in said
    assert "short run" in " ".join(verdict({**summary, "quick": True}, SPEC))


def test_the_verdict_without_transferability():
    found = synthetic.results(SPEC, methods=("I", "II"), formulas=(synthetic.SOURCE, None, synthetic.PLAIN))
    said = " ".join(verdict(found["summary"], SPEC))
    assert "not identified" in said
    assert "Method IV)" not in said


def test_choices_take_their_numbers_from_the_specification():
    def ours(spec: Any) -> str:
        return "\n".join(f"{choice.subject}: {choice.ours}" for choice in choices(spec))

    said = ours(CASE_STUDY_1)
    assert "≈ 67, and this is a little below it" in said
    assert "Yᵀ = [4, 7] × [0, 2] (the paper infers [4, 7] × [1, 2])" in said
    assert "Gˢ = [3, 4] × [3, 5] (as the paper infers it)" in said
    assert "No random actions (ε = 0)" in said
    learning = replace(
        CASE_STUDY_1.learning,
        source_episodes=1_234,
        settings=replace(CASE_STUDY_1.learning.settings, epsilon=0.1, initial=80.0),
    )
    said = ours(replace(CASE_STUDY_1, learning=learning, runs=4))
    assert "1,234 episodes in each run" in said
    assert "ε = 0.1" in said
    assert "80, the same for every method" in said
    assert "above it" in said
    assert "in all 4 learning runs" in said


def test_a_study_of_ones_own_is_not_compared_with_the_paper():
    spec = replace(
        SPEC,
        published=Published(),
        remarks=(
            (
                "Rule",
                "None.",
                "Ours & theirs <b>.",
            ),
        ),
    )
    page = render_report(synthetic.results(spec), spec, {})
    assert "Counterpart in the paper" not in page
    assert "13,850" not in page
    assert '<th scope="col">Paper</th>' not in page
    assert "Ours &amp; theirs &lt;b&gt;." in page
