"""The directives ``automaton`` and ``drawing``: pictures that are drawn when the site is built."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("automaton", Automaton)
    app.add_directive("drawing", Drawing)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class _Picture(SphinxDirective):
    """What both directives share: an SVG file within the build, with a text in its place and a caption."""

    has_content = True
    required_arguments = 1
    final_argument_whitespace = True

    def picture(self, name: str, svg: str, alt: str) -> list[nodes.Node]:
        """A figure; the directive's content is its caption, and says what is seen."""
        folder = Path(self.env.app.doctreedir) / "drawn"
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{name}.svg"
        path.write_text(svg, encoding="utf-8")
        beside = Path(self.env.doc2path(self.env.docname)).parent
        image = nodes.image(uri=os.path.relpath(path, beside), alt=alt, classes=["drawn"])
        caption = nodes.caption("", "", *self.parse_inline(" ".join(self.content))[0])
        return [nodes.figure("", image, caption)]


class Automaton(_Picture):
    """The timed automaton of a formula, which is the argument."""

    def run(self) -> list[nodes.Node]:
        """The figure."""
        import tickwise
        from tickwise.experiments.figures import draw_automata

        phi = tickwise.parse(self.arguments[0])
        name = nodes.make_id(str(phi))
        return self.picture(name, draw_automata(tickwise.timed_automata(phi)), f"The timed automaton of {phi}")


class Drawing(_Picture):
    """A drawing of the module beside this one, by the name of its function, whose docstring describes the picture."""

    def run(self) -> list[nodes.Node]:
        """The figure."""
        import drawings

        self.env.note_dependency(str(drawings.__file__))
        draw = getattr(drawings, self.arguments[0], None)
        if draw is None or self.arguments[0] not in drawings.__all__:
            raise self.error(f"there is no drawing {self.arguments[0]!r}; use {', '.join(drawings.__all__)}")
        return self.picture(self.arguments[0], draw(), " ".join(draw.__doc__.split("\n\n")[1].split()))
