from __future__ import annotations

import errno
import io
import json
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tickwise._archives import npz_bytes
from tickwise._files import write_bytes
from tickwise.errors import MissingFileError, StoreError
from tickwise.experiments.store import Store, read_json, write_json

ARRAYS = {"b": np.arange(6, dtype=np.int32).reshape(2, 3), "a": np.array([0.5, np.nan])}


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store.open(tmp_path / "run", {"name": "tiny", "learning": {"block": 10, "window": 5}})


def files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def no_room(_descriptor: int) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_an_artefact_comes_back(store: Store):
    assert not store.has("learn-I-0")
    store.save("learn-I-0", {"run": 0, "text": "φ"}, ARRAYS)
    assert store.has("learn-I-0")
    found = store.load("learn-I-0")
    assert (found["run"], found["text"]) == (0, "φ")
    np.testing.assert_array_equal(found["a"], ARRAYS["a"])
    np.testing.assert_array_equal(found["b"], ARRAYS["b"])
    assert found["b"].dtype == np.int32
    assert set(found) == {"run", "text", "a", "b"}


def test_an_artefact_without_arrays_is_one_file(store: Store):
    store.save("infer-0", {"formula": None}, {})
    assert store.load("infer-0") == {"formula": None}
    assert files(store.folder) == {"config.json", "artefacts/infer-0.json"}


@given(
    hnp.arrays(
        st.sampled_from([np.int8, np.int64, np.float32, np.float64, np.bool_]),
        hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
    )
)
def test_any_array_comes_back_from_the_same_bytes(array: np.ndarray):
    content = npz_bytes({"array": array, "other": ARRAYS["b"]})
    assert content == npz_bytes({"other": ARRAYS["b"], "array": array})
    with np.load(io.BytesIO(content), allow_pickle=False) as found:
        np.testing.assert_array_equal(found["array"], array)
        assert found["array"].dtype == array.dtype


def test_no_time_of_writing_gets_into_the_bytes(store: Store):
    store.save("one", {}, ARRAYS)
    with zipfile.ZipFile(store.folder / "artefacts" / "one.npz") as archive:
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert archive.namelist() == ["a.npy", "b.npy"]


def test_objects_are_never_pickled(store: Store):
    with pytest.raises(ValueError, match="allow_pickle=False"):
        store.save("one", {}, {"bad": np.array([object()])})
    assert not store.has("one")


def test_opening_again_goes_on(store: Store):
    store.save("infer-0", {}, {})
    again = Store.open(store.folder, {"name": "tiny", "learning": {"window": 5, "block": 10}})
    assert again.has("infer-0")


def test_another_configuration_is_refused_and_the_key_is_named(store: Store):
    wanted = {"name": "tiny", "learning": {"block": 20, "window": 5}}
    with pytest.raises(StoreError, match=r"its learning\.block is 10, not 20.*choose another folder with --out"):
        Store.open(store.folder, wanted)
    with pytest.raises(StoreError, match="its seed is null, not 3"):
        Store.open(store.folder, {"name": "tiny", "learning": {"block": 10, "window": 5}, "seed": 3})
    write_json(store.folder / "config.json", {**read_json(store.folder / "config.json"), "format": 0})
    with pytest.raises(StoreError, match="its format is 0, not"):
        Store.open(store.folder, {"name": "tiny", "learning": {"block": 10, "window": 5}})


def test_a_folder_with_foreign_files_is_refused(tmp_path: Path):
    (tmp_path / "thesis.tex").write_text("dear reader")
    with pytest.raises(StoreError, match="holds files but no run"):
        Store.open(tmp_path, {})
    assert files(tmp_path) == {"thesis.tex"}


def test_an_empty_folder_is_taken(tmp_path: Path):
    Store.open(tmp_path, {"name": "tiny"})
    assert files(tmp_path) == {"config.json"}


def test_a_file_is_no_folder(tmp_path: Path):
    (tmp_path / "run").write_text("")
    with pytest.raises(StoreError, match=r"cannot read the folder .*run"):
        Store.open(tmp_path / "run", {})


@pytest.mark.parametrize("content", ["", "{", "[1]", "3"])
def test_a_broken_configuration_is_refused(tmp_path: Path, content: str):
    (tmp_path / "config.json").write_text(content)
    with pytest.raises(StoreError, match=r"config\.json holds no configuration of a run; choose another folder"):
        Store.open(tmp_path, {})


def test_a_configuration_that_is_a_folder_is_refused(tmp_path: Path):
    (tmp_path / "config.json").mkdir()
    with pytest.raises(StoreError, match=r"cannot read .*config\.json"):
        Store.open(tmp_path, {})


def test_a_full_disk_leaves_what_was_there(store: Store, monkeypatch: pytest.MonkeyPatch):
    store.save("one", {"value": 1}, ARRAYS)
    before = {name: (store.folder / name).read_bytes() for name in files(store.folder)}
    monkeypatch.setattr(os, "fsync", no_room)
    for name in ("one", "two"):
        with pytest.raises(StoreError, match=r"cannot write .*: No space left on device; make room"):
            store.save(name, {"value": 2}, {"a": np.zeros(3)})
    assert {name: (store.folder / name).read_bytes() for name in files(store.folder)} == before
    assert not store.has("two")


