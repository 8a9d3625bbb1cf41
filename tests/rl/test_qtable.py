from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickwise.errors import ConfigurationError, DataError
from tickwise.rl.qtable import QTable

numbers = st.integers(-5, 5)
observations = st.one_of(
    numbers,
    st.tuples(numbers, numbers),
    st.lists(numbers, min_size=1, max_size=3).map(np.array),
    st.fixed_dictionaries({"a": numbers, "b": st.lists(numbers, min_size=2, max_size=2).map(np.array)}),
)


@given(st.lists(observations, max_size=60), st.integers(1, 3))
def test_it_is_a_dictionary_of_rows(met: list[Any], actions: int):
    """The twin keeps a row for each text of an observation."""
    table, twin = QTable(actions, 1.5), {}
    for count, observation in enumerate(met):
        # the order of a dictionary's entries is no part of an observation
        key = repr(sorted(observation.items()) if isinstance(observation, dict) else observation)
        assert (observation in table) == (key in twin)
        np.testing.assert_array_equal(table.look(observation), twin.get(key, np.full(actions, 1.5)))
        row = table.row(observation)
        row[count % actions] += count
        twin.setdefault(key, np.full(actions, 1.5))[count % actions] += count
        assert len(table) == len(twin)
    np.testing.assert_array_equal(table.values, np.array(list(twin.values())).reshape(-1, actions))


def test_rows_stay_as_the_table_grows():
    table = QTable(2)
    for number in range(1000):
        table.row(number)[:] = number, -number
    assert [table.look(number).tolist() for number in (0, 63, 64, 999)] == [[0, 0], [63, -63], [64, -64], [999, -999]]
    assert table.values.dtype == np.float32


def test_equal_observations_share_a_row_whatever_their_type():
    table = QTable(1)
    for same in (3, np.int64(3), np.array(3), 3.0):
        table.row(same)
    for same in (np.array([1, 2]), np.array([1.0, 2.0]), [1, 2]):
        table.row(same)
    for same in ({"a": 1, "b": 2}, {"b": np.int64(2), "a": np.array(1)}):
        table.row(same)
    for same in ("go", np.str_("go")):  # a text, such as a mission
        table.row(same)
    assert len(table) == 4
    table.row(np.array([[1, 2]]))  # another shape is another observation
    assert len(table) == 5


def test_a_function_gives_initial_values_once_for_each_observation():
    asked = []

    def initial(observation: int) -> list[float]:
        asked.append(observation)
        return [observation, 2 * observation]

    table = QTable(2, initial)
    for observation in (4, 5, 4):
        table.row(observation)
    assert asked == [4, 5]
    assert table.values.tolist() == [[4, 8], [5, 10]]
    assert table.look(6).tolist() == [6, 12]
    assert 6 not in table


def test_what_is_looked_at_is_a_copy():
    table = QTable(1)
    table.row(0)
    table.look(0)[0] = 7
    assert table.look(0).tolist() == [0]


@pytest.mark.parametrize("values", [[1.0], [1.0, 2.0, 3.0], [1.0, float("nan")], [[1.0, 2.0]]])
def test_initial_values_that_do_not_fit_are_refused_and_nothing_is_met(values: Any):
    table = QTable(2, lambda _: values)
    with pytest.raises(DataError, match="give 2 finite numbers"):
        table.row(0)
    assert len(table) == 0
    assert 0 not in table


def test_settings_that_do_not_fit_are_refused():
    with pytest.raises(ConfigurationError, match="0 actions; a table needs at least one"):
        QTable(0)
    with pytest.raises(ConfigurationError, match="initial Q-value is nan"):
        QTable(1, float("nan"))
