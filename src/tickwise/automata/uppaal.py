"""Timed automata as a system for UPPAAL, in the XML that its editor reads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final
from xml.sax.saxutils import escape, quoteattr

from tickwise.automata.diagram import Point, Route, places, routes
from tickwise.automata.interchange import fill, layout
from tickwise.automata.model import Edge, TimedAutomaton
from tickwise.automata.network import Component, Network, network, plain

HEADER: Final = (
    '<?xml version="1.0" encoding="utf-8"?>\n'
    "<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD Flat System 1.1//EN' "
    "'http://www.it.uu.se/research/group/darts/uppaal/flat-1_2.dtd'>"
)

_LINE = 17
_Labels = Sequence[tuple[str, str]]
"""Pairs (kind, text), in the order in which UPPAAL's editor shows them."""


def to_uppaal(automata: Sequence[TimedAutomaton]) -> str:
    """Automata and their environment as a system for UPPAAL 4.0 and later, with queries.

    The environment sets a Boolean variable for each region at every unit of time from 0, and then every
    automaton takes an edge, by a channel of its own: clock guards on a broadcast channel's receivers would need a
    newer version. The system can be simulated and verified as it is.

    Args:
        automata: One automaton or more, which read the same letters.

    Returns:
        The document.

    Raises:
        AutomatonError: If the letters are too many; see `tickwise.automata.network.network`.
    """
    system = network(automata)
    processes = ", ".join(("Environment", *(_name(component) for component in system.components)))
    numbers = _Numbers()
    return "\n".join(
        (
            HEADER,
            "<nta>",
            _text("declaration", "\n".join(_declarations(system))),
            *_environment(system, numbers),
            *(line for component in system.components for line in _template(component, numbers)),
            _text("system", f"system {processes};"),
            *_queries(system),
            "</nta>\n",
        )
    )


class _Numbers:
    """Numbers for the locations of all templates: an id occurs once in a document."""

    def __init__(self) -> None:
        self.used = 0

    def take(self, count: int) -> list[str]:
        self.used += count
        return [f"id{number}" for number in range(self.used - count, self.used)]


def _name(component: Component) -> str:
    return f"Automaton{component.number}"


def _declarations(system: Network) -> Iterator[str]:
    count = len(system.regions)
    yield from (f"// {note}" for note in system.notes)
    yield f"bool {', '.join(f'p{number}' for number in range(1, count + 1))};"
    yield f"chan {', '.join(f'tick{component.number}' for component in system.components)};"
    rows = ",\n".join(f"  {{ {', '.join(str(holds).lower() for holds in letter)} }}" for letter in system.letters)
    yield "// the letters that some state has: whether it is in p1, p2, ..."
    yield f"const int LETTERS = {len(system.letters)};"
    yield f"const bool LETTER[LETTERS][{count}] = {{\n{rows}\n}};"


def _environment(system: Network, numbers: _Numbers) -> Iterator[str]:
    """Choose a letter, let every automaton read it, wait for a unit of time; the first is read at time 0."""
    names = ["choose", *(f"read{component.number}" for component in system.components), "wait"]
    ids = numbers.take(len(names))
    centres = [(204.0 * number, 0.0) for number in range(len(names))]
    yield from ("<template>", _text("name", "Environment"), _text("declaration", "clock t;"))
    for number, (name, where, identity) in enumerate(zip(names, centres, ids, strict=True)):
        waits = number == len(names) - 1
        label = [_label("invariant", "t <= 1", (where[0] - 20, where[1] + 29))] if waits else []
        yield from _location(identity, name, where, [*label, *([] if waits else ["<committed/>"])])
    yield f"<init ref={quoteattr(ids[0])}/>"
    updates = ", ".join(f"p{number + 1} = LETTER[k][{number}]" for number in range(len(system.regions)))
    steps: list[_Labels] = [[("select", "k : int[0, LETTERS - 1]"), ("assignment", updates)]]
    steps += [[("synchronisation", f"tick{component.number}!")] for component in system.components]
    steps[-1] = [*steps[-1], ("assignment", "t = 0")]
    for number, labels in enumerate(steps):
        corner = (centres[number][0] + 60, 17.0 if number == 0 else -17.0 * len(labels) - 4)
        yield from _transition(ids[number], ids[number + 1], labels, Route((), corner))
    last = centres[-1][0]
    back = Route(((last, -102.0), (0.0, -102.0)), (last / 2 - 20, -123.0))
    yield from _transition(ids[-1], ids[0], [("guard", "t == 1")], back)
    yield "</template>"