def test_a_full_disk_at_the_start_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "fsync", no_room)
    with pytest.raises(StoreError, match=r"config\.json"):
        Store.open(tmp_path / "run", {})
    assert files(tmp_path) == set()


def test_an_artefact_without_its_manifest_is_not_finished(store: Store, monkeypatch: pytest.MonkeyPatch):
    calls: list[int] = []

    def second_fails(descriptor: int) -> None:
        calls.append(descriptor)
        if len(calls) == 2:
            no_room(descriptor)

    monkeypatch.setattr(os, "fsync", second_fails)
    with pytest.raises(StoreError):
        store.save("one", {}, ARRAYS)
    assert files(store.folder) == {"config.json", "artefacts/one.npz"}
    assert not store.has("one")


def test_an_artefact_without_its_arrays_is_not_finished(store: Store):
    store.save("one", {}, ARRAYS)
    (store.folder / "artefacts" / "one.npz").unlink()
    assert not store.has("one")
    with pytest.raises(MissingFileError, match=r"no file .*one\.npz; run the same study again"):
        store.load("one")


def test_what_a_killed_process_left_is_cleared(store: Store):
    leftovers = [store.folder / ".config.json.12345.tmp", store.folder / "artefacts" / ".one.npz.12345.tmp"]
    leftovers[1].parent.mkdir()
    for path in leftovers:
        path.write_bytes(b"half of")
    store.save("one", {}, ARRAYS)
    assert not leftovers[1].exists()
    # killed while it wrote its first file: the folder is as good as empty
    (store.folder / "config.json").unlink()
    for path in (store.folder / "artefacts").iterdir():
        path.unlink()
    (store.folder / "artefacts").rmdir()
    Store.open(store.folder, {})
    assert files(store.folder) == {"config.json"}


def test_a_missing_artefact_is_named(store: Store):
    with pytest.raises(MissingFileError, match=r"no file .*infer-0\.json; run the same study again"):
        store.load("infer-0")


def test_broken_arrays_are_named(store: Store):
    store.save("one", {}, ARRAYS)
    path = store.folder / "artefacts" / "one.npz"
    whole = path.read_bytes()
    flipped = bytearray(whole)
    flipped[60] ^= 0xFF
    for content in (b"", b"text", whole[: len(whole) // 2], whole[:-1], bytes(flipped)):
        path.write_bytes(content)
        with pytest.raises(StoreError, match=r"one\.npz is broken .*; remove it and run the same study again"):
            store.load("one")


def test_arrays_that_lack_a_named_one_are_broken(store: Store):
    store.save("one", {}, ARRAYS)
    write_bytes(store.folder / "artefacts" / "one.npz", npz_bytes({"a": ARRAYS["a"]}))
    with pytest.raises(StoreError, match="is broken"):
        store.load("one")
    np.save(store.folder / "artefacts" / "one", ARRAYS["a"])
    (store.folder / "artefacts" / "one.npy").replace(store.folder / "artefacts" / "one.npz")
    with pytest.raises(StoreError, match="is broken"):
        store.load("one")


def test_a_pickled_array_is_never_loaded(store: Store):
    store.save("one", {}, ARRAYS)
    np.savez(store.folder / "artefacts" / "one.npz", a=np.array([{}], dtype=object), b=ARRAYS["b"])
    with pytest.raises(StoreError, match="is broken"):
        store.load("one")


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"arrays": 3}', '"text"'])
def test_a_broken_manifest_is_named(store: Store, content: str):
    store.save("one", {}, {})
    (store.folder / "artefacts" / "one.json").write_text(content)
    for read in (store.has, store.load):
        with pytest.raises(StoreError, match=r"one\.json is broken .*; remove it"):
            read("one")


def test_json_is_written_for_people_too(tmp_path: Path):
    write_json(tmp_path / "one.json", {"formula": "◇[0,5] x ≥ 3"})
    text = (tmp_path / "one.json").read_text(encoding="utf-8")
    assert "◇[0,5] x ≥ 3" in text
    assert text.endswith("}\n")
    assert json.loads(text) == read_json(tmp_path / "one.json")


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() == 0, reason="root may read everything")
def test_a_folder_that_may_not_be_written_is_named(tmp_path: Path):
    tmp_path.chmod(0o500)
    with pytest.raises(StoreError, match="Permission denied"):
        Store.open(tmp_path, {})


def test_sweeping_removes_what_killed_writers_left_and_nothing_else(store: Store):
    store.save("one", {"run": 0}, {"x": np.arange(3)})
    before = files(store.folder)
    (store.folder / "artefacts" / ".two.npz.123.tmp").write_bytes(b"half")
    store.sweep()
    assert files(store.folder) == before
    assert store.load("one")["x"].tolist() == [0, 1, 2]
