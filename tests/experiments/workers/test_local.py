"""Every job makes exactly one record, whatever the others do; no limit is exceeded for long; nobody stays behind."""

import signal
import subprocess
import sys
from collections import Counter
from contextlib import closing
from multiprocessing.connection import wait

import psutil
import pytest
from deeds import broken, do
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.experiments.workers import local, run_all


def run(jobs, workers=1, **limits):
    return list(run_all(jobs, workers, do, broken, **limits))


def is_gone(pid):
    """Say whether a process ended, be it that nobody has asked for its exit status yet."""
    return not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


@settings(max_examples=5, deadline=None)
@given(st.lists(st.sampled_from(["square", "refuse", "kill", "segfault", "exit"]), max_size=6), st.integers(1, 3))
def test_each_job_makes_one_record_and_only_the_guilty_fail(names, workers):
    jobs = [(name, number) for number, name in enumerate(names)]
    records = run(jobs, workers)
    expected = [(name, number * number if name == "square" else number) for name, number in jobs]
    assert Counter((record["name"], record["value"]) for record in records) == Counter(expected)
    assert all(("reason" in record) == (record["name"] != "square") for record in records)


def test_reasons_say_what_happened():
    jobs = [("refuse", 0), ("kill", 0), ("segfault", 0), ("exit", 3), ("lambda", 0)]
    refused, killed, crashed, left, unsendable = [record["reason"] for record in run(jobs)]
    assert refused == "ValueError: this deed\nis refused"
    assert killed.startswith("the process died, Killed: ")
    assert crashed.startswith("the process died, Segmentation fault: ")
    assert left.startswith("the process died, exit status 3: ")
    assert "pickle" in unsendable


def test_processes_are_reused_and_records_come_as_they_end():
    jobs = [("sleep", 1.0), *[("square", number) for number in range(20)]]
    records = run(jobs, workers=2)
    assert [record["name"] for record in records] == ["square"] * 20 + ["sleep"]
    assert len({record["pid"] for record in records}) == 2


def test_a_run_that_takes_too_long_is_stopped_with_its_children(tmp_path):
    jobs = [("wait with a child", tmp_path / "pid"), ("square", 3)]
    stopped, other = run(jobs, max_seconds=1.5)
    assert stopped["reason"] == "stopped from outside after 1.5 s, the limit of one run"
    assert other["value"] == 9
    assert is_gone(int((tmp_path / "pid").read_text()))


def test_a_run_that_eats_memory_is_stopped():
    fed, other = run([("eat", 400), ("square", 3)], max_memory=300.0)
    assert fed["reason"].endswith("MB of memory; the limit of one run is 300")
    assert other["value"] == 9


def test_no_run_pays_for_the_memory_of_another():
    records = run([("keep", 60)] * 4, max_memory=300.0)
    assert not any("reason" in record for record in records)
    assert len({record["pid"] for record in records}) > 1


def test_the_start_of_a_process_costs_no_run_its_time(monkeypatch):
    monkeypatch.setenv("SECONDS_TO_IMPORT", "1.5")
    assert [record["value"] for record in run([("square", 2)], max_seconds=1.0)] == [4]


def test_leaving_early_kills_the_processes():
    with closing(run_all([("square", 1), ("sleep", 60), ("sleep", 60)], 2, do, broken)) as records:
        process = next(records)["pid"]
        assert not is_gone(process)
    assert is_gone(process)


PROGRAM = """
from deeds import broken, do
from pbcs_ompl.experiments.workers import local, run_all

if __name__ == "__main__":
    for record in run_all([("square", 1), ("sleep", 60), ("sleep", 60)], 2, do, broken):
        print(record["value"], flush=True)
"""


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_processes_end_with_their_parent_however_it_goes(tmp_path, sent):
    (tmp_path / "main.py").write_text(PROGRAM)
    parent = subprocess.Popen([sys.executable, str(tmp_path / "main.py")], stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL)
    assert parent.stdout.readline() == b"1\n"
    children = psutil.Process(parent.pid).children()
    parent.send_signal(sent)
    parent.wait(20)
    assert psutil.wait_procs(children, timeout=20)[1] == []


def test_a_script_without_a_guard_is_told_so(tmp_path):
    (tmp_path / "main.py").write_text(PROGRAM.replace('if __name__ == "__main__"', "if True")
                                      .replace('record["value"]', "record"))
    shown = subprocess.run([sys.executable, str(tmp_path / "main.py")], capture_output=True, text=True, timeout=60)
    assert "a script without if __name__ == '__main__'" in shown.stdout
    assert shown.stdout.count("reason") == 3


def test_the_parent_sleeps_until_a_worker_says_something(monkeypatch):
    wakes = []
    monkeypatch.setattr(local, "wait", lambda connections, timeout: wakes.append(timeout) or wait(connections, timeout))
    run([("sleep", 0.5)])
    assert wakes == [None, None]  # it is ready; it has a record


def test_no_jobs_no_processes():
    assert run([], workers=3) == []
