from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.experiments.test_store import no_room
from tests.library.learned import REACH, STAY, learned
from tickwise._archives import npz_arrays, npz_bytes
from tickwise.automata.interchange import from_json
from tickwise.automata.ticks import compile_table
from tickwise.errors import ConfigurationError, DataError, MissingFileError, StoreError, TickwiseError
from tickwise.library.entry import Entry, centroids
from tickwise.library.entry_files import entry_paths, read_entry, read_manifest, write_entry
from tickwise.library.worlds import ARRAYS, read_world, world_arrays, world_of, write_world
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf


def same(ours: Entry, theirs: Entry) -> bool:
    arrays = (
        (ours.q, theirs.q),
        *zip(ours.landmarks, theirs.landmarks, strict=True),
        *((getattr(ours.mdp, name), getattr(theirs.mdp, name)) for name in ARRAYS),
    )
    plain = ("name", "formula", "horizon", "disjunct", "facts", "provenance")
    return all(np.array_equal(a, b) for a, b in arrays) and all(
        getattr(ours, name) == getattr(theirs, name) for name in plain
    )


# ---------------------------------------------------------------- entries


def test_landmarks_are_the_regions_centroids_by_hand():
    # [0,1] × [0,2] and [3,4] × [2,4]; a side that is open ends with the world, of 4 × 4 cells
    (found,) = learned().landmarks
    np.testing.assert_array_equal(found, [[0.5, 1.0], [3.5, 3.0]])
    (open_side,) = centroids(to_sdnf(parse("G[0,3] (x >= 1)")), learned().mdp)
    np.testing.assert_array_equal(open_side, [[2.5, 2.0]])


def test_an_entry_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        learned().q[0] = 0
    with pytest.raises(ValueError, match="read-only"):
        learned().landmarks[0][0] = 0


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"name": ""}, ConfigurationError, "the name '' is no name of an entry; use up to 64 letters"),
        ({"name": "../up"}, ConfigurationError, "is no name of an entry"),
        ({"name": "a" * 65}, ConfigurationError, "is no name of an entry"),
        ({"name": ".hidden"}, ConfigurationError, "is no name of an entry"),
        ({"name": "ends."}, ConfigurationError, "is no name of an entry"),
        ({"name": "two words"}, ConfigurationError, "is no name of an entry"),
        ({"name": "line\n"}, ConfigurationError, "is no name of an entry"),
        ({"horizon": 0}, ConfigurationError, "the horizon of reach is 0; use ticks, 1 or more"),
        ({"horizon": 1.5}, ConfigurationError, "the horizon of reach is 1.5"),
        ({"horizon": 100_000}, ConfigurationError, "horizon 100000 is out of range"),
        ({"disjunct": "best"}, ConfigurationError, "there is no choice of the disjunct 'best'"),
        ({"formula": to_sdnf(parse("F[0,3] (z > 1)"))}, DataError, "names z, which the world does not have; it has x"),
        ({"q": np.zeros((2, 3))}, DataError, r"is of shape \(2, 3\) and type float64; .* need numbers of shape"),
        ({"q": learned().q.astype(str)}, DataError, "need numbers of shape"),
        ({"q": learned().q + np.nan}, DataError, "has a value that is not finite"),
        ({"q": learned().q.astype(float) * 1e300}, DataError, "has a value that is not finite"),
        ({"landmarks": (np.zeros((1, 2)),)}, DataError, "the landmarks of reach do not fit"),
        ({"landmarks": (np.full((2, 2), np.inf),)}, DataError, "the landmarks of reach do not fit"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, Any], error: type[TickwiseError], message: str):
    with pytest.raises(error, match=message) as caught:
        replace(learned(), **changes)
    assert "\n" not in str(caught.value)


# ---------------------------------------------------------------- files


