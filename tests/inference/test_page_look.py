"""The page of an inference in a real browser: what it draws, on a phone, in the dark, and on paper."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.browsers import Open, hard_to_read, quiet_pages, too_wide
from tickwise.inference.classifier import MITLClassifier
from tickwise.inference.explanation import explain
from tickwise.inference.page import render_page
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.parse import parse

IDS = [f"<b>run</b> {row}" for row in range(40)]
WRONG = [IDS[row] for row in (0, 1, 30)]


@pytest.fixture(scope="module")
def data() -> LabelledTrajectories:
    """Label 1 stays in a region at ticks 3 to 6, label -1 does not; three labels are wrong."""
    rng = np.random.default_rng(3)
    states = rng.normal(5, 1, (40, 12, 2)).cumsum(axis=1) / np.arange(1, 13)[:, None]
    states[:20, 3:7] = rng.uniform(8, 10, (20, 4, 2))
    labels = np.repeat([1, -1], 20)
    labels[[0, 1, 30]] *= -1
    return LabelledTrajectories.from_arrays(states, labels, ("x", "height"), ids=IDS)


@pytest.fixture(scope="module")
def path(data: LabelledTrajectories, tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = explain(parse("G[3,6] (x >= 7.5 & height >= 7.5)"), data)
    assert [mistake.id for mistake in found.mistakes] == WRONG
    tree = MITLClassifier(depth=1, size=1, rate=0.8, variables=data.variables).fit(data.values, data.labels).tree_
    written = tmp_path_factory.mktemp("page") / "formula.html"
    written.write_text(render_page(found, data, source="s", tree=tree), encoding="utf-8")
    return written


@pytest.fixture
def opened(browser: object) -> Iterator[Open]:
    with quiet_pages(browser) as open_page:
        yield open_page


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read_in_light_and_in_dark(opened: Open, path: Path, scheme: str):
    page = opened(path, color_scheme=scheme)
    dark = page.evaluate("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)"
    assert dark == (scheme == "dark")
    assert hard_to_read(page) == {}
    assert too_wide(page) == []


def test_a_phone_shows_it_without_scrolling_sideways(opened: Open, path: Path):
    page = opened(path, viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    assert too_wide(page) == []
    for drawing in page.locator(".picture").all():  # nothing of a drawing is cut off or has to be scrolled
        assert drawing.evaluate("box => box.scrollWidth <= box.clientWidth")


def test_trajectories_are_coloured_by_label_over_the_regions(opened: Open, path: Path):
    page = opened(path)
    colours = {
        kind: page.locator(f"polyline.{kind}").first.evaluate("line => getComputedStyle(line).stroke")
        for kind in ("one", "other")
    }
    assert colours["one"] != colours["other"]
    dashes = page.locator("polyline.other").first.evaluate("line => getComputedStyle(line).strokeDasharray")
    assert dashes != "none"  # colour is not all that tells them apart
    first = page.locator("figure").first
    assert first.locator("polyline").count() == 40
    assert first.locator("polyline title").first.text_content() in {f"{name}, label -1" for name in IDS}
    for kind in ("one", "other"):
        assert page.locator(f".tree .leaf.{kind}").count() == 1


def test_what_is_predicted_wrongly_is_listed_and_drawn_by_name(opened: Open, path: Path):
    page = opened(path)
    listed = page.locator("h3:has-text('Predicted wrongly') + .wide tbody th").all_text_contents()
    assert listed == WRONG
    drawn = page.locator("figure:has(.bold)").all()
    assert drawn
    for figure in drawn:
        names = figure.locator("text.name").evaluate_all(
            """texts => texts.map((text) => [text.textContent, text.getBoundingClientRect().top,
              text.getBoundingClientRect().right <= text.ownerSVGElement.getBoundingClientRect().right + 1])"""
        )
        own = [entry for entry in names if entry[0] in WRONG]
        assert sorted(name for name, *_ in own) == sorted(WRONG)
        assert all(inside for *_, inside in own)
        tops = sorted(top for _, top, _ in own)
        assert min(np.diff(tops)) > 10
    assert page.locator("svg[role=img] .break").count() >= 1  # where the one with label 1 leaves the region


def test_paper_has_all_of_it(opened: Open, path: Path):
    page = opened(path, viewport={"width": 680, "height": 1000})
    page.emulate_media(media="print")
    assert too_wide(page) == []
    assert len(page.pdf()) > 10_000
