"""A file that was changed after it was written is found; one that was written again, or by a killed process, is not."""

import json
from pathlib import Path

import numpy as np
import pytest

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.results.arrays import take
from pbcs_ompl.results.checksums import SUMS, Checksums, changed_files, write_summed_json, write_summed_toml
from pbcs_ompl.results.files import read_arrays, write_arrays


def test_a_change_is_found(tmp_path: Path) -> None:
    write_summed_json(tmp_path / "result.json", {"solved": True, "é": 1})
    write_summed_toml(tmp_path / "config.toml", {"seed": 1})
    write_summed_json(tmp_path / "runs/a/x.json", {"seed": 1})
    assert changed_files(tmp_path) == []
    for name in ("result.json", "config.toml", "runs/a/x.json"):
        before = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(before.replace(b"1", b"2"))
        assert changed_files(tmp_path) == [tmp_path / name]
        (tmp_path / name).write_bytes(before)


def test_a_file_that_is_written_again_is_not_changed(tmp_path: Path) -> None:
    for seed in range(3):
        write_summed_json(tmp_path / "result.json", {"seed": seed})
    assert changed_files(tmp_path) == []
    (tmp_path / "result.json").unlink()
    assert changed_files(tmp_path) == [tmp_path / "result.json"]


def test_a_line_that_was_cut_off_spoils_no_other(tmp_path: Path) -> None:
    write_summed_json(tmp_path / "result.json", 1)
    (tmp_path / SUMS).write_bytes((tmp_path / SUMS).read_bytes() + b"0123abc  config.t")
    write_summed_toml(tmp_path / "config.toml", {"a": 1})
    assert changed_files(tmp_path) == []


def test_a_folder_without_checksums_is_not_checked(tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(json.dumps(1))
    assert not Checksums(tmp_path).is_changed(tmp_path / "result.json")


def test_a_link_in_place_of_the_checksums_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / SUMS).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(Exception, match="cannot write"):
        write_summed_json(tmp_path / "result.json", 1)
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.parametrize(("array", "message"), [
    (np.zeros((2, 3)), r"expected numbers \[any, 2\]"), (np.array([["a", "b"]]), "<U1"), (np.zeros(2), r"\[2\]"),
    (np.array([[1.0, np.nan]]), "not finite"), (np.zeros((1, 2), complex), "complex128"),
])
def test_arrays_that_are_refused(tmp_path: Path, array: np.ndarray, message: str) -> None:
    path = tmp_path / "x.npz"
    write_arrays(path, x=array)
    with pytest.raises(DamagedFile, match=message):
        take(path, read_arrays(path), "x", (None, 2))
    with pytest.raises(DamagedFile, match="lacks the array 'y'"):
        take(path, read_arrays(path), "y", (None,))
