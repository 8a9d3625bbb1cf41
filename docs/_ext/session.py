"""The lexer ``console``: commands after ``$``, and what they print, which may begin with a parenthesis."""

from __future__ import annotations

from typing import Any, ClassVar

from pygments.lexer import RegexLexer, bygroups, using
from pygments.lexers.shell import BashLexer
from pygments.token import Generic, Text
from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the lexer in the place of Pygments' own, which takes ``(x >= 3) & …`` for the name of an environment."""
    app.add_lexer("console", Session)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class Session(RegexLexer):
    """A session in a shell."""

    name = "Session"
    tokens: ClassVar = {
        "root": [(r"(\$ )(.*\n)", bygroups(Generic.Prompt, using(BashLexer))), (r".*\n", Text)],
    }
