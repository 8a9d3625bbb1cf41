"""A page: one self-contained HTML file with its style, its scripts and its data, which loads nothing."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from tickwise.experiments.verdict import count

_SCRIPTS = ("elements.js", "automaton.js", "world.js", "timeline.js", "drive.js", "player.js", "curves.js")
"""The scripts in their order: later ones use earlier ones."""


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a page, such as one study.

    Attributes:
        key: Its anchor.
        title: What it is.
        verdict: What was found, in sentences.
        links: Anchors and labels of its sections.
        body: The sections as HTML.
        headline: The most important of it in one sentence, for the head of a page with several parts.
        interactive: Whether it has something that needs the scripts.
    """

    key: str
    title: str
    verdict: Sequence[str]
    links: Sequence[tuple[str, str]]
    body: Markup
    headline: str = ""
    interactive: bool = False


def render_page(
    title: str, verdict: Sequence[str], parts: Sequence[Part], environment: Mapping[str, Any], *, seed: int
) -> str:
    """A page as HTML with everything in it: style, scripts and figures inline, nothing from a network.

    Args:
        title: The title.
        verdict: What was found, in sentences.
        parts: The parts; a single one gets no heading of its own.
        environment: Command, versions and costs.
        seed: The root seed.

    Returns:
        The page. All text from data is escaped; the same input gives the same page. Its policy for content lets a
        browser use the style and the scripts of this package only, and load nothing.
    """
    style = _asset("report.css")
    script = "(() => {\n" + "\n".join(map(_asset, _SCRIPTS)) + "})();\n" if any(x.interactive for x in parts) else ""
    page = template("page").render(
        title=title, verdict=verdict, parts=parts, environment=_environment_rows(environment), seed=seed,
        version=environment["version"], command=environment["command"],
        style=Markup(style), script=Markup(script), policy=_policy(style, script),
    )  # fmt: skip
    return page.rstrip() + "\n"


def template(name: str) -> Template:
    """A template of this package; it escapes what it is given."""
    environment = Environment(
        loader=PackageLoader("tickwise.experiments"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["count"] = count
    return environment.get_template(f"{name}.html.j2")


def inline_svg(name: str, svg: str) -> Markup:
    """An SVG document as an element of a page.

    Its identifiers get the figure's name in front, since those of several figures would clash; its size is left to
    the page, and comments are dropped. Styles become attributes, which the page's policy for content lets pass.
    """
    body = re.sub(r"<!--.*?-->", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    body = re.sub(r"<style.*?</style>", "", body, flags=re.DOTALL)
    body = re.sub(r'\sstyle="([^"]*)"', _attributes, body)
    body = re.sub(r'\bid="', f'id="{name}-', body)
    body = re.sub(r'href="#', f'href="#{name}-', body)
    body = re.sub(r"url\(#", f"url(#{name}-", body)
    opening, rest = body.split(">", 1)
    opening = re.sub(r'\s(width|height)="[^"]*"', "", opening) + f' role="img" aria-labelledby="{name}-caption"'
    opening += ' stroke-linejoin="round" stroke-linecap="butt"'  # what Matplotlib's own style says of every element
    return Markup(f"{opening}>{rest.strip()}")


def _attributes(style: re.Match[str]) -> str:
    """Declarations such as ``fill: none; stroke: #000`` as attributes of an SVG element."""
    pairs = (declaration.split(":", 1) for declaration in style[1].split(";") if declaration.strip())
    return "".join(f' {name.strip()}="{value.strip()}"' for name, value in pairs)


def json_island(data: Any) -> Markup:
    """Plain data as JSON within a script element: no text in it can end the element or begin a comment."""
    return htmlsafe_json_dumps(data, ensure_ascii=False, separators=(",", ":"))


@cache
def _asset(name: str) -> str:
    return files("tickwise.experiments").joinpath("assets", name).read_text(encoding="utf-8")


def _policy(style: str, script: str) -> str:
    """The Content-Security-Policy of a page: its own style and script by their hashes, and nothing else."""
    sources = {"style-src": style, "script-src": script}
    allowed = "".join(f"; {name} '{_digest(text)}'" for name, text in sources.items() if text)
    return f"default-src 'none'{allowed}; base-uri 'none'; form-action 'none'"


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _environment_rows(environment: Mapping[str, Any]) -> list[tuple[str, str]]:
    names = {
        "version": "Tickwise", "python": "Python", "cores": "processor cores", "workers": "worker processes",
        "seconds": "wall-clock time in seconds", "job_seconds": "time of all jobs together in seconds",
        "peak_memory_mib": "peak memory in MiB",
    }  # fmt: skip
    rows = [(names.get(key, key), value) for key, value in environment.items() if key != "command"]
    return [(name, f"{value:,}" if isinstance(value, int | float) else str(value)) for name, value in rows]
