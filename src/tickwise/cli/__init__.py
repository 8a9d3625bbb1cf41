"""The command line: ``tickwise`` and ``python -m tickwise``. A module is a command, or a few that belong together."""

from tickwise.cli.app import app, main
from tickwise.cli.automaton import automaton
from tickwise.cli.check import check
from tickwise.cli.compare import compare
from tickwise.cli.doctor import doctor
from tickwise.cli.examples import described
from tickwise.cli.infer import infer
from tickwise.cli.library import library
from tickwise.cli.reproduce import effect, report, reproduce

for _each in (reproduce, infer, check, automaton, compare, report, effect):  # in the order of the help
    app.command(**described(_each))(_each)
app.add_typer(library, name="library")
app.command(**described(doctor))(doctor)

__all__ = ["app", "main"]
