"""Timed automata as Graphviz, Mermaid and JSON, and back from JSON; where to draw what."""

from __future__ import annotations

import json
from typing import Any, Final, TypeVar

from tickwise._wording import brief, listed, reason
from tickwise.automata.model import ClockConstraint, Edge, TimedAutomaton, condition
from tickwise.errors import AutomatonError, FormulaError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.logic.syntax import Box, Not, Predicate

STAGE_COLOURS: Final = ("#E69F00", "#56B4E9", "#F0E442", "#CC79A7", "#009E73")
"""The fill of each stage's working locations, in turn: Okabe and Ito's colours that carry black text."""

ACCEPTING_COLOUR: Final = "#FFFFFF"
REJECTING_COLOUR: Final = "#BBBBBB"

JSON_FORMAT: Final = "tickwise timed automaton"
JSON_VERSION: Final = 1

Kind = TypeVar("Kind")


def layout(automaton: TimedAutomaton) -> tuple[tuple[float, float], ...]:
    """Where to draw each location: a column for each stage, from left to right.

    A stage's first working location is on the line y = 0, further ones are above, its rejecting location is
    below; accepting locations follow to the right of the last stage.

    Args:
        automaton: The timed automaton.

    Returns:
        For each location its (x, y), in units of a column's width; no two are equal.
    """
    heights: dict[tuple[int, int], int] = {}
    places = []
    for location, stage in enumerate(automaton.stages):
        rejecting, accepting = location in automaton.rejecting, location in automaton.accepting
        column, step = (len(automaton.predicates) if accepting else stage), (-1 if rejecting else 1)
        height = heights.get((column, step), -1 if rejecting else 0)
        heights[column, step] = height + step
        places.append((float(column), float(height)))
    return tuple(places)


def fill(automaton: TimedAutomaton, location: int) -> str:
    """A location's colour as ``#RRGGBB``; black text on it is readable."""
    if location in automaton.accepting:
        return ACCEPTING_COLOUR
    if location in automaton.rejecting:
        return REJECTING_COLOUR
    return STAGE_COLOURS[automaton.stages[location] % len(STAGE_COLOURS)]


def label(automaton: TimedAutomaton, edge: Edge) -> str:
    """An edge's letters, guard and resets, for instance ``ρ1, c1 >= 1 / c2 := 0``."""
    resets = ", ".join(f"{automaton.clocks[clock]} := 0" for clock in sorted(edge.resets))
    return condition(automaton, edge) + (f" / {resets}" if resets else "")


def arrows(automaton: TimedAutomaton) -> dict[tuple[int, int], list[str]]:
    """The labels of all edges from one location to another, which are drawn as one arrow with a line for each."""
    found: dict[tuple[int, int], list[str]] = {}
    for edge in automaton.edges:
        found.setdefault((edge.source, edge.target), []).append(label(automaton, edge))
    return found


def legend(automaton: TimedAutomaton) -> tuple[str, ...]:
    """The predicates, one line each, for instance ``ρ1: x >= 3``."""
    return tuple(f"ρ{index + 1}: {predicate}" for index, predicate in enumerate(automaton.predicates))


def to_dot(automaton: TimedAutomaton) -> str:
    """Graphviz's language: left to right, accepting locations with a double circle, stages told by colour."""
    lines = [
        "digraph automaton {",
        "  rankdir=LR;",
        f"  label={_dot_text(str(automaton.conjunction))};",
        '  node [shape=circle, style=filled, fontname="Helvetica"];',
        '  edge [fontname="Helvetica", fontsize=11];',
        "  start [shape=point];",
    ]
    for location, name in enumerate(automaton.locations):
        shape = "doublecircle" if location in automaton.accepting else "circle"
        colour = fill(automaton, location)
        lines.append(f'  n{location} [label={_dot_text(name)}, shape={shape}, fillcolor="{colour}"];')
    lines.append(f"  start -> n{automaton.initial};")
    for (source, target), labels in arrows(automaton).items():
        lines.append(f"  n{source} -> n{target} [label={_dot_text(chr(10).join(labels))}];")
    # "\l" ends a line and aligns it to the left
    rows = "".join(_dot_text(row)[1:-1] + "\\l" for row in legend(automaton))
    lines += [f'  legend [shape=note, fillcolor="#FFFFFF", label="{rows}"];', "}"]
    return "\n".join(lines) + "\n"