@pytest.mark.parametrize("text", [REACH, STAY, f"({REACH}) | {STAY}", "G[0,8] F[0,3] !(x <= 2)"])
def test_an_entry_comes_back(tmp_path: Path, text: str):
    entry = learned(text=text, episodes=100)
    paths = write_entry(tmp_path / "one.npz", entry)
    assert paths == entry_paths(tmp_path / "one.json") == (tmp_path / "one.npz", tmp_path / "one.json")
    for path in paths:
        assert same(read_entry(path), entry)
    before = [path.read_bytes() for path in paths]
    write_entry(tmp_path / "one.npz", entry)
    assert [path.read_bytes() for path in paths] == before


def test_the_files_say_what_the_rows_of_q_are(tmp_path: Path):
    """Whoever has no Tickwise of this version finds the automaton, and its states in the order of the rows."""
    entry = learned()
    arrays_path, manifest_path = write_entry(tmp_path / "one.npz", entry)
    arrays, manifest = npz_arrays(arrays_path.read_bytes()), json.loads(manifest_path.read_text("utf-8"))
    (document,) = manifest["automata"]
    table = compile_table(from_json(json.dumps(document)), manifest["horizon"])
    assert len(table) == len(arrays["q"]) == len(arrays["location_0"])
    np.testing.assert_array_equal(table.delta, arrays["delta_0"])
    assert manifest["formula"] == REACH
    assert manifest["facts"] == {"rate": 1.0, "size": 2}
    assert manifest["provenance"] == {"episodes": 20_000}


def test_a_change_of_either_file_is_noticed(tmp_path: Path):
    entry = learned(episodes=100)
    arrays, manifest = write_entry(tmp_path / "one.npz", entry)
    whole = arrays.read_bytes(), manifest.read_bytes()
    q = npz_arrays(whole[0])
    q["q"][3, 0, 0] += 1
    flipped = bytearray(whole[0])
    flipped[len(flipped) // 2] ^= 0x10
    for content in (b"", b"text", whole[0][:-1], bytes(flipped), npz_bytes(q)):
        arrays.write_bytes(content)
        with pytest.raises(StoreError, match=r"one\.json is damaged \(its checksum .*\); remove it and add"):
            read_entry(arrays)
    arrays.write_bytes(whole[0])
    manifest.write_bytes(whole[1].replace(b'"episodes": 100', b'"episodes": 900'))
    with pytest.raises(StoreError, match=r"one\.json is damaged"):
        read_entry(arrays)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "is damaged .it is no JSON: "),
        ("{", "is damaged .it is no JSON: "),
        ("[" * 100_000, "is damaged .it is no JSON: "),
        ("[]", "is no entry of a library; name one that tickwise wrote"),
        ('{"format": "other"}', "is no entry of a library"),
        ('{"format": "tickwise library entry", "version": 7}', "is of version 7; this Tickwise reads 1"),
        ('{"format": "tickwise library entry", "version": 1}', "is damaged .its checksum"),
    ],
)
def test_a_manifest_that_is_none_is_told(tmp_path: Path, content: str, message: str):
    _, manifest = write_entry(tmp_path / "one.npz", learned(episodes=100))
    manifest.write_text(content)
    with pytest.raises(StoreError, match=message) as caught:
        read_entry(manifest)
    assert "\n" not in str(caught.value)


def forged(path: Path, **changes: Any) -> Path:
    """An entry with a right checksum and wrong content."""
    from tickwise.library.entry_files import _checksum

    arrays_path, manifest_path = write_entry(path, learned(episodes=100))
    manifest = {key: value for key, value in read_manifest(manifest_path).items() if key != "checksum"}
    arrays = npz_arrays(arrays_path.read_bytes())
    for name, value in changes.items():
        (arrays if name in arrays else manifest)[name] = value
    arrays_path.write_bytes(npz_bytes(arrays))
    manifest["checksum"] = _checksum(manifest, arrays_path.read_bytes())
    manifest_path.write_text(json.dumps(manifest))
    return arrays_path


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"formula": "F[0,"}, "is damaged"),
        ({"formula": 3}, "is damaged"),
        ({"formula": STAY}, "is damaged"),
        ({"horizon": "long"}, "is damaged"),
        ({"q": np.zeros(3)}, "is damaged"),
        ({"world_limits": np.zeros(3)}, "is damaged .a world's variables are no list of texts"),
        ({"world_successor": np.full((2, 1, 1), 5)}, "is damaged"),
        ({"location_0": np.zeros(3)}, "the states of its automata are not numbered as this Tickwise numbers them"),
    ],
)
def test_an_entry_whose_parts_do_not_fit_is_told(tmp_path: Path, changes: dict[str, Any], message: str):
    with pytest.raises(StoreError, match=message) as caught:
        read_entry(forged(tmp_path / "one.npz", **changes))
    assert "\n" not in str(caught.value)