def _template(component: Component, numbers: _Numbers) -> Iterator[str]:
    automaton = component.automaton
    ids = numbers.take(len(component.locations))
    yield from ("<template>", _text("name", _name(component)))
    yield _text("declaration", f"clock {', '.join(component.clocks)};" if component.clocks else "")
    for location, (name, where) in enumerate(zip(component.locations, places(automaton), strict=True)):
        known = automaton.locations[location]
        notes = [] if name == known else [_label("comments", plain(known), (where[0] + 16, where[1] + 25))]
        yield from _location(ids[location], name, where, notes, fill(automaton, location), _aside(automaton, location))
    yield f"<init ref={quoteattr(ids[automaton.initial])}/>"
    labels = [_edge_labels(component, edge) for edge in automaton.edges]
    drawn = routes(automaton, [[text for _, text in each] for each in labels])
    for edge, texts, route in zip(automaton.edges, labels, drawn, strict=True):
        yield from _transition(ids[edge.source], ids[edge.target], texts, route)
    yield "</template>"


def _aside(automaton: TimedAutomaton, location: int) -> Point:
    """Where no edge of `routes` leaves a location as a rule: beside those below, above those above, else between."""
    row = layout(automaton)[location][1]
    return (16, -9) if row < 0 else (-10, -34) if row > 0 else (12, 8)


def _edge_labels(component: Component, edge: Edge) -> _Labels:
    guard = [f"{'' if holds else '!'}p{region + 1}" for region, holds in component.reads(edge)]
    guard += [f"{component.clocks[atom.clock]} {atom.comparison} {atom.value}" for atom in edge.guard]
    resets = ", ".join(f"{component.clocks[clock]} = 0" for clock in sorted(edge.resets))
    labels = [("guard", " && ".join(guard)), ("synchronisation", f"tick{component.number}?"), ("assignment", resets)]
    return [(kind, text) for kind, text in labels if text]


def _queries(system: Network) -> Iterator[str]:
    yield "<queries>"
    for component in system.components:
        automaton, name = component.automaton, _name(component)
        ends = {
            kind: " || ".join(f"{name}.{component.locations[location]}" for location in sorted(locations))
            for kind, locations in (("satisfied", automaton.accepting), ("violated", automaton.rejecting))
        }
        for kind, place in ends.items():
            if place:
                yield from _query(f"E<> ({place})", f"{name}'s conjunction can be {kind}")
        if all(ends.values()):
            yield from _query(f"A<> ({' || '.join(ends.values())})", f"{name} reaches a verdict on every run")
    yield from _query("A[] not deadlock", "at every tick some edge can be taken")
    yield "</queries>"


def _query(formula: str, comment: str) -> tuple[str, ...]:
    return "<query>", _text("formula", formula), _text("comment", comment), "</query>"


def _location(
    identity: str, name: str, where: Point, inner: Sequence[str], colour: str | None = None, aside: Point = (-14, 12)
) -> tuple[str, ...]:
    """A location, its name being so far from its centre."""
    shade = "" if colour is None else f" color={quoteattr(colour.lower())}"
    x, y = where
    return (
        f"<location id={quoteattr(identity)} {_at(where)}{shade}>",
        f"<name {_at((x + aside[0], y + aside[1]))}>{escape(name)}</name>",
        *inner,
        "</location>",
    )


def _transition(source: str, target: str, labels: _Labels, route: Route) -> tuple[str, ...]:
    x, y = route.label
    texts = (_label(kind, text, (x, y + _LINE * row)) for row, (kind, text) in enumerate(labels))
    nails = (f"<nail {_at(nail)}/>" for nail in route.nails)
    ends = f"<source ref={quoteattr(source)}/>", f"<target ref={quoteattr(target)}/>"
    return ("<transition>", *ends, *texts, *nails, "</transition>")


def _label(kind: str, text: str, where: Point) -> str:
    return f"<label kind={quoteattr(kind)} {_at(where)}>{escape(text)}</label>"


def _at(where: Point) -> str:
    return f'x="{round(where[0])}" y="{round(where[1])}"'


def _text(tag: str, text: str) -> str:
    return f"<{tag}>{escape(text)}</{tag}>"