def to_mermaid(automaton: TimedAutomaton) -> str:
    """Mermaid's flowchart, which renders in Markdown pages; locations look as in `to_dot`."""
    lines = ["flowchart LR", "  start(( ))"]
    for location, name in enumerate(automaton.locations):
        opening, closing = ("(((", ")))") if location in automaton.accepting else ("((", "))")
        lines.append(f"  n{location}{opening}{_mermaid_text(name)}{closing}")
    lines.append(f"  start --> n{automaton.initial}")
    for (source, target), labels in arrows(automaton).items():
        text = "<br>".join(_mermaid_text(each)[1:-1] for each in labels)
        lines.append(f'  n{source} -->|"{text}"| n{target}')
    rows = "<br>".join(_mermaid_text(row)[1:-1] for row in legend(automaton))
    lines.append(f'  legend["{rows}"]')
    lines += [
        f"  style n{location} fill:{fill(automaton, location)},stroke:#000000,color:#000000"
        for location in range(len(automaton.locations))
    ]
    return "\n".join(lines) + "\n"


def to_json(automaton: TimedAutomaton) -> str:
    """A JSON document that `from_json` reads back to an equal automaton; formulas are text for `parse`."""
    accepting, rejecting = automaton.accepting, automaton.rejecting
    names, clocks = automaton.locations, automaton.clocks
    document = {
        "format": JSON_FORMAT,
        "version": JSON_VERSION,
        "formula": str(automaton.conjunction),
        "predicates": [str(predicate) for predicate in automaton.predicates],
        "clocks": list(clocks),
        "locations": [
            {
                "name": name,
                "kind": "accepting" if q in accepting else "rejecting" if q in rejecting else "working",
                "stage": automaton.stages[q],
                "active": [clocks[clock] for clock in sorted(automaton.active[q])],
            }
            for q, name in enumerate(names)
        ],
        "initial": names[automaton.initial],
        "edges": [
            {
                "source": names[edge.source],
                "literals": [list(literal) for literal in edge.literals],
                "guard": [[clocks[atom.clock], atom.comparison, atom.value] for atom in edge.guard],
                "resets": [clocks[clock] for clock in sorted(edge.resets)],
                "target": names[edge.target],
            }
            for edge in automaton.edges
        ],
    }
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def from_json(text: str) -> TimedAutomaton:
    """Read what `to_json` wrote.

    Args:
        text: The JSON document.

    Returns:
        The automaton, validated.

    Raises:
        AutomatonError: If it is no JSON, has another format or version, or describes no timed automaton.
    """
    try:
        document = json.loads(text)
    except (TypeError, ValueError, RecursionError) as error:
        raise AutomatonError(f"not a JSON document: {reason(error)}; write one with to_json") from None
    format, version = _field(document, "format", str), _field(document, "version", int)
    if (format, version) != (JSON_FORMAT, JSON_VERSION):
        raise AutomatonError(
            f"format {brief(format)} version {brief(version)} cannot be read; "
            f"give {JSON_FORMAT!r} version {JSON_VERSION}"
        )
    try:
        return _automaton(document)
    except AutomatonError as error:  # names of locations and clocks may have any signs
        raise AutomatonError(" ".join(str(error).splitlines())) from None
    except FormulaError as error:
        raise AutomatonError(f"a formula in the JSON cannot be read: {reason(error)}") from None


