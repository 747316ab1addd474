"""Every run ends once, whatever the others do; no limit is exceeded for long; no process is left behind."""

import signal
import subprocess
import sys
from collections import Counter
from contextlib import closing
from multiprocessing.connection import wait
from pathlib import Path

import psutil
import pytest
from deeds import deed, do
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.run import Failure
from pbcs_ompl.experiments.workers import Limits, executors, make_executor, worker
from pbcs_ompl.experiments.workers.start import CannotStart


def execute(runs, jobs=1, **limits):
    """Return what each run found, in the order in which they end."""
    return [found for _, found in make_executor(jobs)(runs, do, Limits(**limits))]


def is_gone(pid):
    """Return whether a process ended, even if its exit status was not read yet."""
    return not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


@settings(max_examples=5, deadline=None)
@given(st.lists(st.sampled_from(["square", "refuse", "kill", "segfault", "exit"]), max_size=6), st.integers(1, 3))
def test_each_run_ends_once_and_only_the_guilty_fail(names, jobs):
    runs = [deed(name, number) for number, name in enumerate(names)]
    ended = list(make_executor(jobs)(runs, do, Limits()))
    assert Counter(run.name for run, _ in ended) == Counter(run.name for run in runs)
    for run, found in ended:
        name, value = run.settings["deed"], run.settings["value"]
        assert isinstance(found, Failure) == (name != "square")
        assert isinstance(found, Failure) or found["value"] == value * value


def test_reasons_say_what_happened():
    runs = [deed("refuse", 0), deed("misuse", 0), deed("kill", 0), deed("segfault", 0), deed("exit", 3),
            deed("lambda", 0)]
    refused, misused, killed, crashed, left, unwritable = [failure.reason for failure in execute(runs)]
    assert refused == "ValueError: this deed is refused"
    assert misused == "this deed does not exist"
    assert killed.startswith("the process died, Killed: ")
    assert crashed.startswith("the process died, Segmentation fault: ")
    assert left.startswith("the process died, exit status 3: ")
    assert unwritable == "TypeError: cannot write function as JSON"


def test_processes_are_reused_and_records_come_as_they_end():
    records = execute([deed("sleep", 1.0), *(deed("square", number) for number in range(20))], jobs=2)
    assert [record["deed"] for record in records] == ["square"] * 20 + ["sleep"]
    assert len({record["pid"] for record in records}) == 2


def test_a_run_that_takes_too_long_is_killed_with_its_children(tmp_path):
    runs = [deed("wait with a child", str(tmp_path / "pid")), deed("square", 3)]
    killed, other = execute(runs, max_seconds=1.5)
    assert killed.reason == "killed after 1.5 s, the limit of one run"
    assert other["value"] == 9
    assert is_gone(int((tmp_path / "pid").read_text()))


def test_a_run_that_eats_memory_is_killed():
    fed, other = execute([deed("eat", 400), deed("square", 3)], max_memory=300.0)
    assert fed.reason.endswith("MB of memory; the limit of one run is 300")
    assert other["value"] == 9


def test_no_run_pays_for_the_memory_of_another():
    records = execute([deed("keep", 60)] * 4, max_memory=300.0)
    assert not any(isinstance(record, Failure) for record in records)
    assert len({record["pid"] for record in records}) > 1


def test_the_start_of_a_process_costs_no_run_its_time(monkeypatch):
    monkeypatch.setenv("SECONDS_TO_IMPORT", "1.5")
    assert [record["value"] for record in execute([deed("square", 2)], max_seconds=1.0)] == [4]


def test_leaving_early_kills_the_processes():
    runs = [deed("square", 1), deed("sleep", 60), deed("sleep", 61)]
    with closing(make_executor(2)(runs, do, Limits())) as ended:
        process = next(ended)[1]["pid"]
        assert not is_gone(process)
    assert is_gone(process)


PROGRAM = """
from deeds import deed, do
from pbcs_ompl.experiments.workers import Limits, make_executor

if __name__ == "__main__":
    for _, found in make_executor(2)([deed("square", 1), deed("sleep", 60), deed("sleep", 61)], do, Limits()):
        print(found["value"], flush=True)
"""


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_processes_end_with_their_parent_for_whatever_reason(tmp_path, sent):
    (tmp_path / "main.py").write_text(PROGRAM)
    parent = subprocess.Popen([sys.executable, str(tmp_path / "main.py")], stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL)
    assert parent.stdout.readline() == b"1\n"
    children = psutil.Process(parent.pid).children()
    parent.send_signal(sent)
    parent.wait(20)
    assert psutil.wait_procs(children, timeout=20)[1] == []


def test_a_script_without_a_guard_is_one_error_and_no_result(tmp_path):
    (tmp_path / "main.py").write_text(PROGRAM.replace('if __name__ == "__main__"', "if True"), encoding="utf-8")
    shown = subprocess.run([sys.executable, str(tmp_path / "main.py")], capture_output=True, text=True, timeout=60)
    assert "cannot start workers: the process died, exit status 1" in shown.stderr.splitlines()[-1]
    assert "if __name__ == '__main__':" in shown.stderr.splitlines()[-1]
    assert shown.stdout == ""


def test_a_script_without_a_file_is_refused_before_anything_starts():
    shown = subprocess.run([sys.executable, "-"], input=PROGRAM, capture_output=True, text=True, timeout=60,
                           cwd=Path(__file__).parent)
    assert "cannot start workers: the running script '<stdin>' is no file" in shown.stderr.splitlines()[-1]
    assert shown.stdout == ""


def test_a_function_that_cannot_be_imported_is_one_error(monkeypatch):
    monkeypatch.setenv("DEEDS_FAIL", "1")
    with pytest.raises(CannotStart, match="RuntimeError: deeds cannot be imported"):
        execute([deed("square", 1), deed("square", 2)], jobs=2)


def test_the_parent_sleeps_until_a_worker_sends_something(monkeypatch):
    wakes = []
    monkeypatch.setattr(executors, "wait",
                        lambda connections, timeout: wakes.append(timeout) or wait(connections, timeout))
    execute([deed("sleep", 0.5)])
    assert wakes == [None, None]  # it is ready; it has a record


def test_no_runs_no_processes():
    assert execute([], jobs=3) == []


@pytest.mark.parametrize(("make", "message"), [
    (lambda: make_executor(0), "jobs is 0; expected from 1"),
    (lambda: Limits(max_seconds=0.0), "max_seconds is 0.0; expected more than 0"),
    (lambda: Limits(max_memory=-1.0), "max_memory is -1.0; expected more than 0")])
def test_limits_that_cannot_be_are_named(make, message):
    with pytest.raises(InvalidOption, match=message):
        make()


@pytest.mark.parametrize("messages", [0, 1, 2, 3])
def test_a_parent_that_hangs_up_ends_a_worker_quietly(monkeypatch, messages):
    """After this number of messages: the function, that it is ready, a run, its record."""
    class HungUp:
        left = messages

        def recv(self):
            self.count()
            return do

        def send(self, message):
            self.count()

        def count(self):
            self.left -= 1
            if self.left < 0:
                raise ConnectionResetError

    monkeypatch.setattr(worker, "end_with_parent", lambda: None)
    monkeypatch.setattr(worker.signal, "signal", lambda *_: None)
    worker.worker_main(HungUp())
