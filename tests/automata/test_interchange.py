from __future__ import annotations

import json
import re
import shutil
import subprocess
from contextlib import suppress
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.automata.twins import CASE_STUDY, G, one
from tests.strategies import sequential_conjunctions
from tickwise.automata.build import build
from tickwise.automata.interchange import fill, from_json, label, layout, to_dot, to_json, to_mermaid
from tickwise.errors import AutomatonError

AUTOMATON = build(CASE_STUDY)
SMALL = build(one("F", 1, 2))
HOSTILE = replace(SMALL, locations=('a "b" \\', "<script>;end", "#|`x`|\n"))


def test_dot_by_hand():
    text = str(SMALL.conjunction)
    assert to_dot(SMALL).splitlines() == [
        "digraph automaton {",
        "  rankdir=LR;",
        f'  label="{text}";',
        '  node [shape=circle, style=filled, fontname="Helvetica"];',
        '  edge [fontname="Helvetica", fontsize=11];',
        "  start [shape=point];",
        '  n0 [label="q0", shape=circle, fillcolor="#E69F00"];',
        '  n1 [label="acc", shape=doublecircle, fillcolor="#FFFFFF"];',
        '  n2 [label="rej1", shape=circle, fillcolor="#BBBBBB"];',
        "  start -> n0;",
        '  n0 -> n0 [label="¬ρ1, c1 < 2\\nρ1, c1 < 1"];',
        '  n0 -> n1 [label="ρ1, c1 >= 1, c1 <= 2"];',
        '  n0 -> n2 [label="¬ρ1, c1 >= 2"];',
        '  n1 -> n1 [label="any letter"];',
        '  n2 -> n2 [label="any letter"];',
        f'  legend [shape=note, fillcolor="#FFFFFF", label="ρ1: {G}\\l"];',
        "}",
    ]
    assert '  n0 -> n1 [label="ρ1, c1 >= 1 / c2 := 0"];' in to_dot(AUTOMATON).splitlines()


@pytest.mark.skipif(shutil.which("dot") is None, reason="Graphviz's dot is not installed")
@pytest.mark.parametrize("automaton", [AUTOMATON, SMALL, HOSTILE])
def test_graphviz_reads_the_dot(automaton):
    done = subprocess.run(
        ["dot", "-Tplain"], input=to_dot(automaton), capture_output=True, text=True, check=True, timeout=60
    )
    nodes = [line for line in done.stdout.splitlines() if line.startswith("node ")]
    assert len(nodes) == len(automaton.locations) + 2  # with the start and the legend


@pytest.mark.parametrize("automaton", [AUTOMATON, SMALL, HOSTILE])
def test_dot_strings_end_where_they_should(automaton):
    string = r'"(?:[^"\\\n]|\\.)*"'
    attributes = rf"\[\w+=({string}|\w+)(, \w+=({string}|\w+))*\]"
    statement = rf"  ((\w+|n\d+ -> n\d+|start -> n\d+)( {attributes})?|\w+=({string}|\w+));"
    for line in to_dot(automaton).splitlines()[1:-1]:
        assert re.fullmatch(statement, line), line


def test_mermaid_by_hand():
    lines = to_mermaid(SMALL).splitlines()
    assert lines[:6] == [
        "flowchart LR",
        "  start(( ))",
        '  n0(("q0"))',
        '  n1((("acc")))',
        '  n2(("rej1"))',
        "  start --> n0",
    ]
    assert '  n0 -->|"ρ1, c1 #62;= 1, c1 #60;= 2"| n1' in lines
    assert '  n0 -->|"¬ρ1, c1 #60; 2<br>ρ1, c1 #60; 1"| n0' in lines
    assert "  style n1 fill:#FFFFFF,stroke:#000000,color:#000000" in lines
    assert sum(line.startswith("  legend") for line in lines) == 1


@pytest.mark.parametrize("automaton", [AUTOMATON, HOSTILE])
def test_mermaid_text_holds_no_markup(automaton):
    for line in to_mermaid(automaton).splitlines():
        for text in re.findall(r'"(.*)"', line):
            plain = re.sub(r"#\d+;", "", text.replace("<br>", ""))
            assert not set(plain) & set('"#&;<>`\\*_|')


@settings(max_examples=300)
@given(sequential_conjunctions())
def test_json_is_read_back_to_an_equal_automaton(conjunction):
    automaton = build(conjunction)
    assert from_json(to_json(automaton)) == automaton


def test_json_keeps_what_is_not_standard():
    assert from_json(to_json(HOSTILE)) == HOSTILE
    document = json.loads(AUTOMATON.to("json"))
    assert document["version"] == 1
    assert document["formula"] == str(CASE_STUDY)
    assert document["locations"][1] == {"name": "q1", "kind": "working", "stage": 0, "active": ["c1", "c2"]}
    assert document["edges"][2] == {
        "source": "q0",
        "literals": [[0, True]],
        "guard": [["c1", ">=", 1]],
        "resets": ["c2"],
        "target": "q1",
    }


