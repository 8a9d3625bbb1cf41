"""The directives ``paper-map``, ``paper-numbers`` and ``paper-lines``: where the paper is in the code, line by line.

The table of CONTRIBUTING.md and the docstrings and comments of the source are all that they read.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from docutils import nodes
from sources import ROOT, Citation, Place, citations, path_of, places, public_modules
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective
from tables import table

LOGGER = logging.getLogger(__name__)
CONTRIBUTING = ROOT / "CONTRIBUTING.md"

ITEMS = (
    *(f"Definition {number}" for number in range(1, 9)),
    *("Proposition 1", "Remark 1", "Problem 1", "Algorithm 1", "Algorithm 2", "Step 1", "Step 2", "Step 3"),
)
"""What the paper numbers."""

LINES = {"Algorithm 1": 16, "Algorithm 2": 14}
"""How many lines its algorithms have."""

_ROW = re.compile(r"^\| (.+?) \| `([\w/]+)\.py` \| (.+?) \|$", flags=re.MULTILINE)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("paper-map", PaperMap)
    app.add_directive("paper-numbers", PaperNumbers)
    app.add_directive("paper-lines", PaperLines)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def rows() -> list[tuple[str, list[Place]]]:
    """The rows of CONTRIBUTING's table: what of the paper, and where it is.

    Raises:
        LookupError: If a file or a name does not exist; the message names it and the row.
    """
    found = []
    for paper, file, names in _ROW.findall(CONTRIBUTING.read_text(encoding="utf-8")):
        module = f"tickwise.{file.replace('/', '.')}"
        try:
            known = places(module)
        except FileNotFoundError as error:
            raise LookupError(f"{error}, which CONTRIBUTING.md names for “{paper}”") from None
        wanted = re.findall(r"`([\w.]+)`", names)
        for name in wanted:
            if name not in known:
                raise LookupError(f"{module} has no {name}, which CONTRIBUTING.md names for “{paper}”")
        found.append((paper, [known[name] for name in wanted]))
    return found


def cited(item: str) -> list[Citation]:
    """All places in the source that cite a number of the paper, by module and line."""
    everything = (citation for module in public_modules("tickwise") for citation in citations(module))
    return sorted(
        (citation for citation in everything if citation.item == item),
        key=lambda citation: (citation.place.module, citation.place.line),
    )


def mapped(item: str) -> list[Place]:
    """The places of the rows that name a number of the paper."""
    kind, number = item.split()
    name = re.compile(rf"\b{kind}s? (?:(\d)(?: and (\d))?)")
    return [
        place
        for paper, where in rows()
        if any(number in match.groups() for match in name.finditer(paper))
        for place in where
    ]


def numbers(text: str) -> set[int]:
    """The lines that ``8-9, 11`` names; none for ``all``."""
    parts = (part.partition("-") for part in text.split(", ") if part != "all")
    return {line for first, _, last in parts for line in range(int(first), int(last or first) + 1)}


class _Linked(SphinxDirective):
    """What the directives share: links to lines of the source pages."""

    def note_sources(self) -> None:
        """Build the page anew where what it is made of has changed."""
        self.env.note_dependency(str(CONTRIBUTING))
        for module in public_modules("tickwise"):
            self.env.note_dependency(str(path_of(module)))

    def link(self, place: Place, *, comment: bool = False) -> nodes.Node:
        """The name and its line; a comment is within what is named."""
        page = self.env.app.builder.get_relative_uri(self.env.docname, place.page)
        name = place.name or place.module.rpartition(".")[2]
        where = f"{place.file}:{place.line}"
        reference = nodes.reference("", "", internal=True, refuri=f"{page}#L{place.line}", classes=["source-line"])
        reference += nodes.literal(name, name)
        reference += nodes.inline(where, where, classes=["source-place"])
        if comment:
            reference["classes"].append("source-comment")
        return reference

    def links(self, found: Iterable[Place]) -> nodes.bullet_list:
        """One link a line, each once."""
        items = (nodes.list_item("", nodes.paragraph("", "", self.link(place))) for place in dict.fromkeys(found))
        return nodes.bullet_list("", *items, classes=["source-lines"])


class PaperMap(_Linked):
    """The table of CONTRIBUTING.md with links, in the order of the paper."""

    def run(self) -> list[nodes.Node]:
        """The table."""
        self.note_sources()
        try:
            found = rows()
        except LookupError as error:
            raise self.error(str(error)) from None
        return [table(("Paper", "Code"), ((nodes.Text(paper), self.links(where)) for paper, where in found), (40, 60))]


class PaperNumbers(_Linked):
    """Each number of the paper, with what the map names for it and all docstrings that cite it."""

    def run(self) -> list[nodes.Node]:
        """The table."""
        self.note_sources()
        found = []
        for item in ITEMS:
            main = mapped(item)
            others = [citation.place for citation in cited(item) if not citation.lines]
            if not main and not others:
                LOGGER.warning("%s is nowhere in the code", item, location=self.get_location())
            named = {(place.module, place.name) for place in main}
            rest = [place for place in others if (place.module, place.name) not in named and place.name]
            found.append((nodes.Text(item), self.links(main), self.links(rest) if rest else nodes.Text("–")))
        return [table(("Paper", "Where it is", "Cited by"), found, (18, 38, 44))]


class PaperLines(_Linked):
    """The lines of an algorithm: its number is the argument, and a line of content is ``lines | what they do``.

    The row ``all`` shows what the map names for the algorithm as a whole. A row without code, and a line of the
    algorithm without a row, is a warning.
    """

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The table."""
        self.note_sources()
        item = f"Algorithm {self.arguments[0]}"
        found, told = [], set[int]()
        for row in self.content:
            lines, what = row.split(" | ")
            told |= numbers(lines)
            places_of = self._places(item, lines)
            if not places_of:
                LOGGER.warning("no code cites line %s of %s", lines, item, location=self.get_location())
            found.append((nodes.Text(lines.replace("-", "–")), nodes.Text(what), self.links(places_of)))
        if missing := set(range(1, LINES[item] + 1)) - told:
            LOGGER.warning("no row for lines %s of %s", sorted(missing), item, location=self.get_location())
        return [table(("Line", "What it does", "Code"), found, (10, 42, 48))]

    @staticmethod
    def _places(item: str, text: str) -> list[Place]:
        if text == "all":
            return [place for paper, where in rows() if paper.endswith(item) for place in where]
        return [citation.place for citation in cited(item) if citation.lines & numbers(text)]
