"""An effect as a part of a page: sentences, tables and anchors; and its figures."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from tickwise.experiments import effect_measures as m
from tickwise.experiments.effect_catalog import EFFECTS
from tickwise.experiments.effect_part import effect_part, effect_verdict
from tickwise.experiments.figures import draw_effect, effect
from tickwise.experiments.page import render_page

EFFECT = EFFECTS["trajectories"]
ENVIRONMENT = {"version": "1.2.3", "command": "tickwise effect trajectories --seed 0", "workers": 2}
GROWTH = {"fixed": 1.2, "per_thousand": 3.9, "from": 240.0}


def measured(measure: m.Measure, *rows: list[float | None], middle: list[float | None], **extra: Any) -> dict[str, Any]:
    known = [[value for value in row if value is not None] for row in rows]
    return {
        "title": measure.title, "unit": measure.unit.format(window="40,000"), "form": measure.form,
        "share": measure.share, "mark": None, "runs": list(rows), "middle": middle,
        "low": [min(row, default=None) for row in known], "high": [max(row, default=None) for row in known], **extra,
    }  # fmt: skip


@pytest.fixture
def results() -> dict[str, Any]:
    """Three values with two collections each; the last value has no formula."""
    none = [None, None]
    return {
        "summary": {
            "effect": "trajectories", "study": "case1", "quick": False, "seed": 0, "runs": 2, "version": "1.2.3",
            "command": "tickwise effect trajectories --study case1 --runs 2 --seed 0", "symbol": EFFECT.symbol,
            "axis": EFFECT.axis, "values": [100, 200, 1600], "own": 200,
            "measures": {
                "structure": measured(m.STRUCTURE, [0.0, 1.0], [1.0, 1.0], [0.0, 0.0], middle=[0.5, 1.0, 0.0]),
                "source_gain": measured(m.SOURCE_GAIN, [0.1, 0.2], [0.1, None], none, middle=[0.15, 0.1, None]),
                "return_III": measured(
                    m.RETURN_III, [-9.5, -9.5], [60.0, 70.0], none, middle=[-9.5, 65.0, None],
                    mark={"name": "V*", "value": 99.9},
                ),
            },
        },
        "times": {
            "effect": "trajectories", "values": [100, 200, 1600],
            "measures": {
                "algorithm_1": measured(
                    m.ALGORITHM_1, [1.0, 1.2], [2.0, 2.2], [8.0, 9.0], middle=[1.1, 2.1, 8.5], growth=GROWTH
                ),
                "step_2": measured(m.STEP_2, [2.0, 2.0], [2.0, 2.0], none, middle=[2.0, 2.0, None], growth=None),
            },
            "size": measured(
                m.TRAJECTORIES, [120.0, 121.0], [240.0, 241.0], [1900.0, 1910.0], middle=[120.5, 240.5, 1905.0]
            ),
        },
    }  # fmt: skip


def test_the_verdict_is_in_sentences(results: dict[str, Any]):
    assert effect_verdict(EFFECT, results) == [
        "With N⁻ from 100 to 1,600, the share of φˢ with the true structure goes from 0.50 over 1.00 at N⁻ = 200 to "
        "0.00.",
        "The time of Algorithm 1 (Step 1) rises from 1.10 s to 8.50 s; from N⁻ = 200 on that is 1.2 s and 3.9 s per "
        "1,000 trajectories.",
        "The time of the joint fit of φᵀ (Step 2) stays at 2.00 s (none at N⁻ = 1,600).",
    ]


def test_what_could_not_be_measured_is_said(results: dict[str, Any]):
    results["summary"]["measures"]["structure"]["middle"] = [None, None, None]
    assert effect_verdict(EFFECT, results)[0].endswith("with the true structure could not be measured.")
    results["summary"]["measures"]["structure"]["middle"] = [0.9, 0.5, 0.1]
    assert effect_verdict(EFFECT, results)[0].endswith("with the true structure falls from 0.90 to 0.10.")
    results["summary"]["measures"]["structure"]["middle"] = [0.1, 0.95, 0.9]  # hardly more in between
    assert effect_verdict(EFFECT, results)[0].endswith(
        "with the true structure rises from 0.10 to 0.90, nearly all of it by N⁻ = 200."
    )


def test_the_page_of_one_effect(results: dict[str, Any], tmp_path: Path):
    figures = draw_effect(results, tmp_path)
    part = effect_part(EFFECT, results, figures, nested=False)
    page = render_page(part.title, part.verdict, [part], ENVIRONMENT, seed=0)
    for anchor, _ in part.links:
        assert f'<h2 id="{anchor}">' in page
    assert EFFECT.paper in page
    assert EFFECT.reading in page
    identifiers = re.findall(r'\bid="([^"]+)"', page)
    assert {"effect-trajectories-figure", "effect-trajectories-time-figure"} <= set(identifiers)
    assert len(identifiers) == len(set(identifiers))
    assert '<td class="number">−9.5<span class="note"></span></td>' in page
    assert '<td class="number">65.0<span class="note">60.0 to 70.0</span></td>' in page
    assert '<td class="number">0.1000<span class="note">1 none</span></td>' in page
    assert '<td class="number">none<span class="note"></span></td>' in page


def test_beside_other_parts_it_has_one_heading_and_its_first_sentence_speaks_for_it(results: dict[str, Any]):
    part = effect_part(EFFECT, results, {})
    assert "<h2" not in part.body
    assert part.links == []
    assert part.headline == effect_verdict(EFFECT, results)[0]


def test_figures_are_the_same_each_time_and_times_are_apart(results: dict[str, Any], tmp_path: Path):
    drawn = draw_effect(results, tmp_path / "one")
    assert list(drawn) == ["trajectories", "trajectories-time"]
    for name, svg in drawn.items():
        assert ElementTree.fromstring(svg).tag.endswith("svg")
        assert (tmp_path / "one" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    draw_effect(results, tmp_path / "two")
    for path in (tmp_path / "one").iterdir():
        assert (tmp_path / "two" / path.name).read_bytes() == path.read_bytes()


def test_a_panel_a_measure(results: dict[str, Any]):
    figure = effect.draw(results)
    assert figure is not None
    titles = [" ".join((axes.get_title() or axes.get_title("left")).split()) for axes in figure.axes]
    assert titles[1] == r"Information gain of $\varphi^{\mathrm{S}}$"
    ticks = [[label.get_text() for label in axes.get_xticklabels()] for axes in figure.axes]
    assert ticks == [["100", "200", "1600"]] * 3
    assert {text.get_text() for axes in figure.axes for text in axes.texts} == {"none", "$V^*$ = 99.9"}


def test_times_go_with_the_size_of_the_problem(results: dict[str, Any]):
    figure = effect.draw_times(results)
    assert figure is not None
    first, second = figure.axes
    assert (first.get_xscale(), first.get_yscale()) == ("log", "log")
    assert [text.get_text() for text in first.texts] == ["1.2 s + 3.9 s · $N$ / 1,000"]
    assert not second.texts  # no line was found
    del results["times"]["size"]
    figure = effect.draw_times(results)
    assert figure is not None
    assert figure.axes[0].get_yscale() == "linear"
    assert figure.axes[0].get_ylim()[0] == 0


def test_nothing_to_draw(results: dict[str, Any], tmp_path: Path):
    results["times"]["measures"] = {}
    assert list(draw_effect(results, tmp_path)) == ["trajectories"]
    results["summary"]["measures"] = {}
    assert draw_effect(results, tmp_path) == {}


@pytest.mark.parametrize(
    ("value", "text"), [(0, "0"), (0.95, "0.95"), (1600, "1600"), (0.0001, "$10^{-4}$"), (0.0003, "$3·10^{-4}$")]
)
def test_ticks_have_few_signs(value: float, text: str):
    assert effect.tick(value) == text
