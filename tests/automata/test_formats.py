"""What is written for UPPAAL and TChecker runs as the automata do, by an interpreter that reads the text only."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.automata.systems import Simulation, System, read_tchecker, read_uppaal
from tests.automata.twins import CASE_STUDY, one
from tests.strategies import VARIABLES, random_trajectories, sdnfs
from tickwise.automata.build import build, timed_automata
from tickwise.automata.formats import ALONE, FORMATS, TOGETHER, export, export_all
from tickwise.automata.model import TimedAutomaton
from tickwise.automata.network import network
from tickwise.errors import AutomatonError, ConfigurationError
from tickwise.logic.parse import parse
from tickwise.logic.semantics import holds
from tickwise.logic.syntax import Verdict

SMALL = build(one("F", 1, 2))
HOSTILE = replace(SMALL, locations=('a "b" \\', "<script>;end", "#|`x`|\n"))


def words(automata: tuple[TimedAutomaton, ...], X: np.ndarray) -> list[dict[str, bool]]:
    regions = network(automata).regions
    columns = [holds(region, X, VARIABLES).tolist() for region in regions]
    return [{f"p{number}": value for number, value in enumerate(row, start=1)} for row in zip(*columns, strict=True)]


def outcomes_of_uppaal(text: str) -> Callable[[str], int]:
    """What a place such as "Automaton.acc" means, by the system's own queries."""
    satisfied, violated = set(), set()
    for query in ElementTree.fromstring(text).iter("query"):
        if query.findtext("formula").startswith("E<> "):
            found = re.findall(r"[\w.]+", query.findtext("formula").removeprefix("E<> "))
            (satisfied if "satisfied" in query.findtext("comment") else violated).update(found)
    return lambda place: 1 if place in satisfied else -1 if place in violated else 0


def outcomes_of_tchecker(system: System) -> Callable[[str], int]:
    labels = {f"{p.name}.{place}": names for p in system.processes for place, names in p.labels.items()}
    meaning = {"accepting": 1, "rejecting": -1}
    return lambda place: next((meaning[name.rstrip("0123456789")] for name in labels[place]), 0)


@settings(max_examples=60, deadline=None)
@given(sdnfs(longest=3), st.integers(0, 2**32 - 1), st.sampled_from(sorted(TOGETHER)))
def test_a_system_gives_the_verdicts_of_its_automata(phi, seed, format):
    automata = timed_automata(phi)
    ticks = 1 + seed % (phi.formula.end_effect + 2)
    X = random_trajectories(seed, 1, ticks, len(VARIABLES))[0]
    text = export_all(automata, format)
    system = read_uppaal(text) if format == "uppaal" else read_tchecker(text)
    outcome = outcomes_of_uppaal(text) if format == "uppaal" else outcomes_of_tchecker(system)
    simulation = Simulation(system)
    simulation.run(words(automata, X))
    for number, automaton in enumerate(automata, start=1):
        name = "Automaton" if len(automata) == 1 else f"Automaton{number}"
        assert outcome(f"{name}.{simulation.places[name]}") == automaton.verdict(X, variables=VARIABLES)


@pytest.mark.parametrize("format", sorted(TOGETHER))
def test_automata_with_clocks_of_the_same_names_do_not_disturb_one_another(format):
    """Both have a clock c2: the first one's is reset again and again while the second one's has to go on."""
    phi = parse("G[0,9] F[0,1] (x >= 1) | F[0,4] G[0,3] (y >= 1)")
    automata = timed_automata(phi)
    X = np.array([[0, 1], [1, 1], [0, 1], [1, 1], [0, 1]], dtype=float)
    text = export_all(automata, format)
    system = read_uppaal(text) if format == "uppaal" else read_tchecker(text)
    simulation = Simulation(system)
    simulation.run(words(automata, X))
    assert simulation.places["Automaton2"] == "acc"


@settings(max_examples=100, deadline=None)
@given(sdnfs(most=3, disjuncts=2))
def test_the_letters_are_those_that_some_state_has(phi):
    system = network(timed_automata(phi))
    # bounds are whole numbers from -1 to 6: these are all of them, a point between each two, and one beyond
    line = np.arange(-1.5, 7.0, 0.5)
    points = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    columns = [holds(region, points, VARIABLES) for region in system.regions]
    assert list(system.letters) == sorted(set(zip(*(column.tolist() for column in columns), strict=True)))


# --- UPPAAL's document type, as its content models: what may stand in what, in what order ---

