"""A page: what its policy for content lets pass, and how figures and data come into it."""

from __future__ import annotations

import base64
import hashlib
import json
import re

import pytest
from markupsafe import Markup

from tickwise.experiments.page import Part, inline_svg, json_island, render_page

ENVIRONMENT = {"version": "1.2.3", "command": "tickwise reproduce x", "workers": 2}
SVG = (
    '<?xml version="1.0"?><!DOCTYPE svg><!-- made -->\n<svg width="9pt" height="5pt" viewBox="0 0 9 5" '
    'xmlns="http://www.w3.org/2000/svg"><defs><path id="p"/><clipPath id="c"/></defs><!-- text -->'
    '<use xlink:href="#p" xmlns:xlink="http://www.w3.org/1999/xlink"/><g clip-path="url(#c)"/></svg>\n'
)


def page(*, interactive: bool) -> str:
    part = Part("x", "X", ["Found."], [], Markup("<p>body</p>"), interactive=interactive)
    return render_page("Title", [], [part], ENVIRONMENT, seed=0)


def digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


@pytest.mark.parametrize("interactive", [True, False])
def test_only_the_pages_own_style_and_script_pass(interactive: bool):
    html = page(interactive=interactive)
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', html)
    rules = dict(rule.split(" ", 1) for rule in policy.replace("&#39;", "'").split("; "))
    (style,) = re.findall(r"<style>(.*?)</style>", html, re.DOTALL)
    wanted = {
        "default-src": "'none'", "base-uri": "'none'", "form-action": "'none'",
        "style-src": f"'{digest(style)}'",
    }  # fmt: skip
    scripts = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    assert len(scripts) == interactive
    if interactive:
        wanted["script-src"] = f"'{digest(scripts[0])}'"
    assert rules == wanted
    assert "\r" not in html  # a browser would hash another text


def test_no_program_asks_for_anything_or_makes_markup_of_text():
    (script,) = re.findall(r"<script>(.*?)</script>", page(interactive=True), re.DOTALL)
    for word in ("http:", "https:", "fetch(", "XMLHttpRequest", "innerHTML", "insertAdjacentHTML", "eval(", "import("):
        assert word not in script.replace("http://www.w3.org/2000/svg", ""), word


def test_an_inline_figure_keeps_its_references_apart_from_others():
    svg = inline_svg("maps", SVG)
    assert svg.startswith("<svg")
    assert 'role="img" aria-labelledby="maps-caption"' in svg
    assert 'id="maps-p"' in svg
    assert 'xlink:href="#maps-p"' in svg
    assert "url(#maps-c)" in svg
    assert "width=" not in svg
    assert "<!--" not in svg


def test_styles_in_a_figure_become_attributes():
    svg = inline_svg(
        "a", '<svg><defs><style type="text/css">*{x: y}</style></defs><g style="fill: none; stroke: #0b1c2d"/></svg>'
    )
    assert '<g fill="none" stroke="#0b1c2d"/>' in svg
    assert "style" not in svg


def test_data_cannot_end_their_element():
    data = {"<!--": "</script><script>alert('&')</script>", "list": [1, 2.5, None, True]}
    text = str(json_island(data))
    assert "<" not in text
    assert json.loads(text) == data
