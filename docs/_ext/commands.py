"""The directive ``command-line``: every command of an application, with its arguments and options, from the code."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import typer
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from tables import table


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("command-line", CommandLine)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class CommandLine(SphinxDirective):
    """A section for each command of a typer application, given as ``module:name``."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The sections, in the order of the help."""
        module, name = self.arguments[0].split(":")
        self.env.note_dependency(str(import_module(module).__file__))
        group: Any = typer.main.get_command(getattr(import_module(module), name))
        return list(self._sections(group))

    def _sections(self, group: Any) -> Iterator[nodes.section]:
        """A section for each command, and, after that of a group of commands, for each in it."""
        for command in group.commands.values():
            yield self._section(group.name, command)
            if hasattr(command, "commands"):
                yield from (self._section(f"{group.name} {command.name}", each) for each in command.commands.values())

    def _section(self, program: str, command: Any) -> nodes.section:
        title = f"{program} {command.name}"
        section = nodes.section(ids=[nodes.make_id(title)], names=[nodes.fully_normalize_name(title)])
        self.state.document.note_explicit_target(section)
        section += nodes.title("", "", nodes.literal(title, title))
        section += nodes.paragraph("", "", *_text(" ".join((command.help or "").split())))
        context = command.make_context(command.name, [], resilient_parsing=True)
        usage = " ".join((title, *command.collect_usage_pieces(context)))
        section += nodes.literal_block(usage, usage, language="text")
        for kind, heading in (("argument", "Argument"), ("option", "Option")):
            records = [each.get_help_record(context) for each in command.params if each.param_type_name == kind]
            rows = [self._row(*record) for record in records if record is not None]
            if rows:
                section += table((heading, "Meaning", "Default and limits"), rows, (26, 54, 20))
        # the help ends with a mark, a heading and an example a line
        if examples := [line.strip() for line in (command.epilog or "").splitlines()[2:]]:
            text = "\n".join(examples)
            section += [nodes.paragraph("", "For example:"), nodes.literal_block(text, text, language="sh")]
        return section

    @staticmethod
    def _row(form: str, text: str) -> tuple[nodes.Node, ...]:
        """The form, the meaning, and the default with the limits, which a help text has in brackets at its end."""
        found = re.fullmatch(r"(.*?)(?:  \[(.*)\])?", text, flags=re.DOTALL)
        assert found is not None
        otherwise = (found.group(2) or "").replace("default: ", "").replace("; ", ", ").replace("x>=", "at least ")
        return nodes.literal(form, form), nodes.paragraph("", "", *_text(found.group(1))), nodes.Text(otherwise)


def _text(text: str) -> list[nodes.Node]:
    """Text whose options and quotations stay as one has to type them."""
    parts = re.split(r"(--[\w-]+|'[^']+'(?!\w))", text)
    return [
        nodes.literal(part, part.strip("'")) if number % 2 else nodes.Text(part) for number, part in enumerate(parts)
    ]