def _automaton(document: Any) -> TimedAutomaton:
    disjuncts = to_sdnf(parse(_field(document, "formula", str))).disjuncts
    if len(disjuncts) != 1:
        raise AutomatonError(f"the JSON's formula has {len(disjuncts)} disjuncts; an automaton decides one")
    clocks = tuple(_name(name, "a clock") for name in _field(document, "clocks", list))
    places = _field(document, "locations", list)
    names = tuple(_name(_field(place, "name", str), "a location") for place in places)
    kinds = [_field(place, "kind", str) for place in places]
    for kind in kinds:
        _index(kind, ("working", "accepting", "rejecting"), "kind of location")
    return TimedAutomaton(
        predicates=tuple(_predicate(item) for item in _field(document, "predicates", list)),
        locations=names,
        initial=_index(_field(document, "initial", str), names, "location"),
        clocks=clocks,
        accepting=frozenset(q for q, kind in enumerate(kinds) if kind == "accepting"),
        rejecting=frozenset(q for q, kind in enumerate(kinds) if kind == "rejecting"),
        edges=tuple(_edge(edge, names, clocks) for edge in _field(document, "edges", list)),
        stages=tuple(_field(place, "stage", int) for place in places),
        active=tuple(_clock_set(_field(place, "active", list), clocks) for place in places),
        conjunction=disjuncts[0],
    )


def _predicate(item: object) -> Predicate:
    predicate = parse(_typed(item, str, "a predicate"))
    if not isinstance(predicate, Box | Not):
        raise AutomatonError(f"the JSON's {predicate} is no predicate; give a box or its complement")
    return predicate


def _edge(record: Any, names: tuple[str, ...], clocks: tuple[str, ...]) -> Edge:
    guard = []
    for atom in _field(record, "guard", list):
        clock, comparison, value = _row(atom, (str, str, int), "a clock constraint")
        guard.append(ClockConstraint(_index(clock, clocks, "clock"), comparison, value))
    literals = [_row(literal, (int, bool), "a literal") for literal in _field(record, "literals", list)]
    return Edge(
        source=_index(_field(record, "source", str), names, "location"),
        literals=tuple((predicate, holds) for predicate, holds in literals),
        target=_index(_field(record, "target", str), names, "location"),
        guard=tuple(guard),
        resets=_clock_set(_field(record, "resets", list), clocks),
    )


def _clock_set(items: list[Any], clocks: tuple[str, ...]) -> frozenset[int]:
    return frozenset(_index(item, clocks, "clock") for item in items)


def _typed(value: object, kind: type[Kind], what: str) -> Kind:
    # a JSON true is no number, though Python's True is an int
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
        raise AutomatonError(f"{what} in the JSON is {brief(value)}; give a value of type {kind.__name__}")
    return value


def _name(value: object, what: str) -> str:
    name = _typed(value, str, what)
    if len(name) > 100:
        raise AutomatonError(f"the name {brief(name)} of {what} has {len(name)} characters; use 100 at the most")
    return name


def _field(record: object, key: str, kind: type[Kind]) -> Kind:
    if not isinstance(record, dict) or key not in record:
        raise AutomatonError(f"the JSON lacks {key!r}; write it with to_json")
    return _typed(record[key], kind, repr(key))


def _row(item: object, kinds: tuple[type[Any], ...], what: str) -> tuple[Any, ...]:
    row = _typed(item, list, what)
    if len(row) != len(kinds):
        raise AutomatonError(f"{what} in the JSON has {len(row)} entries; give {len(kinds)}")
    return tuple(_typed(value, kind, what) for value, kind in zip(row, kinds, strict=True))


def _index(name: object, names: tuple[str, ...], what: str) -> int:
    if name not in names:
        raise AutomatonError(f"the {what} {brief(name)} in the JSON is unknown; use one of {listed(names)}")
    return names.index(_typed(name, str, f"a {what}"))


def _dot_text(text: str) -> str:
    """A quoted string of Graphviz's language."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def _mermaid_text(text: str) -> str:
    """A quoted string of Mermaid's language; what could be read as markup is written as character codes."""
    escaped = "".join(f"#{ord(sign)};" if sign in '"#&;<>`\\*_|\n' else sign for sign in text)
    return f'"{escaped}"'
