"""How the report looks in a real browser: its curves, on a phone, in the dark, on paper, and without scripts."""

from __future__ import annotations

import json
import re
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.browsers import Open, contrast, hard_to_read, too_wide
from tests.experiments.playing import choose, told


def test_no_label_of_an_automaton_covers_another(opened: Open):
    page = opened()
    choose(page, method="III")
    for details in page.locator("details.automaton-box").all():
        details.evaluate("details => { details.open = true; }")
    for drawing in page.locator(".automaton").all():
        boxes = drawing.locator(".guard").evaluate_all(
            "texts => texts.map((text) => text.getBBox()).map((b) => [b.x, b.y, b.x + b.width, b.y + b.height])"
        )
        for one, other in combinations(boxes, 2):
            across, down = (min(one[i + 2], other[i + 2]) - max(one[i], other[i]) for i in (0, 1))
            assert across <= 0 or down <= 2, (one, other)  # lines of one label stand close


def test_curves_tell_their_values_under_the_pointer(opened: Open):
    page = opened()
    plot = page.locator(".plot").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    text = page.locator(".readout").first.text_content()
    episodes = int(re.match(r"([\d,]+) episodes", text)[1].replace(",", ""))
    data = json.loads(page.locator(".live-curves + script").text_content())
    curve = data["charts"][0]["levels"][0]["IV"]
    index = int(np.argmin(np.abs(np.array(curve["x"]) - episodes)))
    mean, low, high = (f"{curve[name][index]:g}".replace("-", "−") for name in ("mean", "low", "high"))
    assert f"IV: {mean} [{low}, {high}]" in text
    assert page.locator(".plot").first.locator(".dot").count() == 4


def test_curves_zoom_by_dragging_and_by_keys(opened: Open):
    page = opened()
    plot, reset = page.locator(".plot").first, page.get_by_role("button", name="Training: Reset zoom")
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    before = plot.locator(".mean").first.get_attribute("d")
    page.mouse.move(box["x"] + 100, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 180, box["y"] + 65)
    assert plot.locator(".selection").get_attribute("visibility") == "visible"
    page.mouse.up()
    first, last = (int(plot.get_attribute(f"data-{end}")) for end in ("from", "to"))
    assert 0 < first < last < 50_000
    assert plot.locator(".mean").first.get_attribute("d") != before
    reset.click()
    assert (plot.get_attribute("data-from"), plot.get_attribute("data-to")) == ("0", "50000")
    assert reset.is_disabled()
    plot.focus()
    page.keyboard.press("+")
    assert int(plot.get_attribute("data-to")) < 50_000
    inner = int(plot.get_attribute("data-from"))
    page.keyboard.press("Shift+ArrowRight")
    assert int(plot.get_attribute("data-from")) > inner
    page.keyboard.press("0")
    assert plot.get_attribute("data-to") == "50000"
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    assert "27,000 episodes" in page.locator(".readout").first.text_content()
    closer, further, reset = page.locator(".zooms").first.locator("button").all()
    assert further.is_disabled()
    closer.click()  # it zooms in where values are read
    assert (plot.get_attribute("data-from"), plot.get_attribute("data-to")) == ("13500", "38500")
    further.click()
    assert reset.is_disabled()
    page.locator(".legend input").first.uncheck()
    assert plot.locator(".mean").count() == 4


@pytest.mark.parametrize("study", ["case", "tiny"])
def test_a_phone_shows_it_without_scrolling_sideways(opened: Open, finished: Path, study: str, report: Path):
    path = report if study == "case" else finished / "report.html"
    page = opened(path, viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    page.locator("[data-do=forth]").tap()
    assert told(page, "tick") == 1
    assert too_wide(page) == []
    for button in page.locator(".transport button").all():
        box = button.bounding_box()
        assert min(box["width"], box["height"]) >= 40
        assert box["x"] + box["width"] <= 360
    assert page.locator(".map").bounding_box()["width"] > 280


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read_in_light_and_in_dark(opened: Open, scheme: str):
    page = opened(color_scheme=scheme)
    light = page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert light == (scheme == "light")
    for tick in (0, 20, 40):  # signs, clocks and regions change
        page.locator("[data-choose=tick]").fill(str(tick))
        assert hard_to_read(page) == {}
    edges = page.locator(".region").evaluate_all("regions => regions.map((region) => getComputedStyle(region).stroke)")
    floor = page.locator(".floor rect").evaluate("floor => getComputedStyle(floor).fill")
    assert min(contrast(edge, floor) for edge in edges) >= 3  # what WCAG asks of graphics


def test_on_paper_the_state_is_there_without_the_controls(opened: Open):
    page = opened()
    page.locator("[data-do=last]").click()
    page.emulate_media(media="print")
    for hidden in (".choices", ".controls", ".keys", ".live-curves", "nav"):
        assert not page.locator(hidden).first.is_visible(), hidden
    for shown in (".map", ".automaton", ".lane", "#curves .picture", ".on-paper"):
        assert page.locator(shown).first.is_visible(), shown
    assert page.locator(".on-paper").text_content().startswith("III: extended states of φᵀ; run 1, after 1,000 learned")
    assert len(page.pdf()) > 10_000


def test_motion_is_left_out_where_it_is_not_wanted(opened: Open):
    page = opened(reduced_motion="reduce")
    assert page.locator(".robot").evaluate("x => getComputedStyle(x).transitionDuration") == "0s"
    page = opened()
    assert page.locator(".robot").evaluate("x => getComputedStyle(x).transitionDuration") != "0s"


def test_without_scripts_the_page_says_so_and_shows_the_figures(browser: Any, report: Path):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(report.as_uri())
    assert page.get_by_text("Playing needs JavaScript").is_visible()
    assert page.locator("#curves .picture").is_visible()
    assert not page.locator(".player").is_visible()
    context.close()
