"""Laws of the files of result folders: what is written is read again, and is whole or absent."""

import errno
import os
import tomllib

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from pbcs_ompl.core.errors import DamagedFile, RunFolderError
from pbcs_ompl.results import files
from pbcs_ompl.results.files import (
    read_arrays,
    read_json,
    read_toml,
    sweep_temporaries,
    to_toml,
    write_arrays,
    write_atomically,
    write_json,
    write_toml,
)

names = st.text(st.characters(max_codepoint=0xFFFF, exclude_categories=["Cs"]), max_size=8)
scalars = st.one_of(st.booleans(), st.integers(-2**63, 2**63 - 1), st.floats(allow_nan=False), names)


def nested(leaves):
    """Values that are leaves, lists and tables of values."""
    return st.recursive(leaves, lambda inner: st.lists(inner, max_size=3)
                        | st.dictionaries(names, inner, max_size=3))


values = nested(scalars)
tables = st.dictionaries(names, values, max_size=4)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(names, st.one_of(scalars, st.lists(values, max_size=3), tables), max_size=5))
@example({"text": "\U0001f600"})
def test_toml_round_trip(tmp_path, config):
    write_toml(tmp_path / "x.toml", config)
    assert read_toml(tmp_path / "x.toml") == config


def test_toml_leaves_none_out_and_takes_numpy():
    config = {"a": None, "b": np.float64(0.5), "c": np.array([1, 2]), "d": (1, 2), "e": {"x": None, "y": 1},
              "f": float("inf"), "g": [float("-inf")]}
    assert tomllib.loads(to_toml(config)) == {"b": 0.5, "c": [1, 2], "d": [1, 2], "e": {"y": 1},
                                              "f": float("inf"), "g": [float("-inf")]}


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(nested(st.none() | scalars))
def test_json_round_trip(tmp_path, value):
    write_json(tmp_path / "x.json", value)
    assert read_json(tmp_path / "x.json", finite=False) == value


@pytest.mark.parametrize("value", [float("inf"), [1.0, float("-inf")], {"a": float("nan")}])
def test_numbers_that_are_not_finite_are_read_only_where_that_is_meant(tmp_path, value):
    write_json(tmp_path / "x.json", value)
    with pytest.raises(DamagedFile, match="expected a finite number"):
        read_json(tmp_path / "x.json")
    assert repr(read_json(tmp_path / "x.json", finite=False)) == repr(value)


def test_json_takes_numpy_and_refuses_what_it_does_not_know(tmp_path):
    write_json(tmp_path / "x.json", {"a": np.float64(1.5), "b": np.arange(2), "c": tmp_path, "d": {"z", "y"}})
    assert read_json(tmp_path / "x.json") == {"a": 1.5, "b": [0, 1], "c": str(tmp_path), "d": ["y", "z"]}
    with pytest.raises(TypeError, match="object"):
        write_json(tmp_path / "y.json", object())
    assert [path.name for path in tmp_path.iterdir()] == ["x.json"]


def test_arrays_round_trip_without_pickle(tmp_path):
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b": np.array("words"), "c": np.array([], dtype=np.int32)}
    write_arrays(tmp_path / "x.npz", **arrays)
    loaded = read_arrays(tmp_path / "x.npz")
    assert {name: (a.dtype, a.tolist()) for name, a in loaded.items()} == \
        {name: (a.dtype, a.tolist()) for name, a in arrays.items()}
    with pytest.raises(ValueError, match=r"[Oo]bject"):
        write_arrays(tmp_path / "y.npz", objects=np.array([{}], dtype=object))
    assert [path.name for path in tmp_path.iterdir()] == ["x.npz"]


@pytest.mark.parametrize("read", [read_arrays, read_json, read_toml])
@pytest.mark.parametrize("content", [None, b"", b"\xff\xfe broken", b"PK\x03\x04 truncated"])
def test_damage_is_named(tmp_path, read, content):
    path = tmp_path / "file"
    if content is not None:
        path.write_bytes(content)
    if (read, content) == (read_toml, b""):
        assert read_toml(path) == {}
        return
    with pytest.raises(DamagedFile, match="does not exist" if content is None else "damaged"):
        read(path)


def test_interrupted_write_leaves_the_old_file_whole(tmp_path):
    path = tmp_path / "result.json"
    write_json(path, "old")

    def half(file):
        file.write(b'"ne')
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(path, half)
    assert read_json(path) == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["result.json"]


@pytest.mark.parametrize("function", ["fsync", "replace"])
def test_full_disk_is_one_clear_line_and_leaves_nothing(tmp_path, monkeypatch, function):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(files.os, function, full)
    with pytest.raises(RunFolderError, match="the disk is full") as caught:
        write_json(tmp_path / "result.json", 1)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []




def test_what_killed_processes_left_is_swept(tmp_path):
    kept = [tmp_path / name for name in ("result.json", ".hidden", "comparison.db", ".comparison.db.0123abcd.txt")]
    left = [tmp_path / "runs" / name for name in (".result.json.0123abcd", ".comparison.db.0123abcd",
                                                  ".comparison.db.0123abcd-journal")]
    left[0].parent.mkdir()
    for path in kept + left:
        path.write_text("x")
    sweep_temporaries(tmp_path)
    assert all(path.exists() for path in kept)
    assert not any(path.exists() for path in left)