CONTENT = {
    "nta": "(imports )?(declaration )?(template )+(instantiation )?system (queries )?",
    "template": "name (parameter )?(declaration )?(location )*(branchpoint )*(init )?(transition )*",
    "location": "(name )?(label )*(urgent )?(committed )?",
    "transition": "source target (label )*(nail )*",
    "queries": "(query )*",
    "query": "formula comment ",
}
ATTRIBUTES = {
    "location": {"id", "x", "y", "color"},
    "name": {"x", "y"},
    "label": {"kind", "x", "y"},
    "nail": {"x", "y"},
    "init": {"ref"},
    "source": {"ref"},
    "target": {"ref"},
}
KINDS = {
    "location": {"invariant", "comments"},
    "transition": {"select", "guard", "synchronisation", "assignment", "comments"},
}


def check_document(text: str) -> None:
    root = ElementTree.fromstring(text)
    assert root.tag == "nta"
    for element in root.iter():
        children = "".join(f"{child.tag} " for child in element)
        assert re.fullmatch(CONTENT.get(element.tag, ""), children), (element.tag, children)
        assert set(element.attrib) <= ATTRIBUTES.get(element.tag, set()), element.attrib
        if element.tag in KINDS:
            kinds = [label.get("kind") for label in element.findall("label")]
            assert set(kinds) <= KINDS[element.tag]
            assert len(set(kinds)) == len(kinds)
        for place in ("x", "y"):
            assert re.fullmatch(r"-?\d+", element.get(place, "0"))
    ids = [place.get("id") for place in root.iter("location")]
    assert len(set(ids)) == len(ids)
    for template in root.iter("template"):
        own = {place.get("id") for place in template.iter("location")}
        assert {end.get("ref") for tag in ("init", "source", "target") for end in template.iter(tag)} <= own
        names = [place.findtext("name") for place in template.iter("location")]
        assert len(set(names)) == len(names)
        assert all(re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII) for name in names)
        spots = [(place.get("x"), place.get("y")) for place in template.iter("location")]
        assert len(set(spots)) == len(spots)


@settings(max_examples=60, deadline=None)
@given(sdnfs())
def test_uppaals_document_is_valid(phi):
    check_document(export_all(timed_automata(phi), "uppaal"))


def test_uppaals_document_by_hand():
    text = SMALL.to("uppaal")
    assert text.startswith('<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE nta PUBLIC ')
    root = ElementTree.fromstring(text)
    assert root.findtext("declaration") == (
        "// Automaton: F[1,2] (3 <= x <= 4 & 3 <= y <= 5)\n"
        "// p1: 3 <= x <= 4 & 3 <= y <= 5\n"
        "bool p1;\n"
        "chan tick;\n"
        "// the letters that some state has: whether it is in p1, p2, ...\n"
        "const int LETTERS = 2;\n"
        "const bool LETTER[LETTERS][1] = {\n  { false },\n  { true }\n};"
    )
    assert root.findtext("system") == "system Environment, Automaton;"
    third = list(root.iter("template"))[1].findall("transition")[2]
    assert [(label.get("kind"), label.text) for label in third.findall("label")] == [
        ("guard", "p1 && c1 >= 1 && c1 <= 2"),
        ("synchronisation", "tick?"),
    ]
    assert [query.findtext("formula") for query in root.iter("query")] == [
        "E<> (Automaton.acc)",
        "E<> (Automaton.rej1)",
        "A<> (Automaton.acc || Automaton.rej1)",
        "A[] not deadlock",
    ]


def test_tcheckers_text_by_hand():
    assert build(one("FG", 1, 2, 3)).to("tchecker").splitlines() == [
        "# Automaton: F[1,2] G[0,3] (3 <= x <= 4 & 3 <= y <= 5)",
        "# p1: 3 <= x <= 4 & 3 <= y <= 5",
        "system:tickwise",
        "event:choose",
        "event:tick",
        "event:elapse",
        "int:1:0:1:0:p1",
        "process:Environment",
        "clock:1:t",
        "location:Environment:choose{initial: : committed:}",
        "location:Environment:read{committed:}",
        "location:Environment:wait{invariant: t<=1}",
        "edge:Environment:choose:read:choose{do: p1=0}",
        "edge:Environment:choose:read:choose{do: p1=1}",
        "edge:Environment:read:wait:tick{do: t=0}",
        "edge:Environment:wait:choose:elapse{provided: t==1}",
        "process:Automaton",
        "clock:1:c1",
        "clock:1:c2",
        "location:Automaton:q0{initial:}",
        "location:Automaton:q1{}",
        "location:Automaton:acc{labels: accepting}",
        "location:Automaton:rej1{labels: rejecting}",
        "edge:Automaton:q0:q0:tick{provided: p1==0 && c1<2}",
        "edge:Automaton:q0:q0:tick{provided: p1==1 && c1<1}",
        "edge:Automaton:q0:q1:tick{provided: p1==1 && c1>=1 : do: c2=0}",
        "edge:Automaton:q0:rej1:tick{provided: p1==0 && c1>=2}",
        "edge:Automaton:q1:q1:tick{provided: p1==1 && c2<3}",
        "edge:Automaton:q1:acc:tick{provided: p1==1 && c2>=3}",
        "edge:Automaton:q1:q0:tick{provided: p1==0 && c1<2}",
        "edge:Automaton:q1:rej1:tick{provided: p1==0 && c1>=2}",
        "edge:Automaton:acc:acc:tick{}",
        "edge:Automaton:rej1:rej1:tick{}",
        "sync:Environment@tick:Automaton@tick",
    ]


