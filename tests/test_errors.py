from __future__ import annotations

import inspect

import pytest

from tickwise import errors
from tickwise.errors import TickwiseError

BUILTINS = {
    "FormulaError": ValueError,
    "ParseError": ValueError,
    "AutomatonError": ValueError,
    "DataError": ValueError,
    "UnknownVariableError": ValueError,
    "ConfigurationError": ValueError,
    "MissingFileError": FileNotFoundError,
    "FileAccessError": OSError,
    "StoreError": OSError,
    "NotTransferableError": RuntimeError,
    "MissingExtraError": ImportError,
    "ClusterError": ConnectionError,
}
"""The builtin that one would catch, for each error."""

CLASSES = {name: error for name, error in inspect.getmembers(errors, inspect.isclass) if error is not TickwiseError}


def test_every_error_is_listed():
    assert CLASSES.keys() == BUILTINS.keys()


@pytest.mark.parametrize("name", BUILTINS)
def test_an_error_is_both_ours_and_a_builtin(name: str):
    error = CLASSES[name]
    for caught in (TickwiseError, BUILTINS[name], Exception):
        with pytest.raises(caught, match="what was wrong"):
            raise error("what was wrong")
    assert str(error("what was wrong")) == "what was wrong"


@pytest.mark.parametrize("name", BUILTINS)
def test_every_error_says_when_it_is_raised(name: str):
    assert CLASSES[name].__doc__


def test_the_finer_errors_are_kinds_of_the_coarser():
    assert issubclass(errors.ParseError, errors.FormulaError)
    assert issubclass(errors.UnknownVariableError, errors.DataError)
