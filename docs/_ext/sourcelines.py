"""Give every line of the source pages an anchor, so that a page can link to ``_modules/….html#L57``."""

from __future__ import annotations

from itertools import count
from typing import Any

from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension."""
    app.connect("html-page-context", _anchor_lines)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _anchor_lines(app: Sphinx, pagename: str, template: str, context: dict[str, Any], doctree: object) -> None:
    del app, template, doctree
    if pagename.startswith("_modules/") and "<pre>" in context.get("body", ""):
        before, source = context["body"].split("<pre>", 1)
        context["body"] = f"{before}<pre>{with_anchors(source)}"


def with_anchors(source: str) -> str:
    """Highlighted source, each line of which begins with an anchor L1, L2, …; the page's end gets none."""
    listing, end = source.split("</pre>", 1)
    numbers = count(1)
    lines = [f'<span id="L{next(numbers)}"></span>{line}' for line in listing.split("\n")]
    return "\n".join(lines) + "</pre>" + end
