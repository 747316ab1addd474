"""Laws of result folders: whole or absent, never overwritten, one process at a time."""

import errno
import json
import os
import subprocess
import sys
import tomllib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pbcs_ompl.core.errors import DamagedFile, RunFolderError
from pbcs_ompl.results import folder as run_folder
from pbcs_ompl.results.files import (
    read_arrays,
    read_json,
    read_toml,
    to_toml,
    write_arrays,
    write_atomically,
    write_json,
)
from pbcs_ompl.results.folder import RunFolder

names = st.text(st.characters(max_codepoint=0xFFFF, exclude_categories=["Cs"]), max_size=8)
bare_names = st.text("abcdefghijklmnopqrstuvwxyz_", min_size=1, max_size=8)
scalars = st.one_of(st.booleans(), st.integers(-2**63, 2**63 - 1), st.floats(allow_nan=False), names)


def nested(leaves):
    """Values that are leaves, lists and tables of values."""
    return st.recursive(leaves, lambda inner: st.lists(inner, max_size=3)
                        | st.dictionaries(names, inner, max_size=3))


values = nested(scalars)
tables = st.dictionaries(names, values, max_size=4)


@given(st.dictionaries(bare_names, st.one_of(scalars, st.lists(scalars, max_size=3), tables), max_size=5))
def test_toml_round_trip(config):
    assert tomllib.loads(to_toml(config)) == config


@pytest.mark.parametrize("text", ["\U0001f600"])
def test_toml_takes_every_character(text):
    assert tomllib.loads(to_toml({"text": text})) == {"text": text}


def test_toml_leaves_none_out_and_takes_numpy():
    config = {"a": None, "b": np.float64(0.5), "c": np.array([1, 2]), "d": (1, 2), "e": {"x": None, "y": 1},
              "f": float("inf"), "g": [float("-inf")]}
    assert tomllib.loads(to_toml(config)) == {"b": 0.5, "c": [1, 2], "d": [1, 2], "e": {"y": 1},
                                              "f": float("inf"), "g": [float("-inf")]}


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(nested(st.none() | scalars))
def test_json_round_trip(tmp_path, value):
    write_json(tmp_path / "x.json", value)
    assert read_json(tmp_path / "x.json") == value


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

    monkeypatch.setattr(run_folder.os, function, full)
    with pytest.raises(RunFolderError, match="the disk is full") as caught:
        write_json(tmp_path / "result.json", 1)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="cannot write"):
        RunFolder(tmp_path / "file" / "run")


def test_run_is_written_and_read_again(tmp_path):
    with RunFolder(tmp_path / "a" / "run") as folder:
        folder.write_config({"seed": 1, "env_kwargs": {"size": 3}})
        folder.write_result({"solved": True})
    assert read_toml(tmp_path / "a" / "run" / "config.toml") == {"seed": 1, "env_kwargs": {"size": 3}}
    assert json.loads((tmp_path / "a" / "run" / "result.json").read_text()) == {"solved": True}
    assert not (tmp_path / "a" / "run" / ".lock").exists()


def test_folder_that_exists_is_refused_and_resumed_only_on_demand(tmp_path):
    with RunFolder(tmp_path / "run") as folder:
        folder.write_config({})
    with pytest.raises(RunFolderError, match="already exists"):
        RunFolder(tmp_path / "run")
    RunFolder(tmp_path / "run", resume=True).close()
    with pytest.raises(RunFolderError, match="nothing to resume"):
        RunFolder(tmp_path / "other", resume=True)
    assert not (tmp_path / "other").exists()


def test_empty_folder_and_one_of_a_killed_run_are_taken(tmp_path):
    RunFolder(tmp_path).close()
    (tmp_path / ".lock").write_text("")
    with RunFolder(tmp_path) as folder:
        assert folder.path == tmp_path


OPEN = ("import sys; from pbcs_ompl.results.folder import RunFolder; "
        "RunFolder(sys.argv[1], resume=True); print('in')")


def test_second_process_is_kept_out(tmp_path):
    def second() -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", OPEN, str(tmp_path)]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    with RunFolder(tmp_path) as folder:
        folder.write_config({})
        with pytest.raises(RunFolderError, match="in use by another process"):
            RunFolder(tmp_path, resume=True)
        assert "in use by another process" in second().stderr
    assert second().stdout == "in\n"
