"""Method V in the player, in a real browser: its formula is another one from one point of learning to the next."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.browsers import Open
from tests.experiments import recorded, synthetic
from tests.experiments.playing import choose, watch
from tickwise.automata.build import timed_automata
from tickwise.automata.run import EdgeStep, run
from tickwise.experiments.recording import PREFIX
from tickwise.experiments.report import render_report
from tickwise.logic.parse import parse

SPEC = synthetic.small()


def test_the_formula_of_method_v_changes_between_its_points(opened: Open, results: dict[str, Any]):
    page = opened()
    choose(page, method="V", run="2")
    mdp = SPEC.target.mdp()
    drawn = []
    for point, (learned, text) in enumerate(zip(("0 ", "1,000 "), recorded.GUESSES, strict=True)):
        choose(page, point=learned, episode="1")
        (automaton,) = timed_automata(parse(text))
        states = results["methods"]["V"][1][PREFIX + "states"][point, 0]
        path = mdp.coordinates[states[states >= 0]]
        steps = [step for step in run(automaton, path, variables=mdp.variables).steps if isinstance(step, EdgeStep)]
        assert [seen["locations"] for seen in watch(page)] == [[step.target] for step in steps]
        assert page.locator(".automaton .place").count() == len(automaton.locations)
        assert page.locator(".literal").count() == len(automaton.conjunction.primitives)
        said = page.locator("[data-show=formula]").text_content()
        what = "formula" if point else "best guess"  # collecting ended in between
        assert said.startswith(f"φᵀ, this run’s {what} after {learned}episodes: ")
        drawn.append((page.locator(".automaton").inner_html(), said))
    assert drawn[0][0] != drawn[1][0]
    assert drawn[0][1] != drawn[1][1]
    choose(page, method="III")  # which has one formula at all of its points
    assert page.locator("[data-show=formula]").text_content().startswith("φᵀ: ")


def test_its_last_point_is_shown_first_where_nothing_else_was_recorded(opened: Open, tmp_path: Path):
    results = recorded.results(SPEC)
    for each in (*results["methods"]["I"], *results["methods"]["III"], *results["source_learning"]):
        for name in [name for name in each if name.startswith(PREFIX)]:
            del each[name]
    path = tmp_path / "loop.html"
    path.write_text(render_report(results, SPEC, {}), encoding="utf-8")
    page = opened(path)
    assert page.locator("[data-choose=method] option").count() == 1
    assert page.locator("[data-show=formula]").text_content().startswith("φᵀ, this run’s formula after 1,000 episodes")
    page.locator(".player").focus()
    page.keyboard.press("[")
    assert page.locator("[data-show=formula]").text_content().startswith("φᵀ, this run’s best guess after 0 episodes")
    page.get_by_role("button", name="Drive it yourself").click()
    assert page.get_by_text("Make φᵀ true").is_visible()
