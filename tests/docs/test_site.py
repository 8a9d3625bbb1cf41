"""The site builds without a warning, its links lead somewhere, and no page takes anything from the network."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

pytest.importorskip("sphinx", reason="Sphinx is not installed; the documentation cannot be built")
pytest.importorskip("furo", reason="Furo, the documentation's theme, is not installed")
pytest.importorskip("myst_parser", reason="MyST, which reads the documentation's Markdown, is not installed")

pytestmark = pytest.mark.slow  # a build takes half a minute

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", str(folder / "trees")]
    built = subprocess.run(
        [*command, str(ROOT / "docs"), str(folder / "html")],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
        check=False,
    )
    assert built.returncode == 0, built.stderr
    return folder / "html"


class _Page(HTMLParser):
    """What a page has to link to, and what it links to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.parts: list[str] = []
        self.images_without_text: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.anchors |= {values[name] for name in ("id", "name") if name in values}
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        elif tag == "link" and values.get("rel") in ("stylesheet", "icon", "preload", "preconnect", "manifest"):
            self.parts.append(values["href"])
        elif tag in ("img", "script", "source", "iframe", "object") and (
            found := values.get("src", values.get("data"))
        ):
            self.parts.append(found)
        if tag == "img" and not values.get("alt"):
            self.images_without_text.append(values["src"])


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, _Page]:
    return {path: _Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}


def _targets(pages: dict[Path, _Page]) -> Iterator[tuple[Path, Path, str, str]]:
    """Each internal link: the page, the file that it leads to, the anchor within, and the link as it is written."""
    for path, page in pages.items():
        for link in (*page.links, *page.parts):
            parts = urlsplit(link)
            if not parts.scheme and not parts.netloc:
                target = (path.parent / unquote(parts.path)).resolve() if parts.path else path.resolve()
                yield path, target, unquote(parts.fragment), link


def test_internal_links_lead_somewhere(site: Path, pages: dict[Path, _Page]):
    anchors = {path.resolve(): page.anchors for path, page in pages.items()}
    broken = [
        (str(path.relative_to(site)), link)
        for path, target, fragment, link in _targets(pages)
        if not target.is_file() or (fragment and target.suffix == ".html" and fragment not in anchors[target])
    ]
    assert not broken


def test_nothing_is_taken_from_the_network(site: Path, pages: dict[Path, _Page]):
    for path, page in pages.items():
        assert not [part for part in page.parts if urlsplit(part).netloc], path
    for style in site.rglob("*.css"):
        text = style.read_text(encoding="utf-8")
        assert "@import" not in text
        assert "url(http" not in text.replace("url(http://www.w3.org", "").replace('"', "")


def test_images_have_a_text_in_their_place(pages: dict[Path, _Page]):
    assert {path.name: page.images_without_text for path, page in pages.items() if page.images_without_text} == {}


def test_nobody_is_asked_to_edit(pages: dict[Path, _Page]):
    for path, page in pages.items():
        assert not [link for link in page.links if "/edit/" in link or "_sources" in link], path


def test_every_public_name_has_its_entry(pages: dict[Path, _Page]):
    import tickwise

    anchors = {anchor for path, page in pages.items() if "api" in path.parts for anchor in page.anchors}
    for name in tickwise.__all__:
        value = getattr(tickwise, name)
        assert f"{value.__module__}.{value.__qualname__}" in anchors


def test_every_command_has_its_section(site: Path, pages: dict[Path, _Page]):
    commands = pages[site / "reference" / "commands.html"].anchors
    wanted = ("reproduce", "infer", "check", "automaton", "compare", "report", "effect", "library", "library-rank")
    assert {f"tickwise-{name}" for name in wanted} <= commands
