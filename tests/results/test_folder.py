"""Laws of result folders: never overwritten, one process at a time, of a known kind."""

import json
import subprocess
import sys

import pytest

from pbcs_ompl.core.errors import DamagedFile, RunFolderError
from pbcs_ompl.results.files import read_toml, write_toml
from pbcs_ompl.results.folder import KINDS, RunFolder, open_run, read_config


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


def test_shards_of_a_run_share_a_folder_but_neither_with_themselves_nor_with_the_whole(tmp_path):
    config = {"value": 1}
    with open_run(tmp_path / "run", config, shard="1-of-2"):
        with open_run(tmp_path / "run", config, shard="2-of-2"), pytest.raises(RunFolderError, match="in use"):
            open_run(tmp_path / "run", config, shard="1-of-2")
        with pytest.raises(RunFolderError, match="in use"):
            open_run(tmp_path / "run", config)
        with pytest.raises(RunFolderError, match=r"another run \(value\)"):
            open_run(tmp_path / "run", {"value": 2}, shard="2-of-2")
    with open_run(tmp_path / "run", config), pytest.raises(RunFolderError, match="in use"):
        open_run(tmp_path / "run", config, shard="1-of-2")
    assert not list((tmp_path / "run").glob(".lock*"))


def test_what_a_killed_process_left_before_its_settings_were_written_is_no_obstacle(tmp_path):
    (tmp_path / ".lock-shard-1-of-2").touch()
    (tmp_path / ".config.toml.abc").write_text("val")
    open_run(tmp_path, {"value": 1}).close()
    assert (tmp_path / "config.toml").read_text() == "value = 1\n"


@pytest.mark.parametrize("config", [{}, {"kind": "paln"}, {"planner": "Ex"}])
def test_a_folder_of_no_known_kind_is_refused(tmp_path, config):
    write_toml(tmp_path / "config.toml", config)
    with pytest.raises(DamagedFile, match=f"has the kind {config.get('kind')!r}; expected plan or train or eval"):
        read_config(tmp_path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_folder_of_another_kind_is_named(tmp_path, kind):
    write_toml(tmp_path / "config.toml", {"kind": kind})
    assert read_config(tmp_path) == read_config(tmp_path, kind) == {"kind": kind}
    for other in set(KINDS) - {kind}:
        with pytest.raises(DamagedFile, match=f"has the kind '{kind}'; expected {other}"):
            read_config(tmp_path, other)
