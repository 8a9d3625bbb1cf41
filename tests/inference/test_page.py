import re
from html.parser import HTMLParser

import numpy as np
import pytest

from tickwise.inference.classifier import MITLClassifier
from tickwise.inference.explanation import explain
from tickwise.inference.page import render_page
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.validation import cross_validate, hold_out
from tickwise.logic.parse import parse

NASTY = "<script>alert('x')</script>"
VOID = {"meta", "br", "rect", "line", "polyline"}


class Reader(HTMLParser):
    """The tags, attributes and text of a page; complains of tags that do not match."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open, self.tags, self.attributes, self.text = [], [], [], []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    @property
    def words(self) -> str:
        return " ".join(" ".join(self.text).split())


@pytest.fixture(scope="module")
def data():
    """Label 1 iff x is at least 5 at ticks 1 and 2, less one of each; names and a variable are HTML."""
    rng = np.random.default_rng(1)
    X = rng.uniform(0, 10, (100, 4, 2))
    X[:50, 1:3, 0], X[50:, 1:3, 0] = rng.uniform(6, 10, (50, 2)), rng.uniform(0, 4, (50, 2))
    y = np.repeat([1, -1], 50)
    y[[0, 60]] *= -1
    names = [f"{NASTY}{row}" for row in range(100)]
    return LabelledTrajectories.from_arrays(X, y, ("x", "<b>y"), ids=names)


SETTINGS = {"Search": NASTY, "Seed": 0}


def inferred(data, **more):
    model = MITLClassifier(depth=1, variables=data.variables, rate=0.9).fit(data.values, data.labels)
    facts = {
        "formula": str(model.formula_), "classification_rate": 0.98, "information_gain": 0.1, "size": 1,
        "satisfying": True, "seconds": 1.25, "interrupted": False,
    }  # fmt: skip
    found = explain(model.formula_.formula, data)
    return render_page(found, data, source=NASTY, settings=SETTINGS, facts=facts, tree=model.tree_, **more)


def test_nothing_of_the_data_is_taken_for_html(data):
    page = inferred(data)
    reader = Reader(page)
    assert "script" not in reader.tags
    assert "b" not in reader.tags
    assert f"{NASTY}60" in reader.words
    assert "<b>y over time" in reader.words


def test_the_page_needs_no_network_and_runs_nothing(data):
    page = inferred(data)
    reader = Reader(page)
    assert ("content", "default-src 'none'; style-src 'unsafe-inline'") in reader.attributes
    assert not {"link", "img", "iframe", "object", "script"} & set(reader.tags)
    assert not [name for name, _ in reader.attributes if name in ("src", "href") or name.startswith("on")]
    assert "http" not in page.replace("http-equiv", "")
    assert re.findall(r"url\(([^)]*)\)", page) == []  # no part asks to be outside of a box
    assert inferred(data) == page


def test_what_the_page_of_an_inference_says(data):
    words = Reader(inferred(data)).words
    assert "The formula is right on 98 of 100 trajectories." in words
    assert "A random sample of 80 is drawn, at most 40 of each label." in words
    assert "Decision tree" in words
    assert "2 trajectories that are predicted wrongly" in words
    assert re.search(r"violates .*, by \d", words)
    assert "Size 1, a satisfying formula (Problem 1)" in words


def test_folds_and_holdout_have_their_places(data):
    model = MITLClassifier(depth=1, variables=data.variables, rate=0.9)
    words = Reader(inferred(data, judged=cross_validate(model, data, 2))).words
    assert "Held-out predictions of 2 folds, pooled" in words
    assert "Formula inferred from the others" in words
    fitted, judged = hold_out(model, data, 0.3)
    known = data.select(np.setdiff1d(np.arange(100), judged.trials[0].rows))
    facts = {
        "formula": "it", "classification_rate": 1.0, "information_gain": 0.1, "size": 1, "satisfying": False,
        "seconds": 0.0, "interrupted": True,
    }  # fmt: skip
    found = explain(fitted.formula_.formula, known)
    words = Reader(render_page(found, data, source="s", settings={}, facts=facts, judged=judged)).words
    assert "The 30 trajectories that were held out" in words
    assert "Formula inferred from the others" not in words


def test_a_checked_formula_and_none(data):
    words = Reader(
        render_page(explain(parse("G[0,3] !(x >= 9) | F[0,1] G[0,1] (x >= 5)"), data), data, source="s")
    ).words
    assert "a formula checked on labelled trajectories" in words
    assert "¬: where not to be" in words
    assert "end of the outer window" in words
    assert "Inference" not in words
    nothing = render_page(explain(None, data), data, source="s", settings=SETTINGS, facts={
        "formula": None, "seconds": 0.1, "interrupted": False,
    })  # fmt: skip
    assert "No formula was found" in Reader(nothing).words
