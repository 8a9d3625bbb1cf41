"""The figures of a study: what is drawn, what is left out, and that the same results give the same bytes."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import matplotlib
import pytest
from matplotlib.figure import Figure

from tests.experiments import synthetic
from tickwise.automata.build import timed_automata
from tickwise.envs.catalog import CASE_STUDY_2_SOURCE, CASE_STUDY_2_TARGET
from tickwise.errors import AutomatonError
from tickwise.experiments.figures import (
    FIGURES,
    automata,
    convergence,
    curves,
    draw_automata,
    draw_figures,
    maps,
    tree,
    workflow,
)
from tickwise.experiments.study import StudySpec
from tickwise.logic.parse import parse
from tickwise.logic.render import to_unicode

SPEC = synthetic.small()


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    return synthetic.results(SPEC)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("figures")


@pytest.fixture(scope="module")
def drawn(results: dict[str, Any], folder: Path) -> dict[str, str]:
    return draw_figures(results, SPEC, folder)


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text) if text.get_text()]


def test_every_figure_is_written_as_svg_and_png(drawn: dict[str, str], folder: Path):
    assert tuple(drawn) == FIGURES
    for name, svg in drawn.items():
        assert (folder / f"{name}.svg").read_text(encoding="utf-8") == svg
        assert ElementTree.fromstring(svg).tag.endswith("svg")
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert not [path for path in folder.iterdir() if path.suffix not in (".svg", ".png")]


def test_the_same_results_give_the_same_bytes(drawn: dict[str, str], folder: Path, tmp_path: Path):
    before = dict(matplotlib.rcParams)
    with matplotlib.rc_context({"font.size": 30, "svg.hashsalt": None}):  # a reader's own settings
        assert draw_figures(synthetic.results(SPEC), SPEC, tmp_path) == drawn
    assert dict(matplotlib.rcParams) == before
    for path in folder.iterdir():
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()


def test_no_date_is_in_the_files(drawn: dict[str, str]):
    assert not any("<dc:date>" in svg or "Created with" in svg for svg in drawn.values())


def test_figures_without_content_are_left_out_and_old_ones_removed(tmp_path: Path):
    (tmp_path / "automata.svg").write_text("old")
    nothing = synthetic.results(SPEC, methods=(), formulas=(None, None, None))
    assert tuple(draw_figures(nothing, SPEC, tmp_path)) == ("workflow", "maps", "tree")
    assert not (tmp_path / "automata.svg").exists()


def test_importing_the_package_does_not_import_matplotlib():
    code = "import sys, tickwise.experiments.figures; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_workflow_has_the_studys_numbers(results: dict[str, Any]):
    said = "\n".join(texts(workflow.draw(results, SPEC)))
    assert "26 with label 1, 200 with −1" in said
    assert "18,000 episodes" in said
    assert "6 locations, 2 clocks" in said
    assert "60,000 episodes" in said
    mean = results["summary"]["methods"]["IV"]["statistics"]["goal"]["mean"]
    assert f"with transfer {mean:,.0f}" in said


def test_the_workflow_says_that_transferability_was_not_identified():
    found = synthetic.results(SPEC, methods=("I",), formulas=(synthetic.SOURCE, None, synthetic.PLAIN))
    said = "\n".join(texts(workflow.draw(found, SPEC)))
    assert "Logically transferable?\nno" in said
    assert "not satisfying: rate 0.995, size 2" in said
    assert "Method I: 0 of 3 runs got there" in said
    assert "transfer of" not in said


def test_the_maps_show_true_and_inferred_regions(results: dict[str, Any]):
    figure = maps.draw(results, SPEC)
    assert len(figure.axes) == 3
    target = figure.axes[1]
    rectangles = {(patch.get_xy(), patch.get_width(), patch.get_height()) for patch in target.patches}
    assert rectangles == {((5.0, 6.0), 1.0, 1.0), ((4.0, 0.0), 3.0, 2.0)}
    said = [text.get_text() for text in target.texts]
    assert r"$Y^{\mathrm{T}}$" in said
    assert r"$\bar{Y}^{\mathrm{T}}$" in said
    assert r"$\bar{Y}'^{\mathrm{T}}$" in [text.get_text() for text in figure.axes[2].texts]


def test_a_map_without_a_formula_says_so(results: dict[str, Any]):
    summary = {**results["summary"], "formulas": dict.fromkeys(results["summary"]["formulas"])}
    figure = maps.draw({**results, "summary": summary}, SPEC)
    assert all("no formula was inferred" in [text.get_text() for text in axes.texts] for axes in figure.axes)


def test_the_tree_has_a_note_for_every_node(results: dict[str, Any]):
    figure = tree.draw(results, SPEC)
    assert figure is not None
    said = "\n".join(texts(figure))
    assert said.count("with label 1,") == 5
    assert "leaf: label 1, condition I" in said
    assert r"\bar{G}^{\mathrm{S}}$ = [3, 4] × [3, 5]" in said


def test_the_automata_have_their_edges_and_the_mapping(results: dict[str, Any]):
    figure = automata.draw(results, SPEC)
    assert figure is not None
    said = texts(figure)
    assert "$\\bar{G}^{\\mathrm{T}}$, $c_{1} \\geq 3$\n$c_{2}\\,≔\\,0$" in said
    assert r"$\bar{Y}^{\mathrm{T}}$, $27 \leq c_{1} \leq 40$" in said
    assert not any("< 0" in text for text in said)  # no clock is below 0
    assert r"Mapping $\xi$" in said
    assert any(r"$\bar{Y}^{\mathrm{T}}$ ┄ $\bar{Y}^{\mathrm{S}}$" in text for text in said)


@pytest.mark.parametrize(
    ("target", "mapping"),
    [
        ("G[0,30] F[0,10] (2 <= x <= 3 & 3 <= y <= 4) | G[0,30] F[0,9] (4 <= x <= 5 & 3 <= y <= 4)", True),
        ("F[0,30] (2 <= x <= 3 & 3 <= y <= 4)", False),
        (None, None),
    ],
)
def test_automata_of_other_formulas(results: dict[str, Any], target: str | None, mapping: bool | None):
    spec = replace(SPEC, source=CASE_STUDY_2_SOURCE, target=CASE_STUDY_2_TARGET)
    formulas = {"source": "G[0,17] F[0,8] (2 <= x <= 3 & 2 <= y <= 3)", "target": target}
    figure = automata.draw({**results, "summary": {**results["summary"], "formulas": formulas}}, spec)
    assert figure is not None
    said = texts(figure)
    assert (r"Mapping $\xi$" in said) == (mapping is not None)
    assert ("none: the two are not structurally equivalent" in said) == (mapping is False)


@pytest.mark.parametrize(("value", "text"), [(100, "100"), (2_500, "2.5k"), (10_000, "10k"), (2_000_000, "2M")])
def test_short_numbers(value: float, text: str):
    assert curves.short(value) == text


def test_runs_that_did_not_get_there_are_arrows(results: dict[str, Any]):
    figure = convergence.draw_convergence(results, SPEC)
    assert figure is not None
    first = figure.axes[0]
    assert "3 runs" in [text.get_text().strip() for text in first.texts]
    low, high = first.get_xlim()
    shown = [run["goal"] for runs in results["methods"].values() for run in runs if run["goal"]]
    assert low < min(shown)
    assert high > 2_000_000
    assert figure.axes[1].get_xlim() == (low, high)


@pytest.mark.parametrize("methods", [("I",), ("I", "III")])
def test_missing_methods_are_left_out(methods: tuple[str, ...]):
    spec: StudySpec = replace(SPEC, runs=1)
    found = synthetic.results(spec, methods=methods)
    for draw in (curves.draw, convergence.draw_boxplot, convergence.draw_convergence):
        figure = draw(found, spec)
        assert figure is not None
        assert not any("IV" in text for text in texts(figure))


@pytest.mark.parametrize(
    "formula",
    [
        "F[0,2] (x >= 3)",
        "F[1,5] G[0,4] !(x >= 3 & y <= 2) & G[10,20] (y <= 2)",
        "F[0,2] (x >= 3) | G[1,4] F[0,2] (y <= 2 & 0 <= z <= 1)",
    ],
)
def test_automata_of_no_study(formula: str):
    drawn = timed_automata(parse(formula))
    svg = draw_automata(drawn)
    with matplotlib.rc_context({"font.size": 30, "svg.hashsalt": None}):
        assert draw_automata(drawn) == svg
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    comments = [node.text.strip() for node in ElementTree.fromstring(svg, parser).iter(ElementTree.Comment)]
    for automaton in drawn:  # letters are paths in the file, with the text in a comment
        for location in automaton.locations:
            assert automata.location_text(location) in comments
        for number, predicate in enumerate(automaton.predicates, start=1):
            assert rf"$\rho_{{{number}}}$:" in comments
            assert to_unicode(predicate) in comments
    assert not {"Source:", "Target:"} & set(comments)


def test_no_automaton_is_no_drawing():
    with pytest.raises(AutomatonError, match="give at least one"):
        draw_automata(())