def test_nothing_is_left_of_an_entry_that_could_not_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def second(failure: BaseException):
        calls: list[int] = []

        def fsync(descriptor: int) -> None:
            calls.append(descriptor)
            if len(calls) == 2:
                raise failure

        return fsync

    for failure in (KeyboardInterrupt(), OSError(28, "No space left on device")):
        monkeypatch.setattr(os, "fsync", second(failure))
        with pytest.raises((KeyboardInterrupt, StoreError)):
            write_entry(tmp_path / "one.npz", learned(episodes=100))
        assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(os, "fsync", no_room)
    with pytest.raises(StoreError, match=r"cannot write .*one\.npz: No space left on device; make room"):
        write_entry(tmp_path / "one.npz", learned(episodes=100))
    assert list(tmp_path.iterdir()) == []


def test_paths_have_one_of_two_endings(tmp_path: Path):
    for function in (read_entry, lambda path: write_entry(path, learned(episodes=100))):
        with pytest.raises(DataError, match=r"one\.csv does not end in \.npz; use that ending"):
            function(tmp_path / "one.csv")
    with pytest.raises(MissingFileError, match=r"there is no file .*one\.json; check the path"):
        read_entry(tmp_path / "one.npz")


# ---------------------------------------------------------------- worlds


def test_a_world_comes_back(tmp_path: Path):
    mdp = learned().mdp
    write_world(tmp_path / "world.npz", mdp)
    found = read_world(tmp_path / "world.npz")
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(found, name), getattr(mdp, name))
    assert found.limits == mdp.limits


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cell": None}, "holds no world: a world needs an array 'cell'; write it with write_world"),
        ({"variables": np.array([1, 2])}, "a world's variables are no list of texts"),
        ({"limits": np.zeros((3, 2))}, "a world's variables are no list of texts"),
        ({"limits": np.array([["a", "b"]] * 2)}, "has something that is no number"),
        ({"initial": np.array(["a"])}, "has something that is no number"),
        ({"initial": np.zeros(64)}, "a row of initial is not a distribution"),
        ({"successor": np.full((64, 3, 3), 64)}, r"successor has a number outside 0\.\.63"),
    ],
)
def test_a_world_that_is_none_is_told(tmp_path: Path, changes: dict[str, Any], message: str):
    arrays = {name: array for name, array in (world_arrays(learned().mdp) | changes).items() if array is not None}
    (tmp_path / "world.npz").write_bytes(npz_bytes(arrays))
    with pytest.raises(DataError, match=message) as caught:
        read_world(tmp_path / "world.npz")
    assert "\n" not in str(caught.value)
    assert str(tmp_path) in str(caught.value)


def test_files_that_hold_no_world(tmp_path: Path):
    (tmp_path / "world.npz").write_bytes(b"nonsense")
    with pytest.raises(DataError, match="holds no world: it is not an npz file of plain arrays"):
        read_world(tmp_path / "world.npz")
    np.savez(tmp_path / "world.npz", cell=np.array([{}], dtype=object))
    with pytest.raises(DataError, match="Object arrays cannot be loaded"):
        read_world(tmp_path / "world.npz")
    with pytest.raises(MissingFileError):
        read_world(tmp_path / "none.npz")
    with pytest.raises(DataError, match=r"does not end in \.npz"):
        write_world(tmp_path / "world.csv", learned().mdp)
    assert world_of(world_arrays(learned().mdp)).variables == ("x", "y")