def changed(*path_and_value: object) -> str:
    """The JSON of `SMALL` with one value changed."""
    *path, key, value = path_and_value
    document = json.loads(to_json(SMALL))
    place = document
    for step in path:
        place = place[step]
    place[key] = value
    return json.dumps(document)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a JSON document"),
        ("{", "not a JSON document"),
        ("[" * 100_000, "not a JSON document"),
        ("9" * 5000, "not a JSON document"),
        ("[]", "lacks 'format'"),
        ("{}", "lacks 'format'"),
        (changed("version", 2), "version 2 cannot be read"),
        (changed("version", True), "'version' in the JSON is True"),
        (changed("format", "dot"), "format 'dot'"),
        (changed("formula", "F[3,1] x > 2"), "a formula in the JSON cannot be read"),
        (changed("formula", "x >"), "a formula in the JSON cannot be read"),
        (changed("formula", "F[0,1] x > 2 | F[0,1] x > 3"), "2 disjuncts"),
        (changed("predicates", ["F[0,1] x > 2"]), "is no predicate"),
        (changed("predicates", ["x > 2"]), "predicates are not the conjunction's"),
        (changed("predicates", [1]), "a predicate in the JSON is 1"),
        (changed("clocks", "c1"), "'clocks' in the JSON is 'c1'; give a value of type list"),
        (changed("clocks", [None]), "a clock in the JSON is None"),
        (changed("locations", 0, "q"), "lacks 'name'"),
        (changed("locations", 0, "kind", "maybe"), "kind of location 'maybe'"),
        (changed("locations", 0, "stage", 5), "stage 5"),
        (changed("locations", 0, "active", []), "clock 'c1' matters in 'q0'"),
        (changed("locations", 0, "active", [["c1"]]), r"the clock \['c1'\]"),
        (changed("initial", "q9"), "the location 'q9'"),
        (changed("initial", None), "'initial' in the JSON is None"),
        (changed("edges", 0, "source", "nowhere"), "the location 'nowhere'"),
        (changed("edges", 0, "guard", [["c1", "<"]]), "a clock constraint in the JSON has 2 entries"),
        (changed("edges", 0, "guard", [["c1", "=", 2]]), "comparison '='"),
        (changed("edges", 0, "guard", [["c1", "long" * 999, 2]]), "comparison 'longlong.{1,60}…"),
        (changed("edges", 0, "guard", [["c1", "<", 2.0]]), "a clock constraint in the JSON is 2.0"),
        (changed("edges", 0, "literals", [[0, 1]]), "a literal in the JSON is 1"),
        (changed("edges", 0, "literals", [[3, True]]), "predicate of edge 0 3"),
        (changed("edges", 0, "literals", []), "not deterministic"),
    ],
)
def test_malformed_json_is_refused_in_one_line(text, message):
    with pytest.raises(AutomatonError, match=message) as caught:
        from_json(text)
    assert "\n" not in str(caught.value)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda children: st.lists(children, max_size=3) | st.dictionaries(st.text(max_size=4), children, max_size=3),
    max_leaves=4,
)


@settings(max_examples=300)
@given(st.data())
def test_a_document_with_anything_in_it_is_read_or_refused(data):
    document = json.loads(to_json(SMALL))
    place, key = document, data.draw(st.sampled_from(sorted(document)))
    while isinstance(place[key], dict | list) and place[key] and data.draw(st.booleans()):
        place = place[key]
        key = data.draw(st.sampled_from(sorted(place) if isinstance(place, dict) else range(len(place))))
    place[key] = data.draw(VALUES)
    with suppress(AutomatonError):  # and nothing else
        from_json(json.dumps(document))


@settings(max_examples=100)
@given(sequential_conjunctions())
def test_both_drawings_have_every_location_and_edge(conjunction):
    automaton = build(conjunction)
    dot, mermaid = to_dot(automaton), to_mermaid(automaton)
    drawn = {(edge.source, edge.target) for edge in automaton.edges}
    assert dot.count(" -> ") == mermaid.count(" -->") == len(drawn) + 1
    for edge in automaton.edges:
        assert re.search(
            rf'n{edge.source} -> n{edge.target} \[label="(.*\\n)?{label(automaton, edge)}(\\n.*)?"\];', dot
        )
    for name in automaton.locations:
        assert f'label="{name}"' in dot
        assert f'("{name}")' in mermaid


def test_the_layout_of_case_study_1():
    assert layout(AUTOMATON) == ((0, 0), (0, 1), (1, 0), (2, 0), (0, -1), (1, -1))


@given(sequential_conjunctions())
def test_no_two_locations_are_drawn_at_one_place(conjunction):
    automaton = build(conjunction)
    places = layout(automaton)
    assert len(set(places)) == len(places) == len(automaton.locations)
    for location, (x, y) in enumerate(places):
        assert (y < 0) == (location in automaton.rejecting)
        assert (x == len(automaton.predicates)) == (location in automaton.accepting)


def _luminance(colour: str) -> float:
    channels = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_black_text_is_readable_on_every_fill():
    for location in range(len(AUTOMATON.locations)):
        contrast = (_luminance(fill(AUTOMATON, location)) + 0.05) / 0.05
        assert contrast > 4.5
    assert fill(AUTOMATON, 0) == fill(AUTOMATON, 1) != fill(AUTOMATON, 2)


@pytest.mark.skipif(shutil.which("dot") is None, reason="Graphviz's dot is not installed")
@pytest.mark.parametrize("automaton", [AUTOMATON, HOSTILE])
def test_graphviz_draws_the_dot(automaton):
    done = subprocess.run(
        ["dot", "-Tsvg"], input=to_dot(automaton), capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stderr == ""
    texts = [element.text for element in ElementTree.fromstring(done.stdout).iter("{http://www.w3.org/2000/svg}text")]
    lines = [line.strip() for name in automaton.locations for line in name.splitlines()]
    assert set(lines) <= {text.strip() for text in texts}
    for edge in automaton.edges:
        assert label(automaton, edge) in texts
