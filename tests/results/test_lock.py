"""A lock is held by one process; its file exists as long as it is held, and no longer."""

import subprocess
import sys
import threading
import time

import pytest

from pbcs_ompl.core.errors import RunFolderError
from pbcs_ompl.results.folder import LOCK, RunFolder, lock

HOLDER = """
import sys, time
from pathlib import Path
from pbcs_ompl.results.folder import lock
with lock(Path(sys.argv[1])):
    print("mine", flush=True)
    time.sleep(60)
"""


def test_only_one_holds_it(tmp_path):
    path = tmp_path / ".lock"
    for _ in range(2):
        with lock(path):
            assert path.exists()
            with pytest.raises(RunFolderError, match="in use by another process"), lock(path):
                pass
            assert path.exists()
        assert not path.exists()


def test_a_killed_process_releases_it(tmp_path):
    path = tmp_path / ".lock"
    holder = subprocess.Popen([sys.executable, "-c", HOLDER, str(path)], stdout=subprocess.PIPE, text=True)
    assert holder.stdout.readline() == "mine\n"
    with pytest.raises(RunFolderError), lock(path):
        pass
    holder.kill()
    holder.wait()
    with lock(path):
        pass
    assert not path.exists()


def test_many_who_wait_hold_it_one_after_the_other(tmp_path):
    inside, most = [], []

    def hold(number):
        for _ in range(20):
            with lock(tmp_path / ".lock", wait=True):
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


def test_a_folder_that_does_not_exist_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError), lock(tmp_path / "file" / ".lock"):
        pass


def test_a_link_in_place_of_the_lock_is_not_followed(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / LOCK).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(RunFolderError, match="is a link"):
        RunFolder(tmp_path / "run")
    assert not (tmp_path / "elsewhere").exists()
