"""A lock is held by one, or by several that share it; its file is there as long as somebody holds it, and no longer."""

import subprocess
import sys
import threading
import time

import pytest

from pbcs_ompl.core.errors import RunFolderError
from pbcs_ompl.results.folder import open_run
from pbcs_ompl.results.lock import FolderLock

HOLDER = """
import sys, time
from pathlib import Path
from pbcs_ompl.results.lock import FolderLock
lock = FolderLock(Path(sys.argv[1]))
print("mine", flush=True)
time.sleep(60)
"""


@pytest.mark.parametrize(("first", "second", "allowed"), [
    (True, True, True), (True, False, False), (False, True, False), (False, False, False)])
def test_only_those_who_share_hold_it_together(tmp_path, first, second, allowed):
    path = tmp_path / ".lock"
    held = FolderLock(path, shared=first)
    if allowed:
        FolderLock(path, shared=second).close()
        assert path.exists()
    else:
        with pytest.raises(RunFolderError, match="in use by another process"):
            FolderLock(path, shared=second)
    held.close()
    held.close()
    assert not path.exists()


def test_a_killed_process_lets_go(tmp_path):
    path = tmp_path / ".lock"
    holder = subprocess.Popen([sys.executable, "-c", HOLDER, str(path)], stdout=subprocess.PIPE, text=True)
    assert holder.stdout.readline() == "mine\n"
    with pytest.raises(RunFolderError):
        FolderLock(path)
    holder.kill()
    holder.wait()
    FolderLock(path).close()


def test_many_who_wait_hold_it_one_after_the_other(tmp_path):
    inside, most = [], []

    def hold(number):
        for _ in range(20):
            with FolderLock(tmp_path / ".lock", wait=True):
                inside.append(number)
                most.append(len(inside))
                time.sleep(0.0005)
                inside.remove(number)

    threads = [threading.Thread(target=hold, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (len(most), max(most)) == (80, 1)
    assert list(tmp_path.iterdir()) == []


def test_parts_of_a_run_share_a_folder_but_not_their_part_nor_with_the_whole(tmp_path):
    config = {"value": 1}
    with open_run(tmp_path / "run", config, part="1-of-2"):
        with open_run(tmp_path / "run", config, part="2-of-2"), pytest.raises(RunFolderError, match="in use"):
            open_run(tmp_path / "run", config, part="1-of-2")
        with pytest.raises(RunFolderError, match="in use"):
            open_run(tmp_path / "run", config)
        with pytest.raises(RunFolderError, match=r"another run \(value\)"):
            open_run(tmp_path / "run", {"value": 2}, part="2-of-2")
    with open_run(tmp_path / "run", config), pytest.raises(RunFolderError, match="in use"):
        open_run(tmp_path / "run", config, part="1-of-2")
    assert not list((tmp_path / "run").glob(".lock*"))


def test_what_a_killed_process_left_before_its_settings_were_written_is_no_obstacle(tmp_path):
    (tmp_path / ".lock-1-of-2").touch()
    (tmp_path / ".config.toml.abc").write_text("val")
    open_run(tmp_path, {"value": 1}).close()
    assert (tmp_path / "config.toml").read_text() == "value = 1\n"