def test_a_complement_reads_the_same_region_the_other_way():
    (automaton,) = timed_automata(parse("F[0,1] (x >= 3) & G[2,3] !(x >= 3)"))
    system = network((automaton,))
    assert [str(region) for region in system.regions] == ["x >= 3"]
    assert system.components[0].literals == ((0, False), (0, True))
    assert "edge:Automaton:q1:rej2:tick{provided: p1==1 && c1>=2}" in automaton.to("tchecker").splitlines()


@pytest.mark.parametrize("name", ["init", "p1", "tick", "c1", "Environment", "event", "1q", "q 0", "é"])
def test_names_that_the_tools_cannot_have_are_replaced(name):
    renamed = replace(SMALL, locations=(name, "acc", "rej1"))
    text = renamed.to("uppaal")
    check_document(text)
    places = [
        place.findtext("name") for place in list(ElementTree.fromstring(text).iter("template"))[1].iter("location")
    ]
    assert places == ["q0", "q1", "q2"]
    assert "location:Automaton:q0{initial:}" in renamed.to("tchecker")


def test_hostile_names_do_no_harm():
    text = HOSTILE.to("uppaal")
    check_document(text)
    notes = [label.text for label in ElementTree.fromstring(text).iter("label") if label.get("kind") == "comments"]
    assert notes == ['a "b" \\', "<script>;end", "#|`x`| "]
    (wild,) = timed_automata(parse('F[0,1] ("*/ </nta>;\n p" > 1)'))
    check_document(wild.to("uppaal"))
    read_uppaal(wild.to("uppaal"))
    read_tchecker(wild.to("tchecker"))


def test_several_automata_of_one_formula():
    automata = timed_automata(parse("F[0,2] (x >= 3) | G[1,4] F[0,1] (x >= 3)"))
    root = ElementTree.fromstring(export_all(automata, "uppaal"))
    assert root.findtext("system") == "system Environment, Automaton1, Automaton2;"
    assert "bool p1;\nchan tick1, tick2;\n" in root.findtext("declaration")
    lines = export_all(automata, "tchecker").splitlines()
    assert "sync:Environment@tick:Automaton1@tick:Automaton2@tick" in lines
    assert "clock:1:c2_2" in lines
    assert "location:Automaton2:acc{labels: accepting2}" in lines


@pytest.mark.parametrize("format", FORMATS)
def test_every_format(format):
    automaton = build(CASE_STUDY)
    text = export(automaton, format)
    assert automaton.to(format) == text
    assert text.endswith("\n")
    assert text == export(automaton, format)
    together = export_all((automaton, automaton), format)
    assert together.count("digraph" if format == "dot" else "flowchart" if format == "mermaid" else "acc") >= 2
    assert together.endswith("\n")


def test_bad_requests():
    with pytest.raises(ConfigurationError, match=r"format 'pdf' is unknown; use one of dot, json, mermaid, tchecker"):
        SMALL.to("pdf")
    with pytest.raises(ConfigurationError, match="format 'pdf' is unknown"):
        export_all((SMALL,), "pdf")
    for format in TOGETHER:
        with pytest.raises(AutomatonError, match=r"no automata was asked for; give one or more"):
            export_all((), format)
    assert set(FORMATS) == {*ALONE, *TOGETHER}


def test_too_many_letters_are_refused():
    phi = parse(" & ".join(f"F[{2 * k},{2 * k + 1}] (x{k} > 0)" for k in range(13)))
    with pytest.raises(AutomatonError, match=r"meet in more than 4096 ways, .*; write fewer primitives, or choose dot"):
        timed_automata(phi)[0].to("uppaal")


def test_a_verdict_is_reached_within_the_horizon():
    """The query A<> holds of the case study, on random letters."""
    automaton = build(CASE_STUDY)
    system = read_uppaal(automaton.to("uppaal"))
    X = random_trajectories(3, 1, 45, 2)[0]
    simulation = Simulation(system)
    simulation.run(words((automaton,), X))
    assert simulation.places["Automaton"] in ("acc", "rej1", "rej2")
    assert automaton.verdict(X) is not Verdict.UNKNOWN
