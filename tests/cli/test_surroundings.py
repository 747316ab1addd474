"""The commands in hostile surroundings: closed pipes, full disks, locales, backends, no home, code that raises."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import gymnasium
import pytest

from pbcs_ompl.cli import main

ROOT = Path(__file__).parents[2]
PBCS = [sys.executable, "-m", "pbcs_ompl.cli"]
PLAN = ["plan", "--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 2}']
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": ""}
RAISING = """
import gymnasium, numpy as np

class Odd(Exception):
    def __str__(self):
        raise RuntimeError("no words")

ERRORS = {{"value": ValueError("two\\nlines"), "odd": Odd(), "exit": SystemExit(0)}}

class Raising(gymnasium.Env):
    action_space = gymnasium.spaces.Box(-0.1, 0.1, (2,))
    observation_space = gymnasium.spaces.Box(-1, 1, (2,))

    def __init__(self, where="", what="value"):
        self.where, self.error = where, ERRORS[what]
        self.maybe("init")

    def maybe(self, here):
        if here == self.where:
            raise self.error

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.maybe("reset")
        self.at = np.zeros(2, np.float32)
        return self.at.copy(), {{}}

    def step(self, action):
        self.maybe("step")
        self.at = np.clip(self.at + action, -1, 1).astype(np.float32)
        return self.at.copy(), 0.0, False, False, {{}}

gymnasium.register("Raising-v0", Raising)
"""


def run(words, folder, *, program=PBCS, **settings):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(folder)]), **settings.pop("env", {})}
    shown = settings.pop("stdout", subprocess.PIPE)
    return subprocess.run([*program, *words], cwd=folder, env=environment, stdout=shown, stderr=subprocess.PIPE,
                          text=True, errors="replace", timeout=200, **settings)


def test_a_closed_pipe_ends_quietly_and_pictures_need_no_backend(tmp_path):
    read, write = os.pipe()
    os.close(read)
    ended = run([*PLAN, "--out", "out"], tmp_path, stdout=write, env={"MPLBACKEND": "module://no_such.backend"})
    os.close(write)
    assert (ended.returncode, ended.stderr) == (141, "")
    assert (tmp_path / "out/result.json").exists()
    assert (tmp_path / "out/tree.png").exists()


@pytest.mark.parametrize("words", [["--help"], ["study", "--list"]])
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_one_line(words, tmp_path):
    with open("/dev/full", "w", encoding="utf-8") as full:
        ended = run(words, tmp_path, stdout=full)
    assert (ended.returncode, ended.stderr.count("\n")) == (2, 1)
    assert ended.stderr.startswith("pbcs: error: cannot write to the standard output: No space left")


def test_any_locale_and_any_name_of_a_folder(tmp_path):
    """Neither UTF-8 nor the locale's ASCII has the name."""
    out = tmp_path / os.fsdecode(b"folder-\xc3\xbc-\xe9")
    words = ["compare", "--planners", "Ex", "--env", "pbcs/Maze-v0", "--seeds", "1", "--env-kwargs",
             '{"layout": ["+-+-+", "|é  |", "+-+ +", "|   |", "+-+-+"]}', "--out", os.fsencode(out)]
    again = "import sys; from pbcs_ompl.cli import main; sys.exit(main() or main() or main(['report', sys.argv[-1]]))"
    ended = run(words, tmp_path, env=ASCII, program=[sys.executable, "-c", again])
    assert ended.returncode == 0, ended.stderr
    assert "é" in (out / "report.html").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("setpriv") is None, reason="needs setpriv")
def test_a_read_only_installation_without_a_home(tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(ROOT, copy, symlinks=True,
                    ignore=shutil.ignore_patterns("__pycache__", ".git", ".venv", "runs", "tests", "docs"))
    subprocess.run(["chmod", "-R", "a-w", copy], check=True)
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1", "HOME": "/proc/nope"}
    for name in ("NUMBA_CACHE_DIR", "MPLCONFIGDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME"):
        environment.pop(name, None)
    drop = "-dac_override,-dac_read_search"
    ended = subprocess.run(["setpriv", f"--bounding-set={drop}", "--inh-caps=-dac_override", *PBCS, *PLAN, "--out",
                            str(tmp_path / "out")], cwd=tmp_path, env=environment, capture_output=True, text=True)
    subprocess.run(["chmod", "-R", "u+w", copy], check=True)
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr.count("warning") == 1
    assert ended.stderr.startswith("pbcs: warning: neither the installation nor the home can be written")


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Write a module in the working directory, which no other test sees."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))

    def write(name, text):
        (tmp_path / f"{name}.py").write_text(text, "utf-8")
        monkeypatch.delitem(sys.modules, name, raising=False)

    yield write
    for name in ("raising", "broken"):
        sys.modules.pop(name, None)
    gymnasium.registry.pop("Raising-v0", None)


@pytest.mark.parametrize("verb", ["plan", "train", "compare"])
@pytest.mark.parametrize(("where", "what", "message"), [
    ("init", "value", "ValueError: two lines"), ("reset", "odd", "raised Odd: its message cannot be read"),
    ("step", "exit", "raised SystemExit: 0")])
def test_code_that_raises_is_one_line_and_status_2(verb, where, what, message, module, capsys):
    module("raising", RAISING.format())
    planners = ["--planners", "Ex"] if verb == "compare" else []
    assert main([verb, *planners, "--env", "raising:Raising-v0", "--goal", "obs[0]>0.5", "--env-kwargs",
                 f'{{"where": "{where}", "what": "{what}"}}']) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("pbcs: error: ")
    assert message in last


@pytest.mark.parametrize("words", [["plan", "--env", "broken:A-v0"], ["doctor", "--env", "broken:A-v0"],
                                   [*PLAN, "--planner", "broken:A"],
                                   ["train", *PLAN[1:], "--agent", "broken:A"]])
@pytest.mark.parametrize("text", ["raise RuntimeError('boom')", "raise SystemExit(0)"])
def test_a_module_that_raises_when_it_is_imported(words, text, module, capsys):
    module("broken", text)
    assert main(words) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "RuntimeError: boom" in error or "SystemExit: 0" in error


def test_the_status_of_a_process_is_that_of_the_command(tmp_path):
    """Also where the code of others has asked for another one."""
    (tmp_path / "broken.py").write_text("raise SystemExit(0)", "utf-8")
    ended = run(["plan", "--env", "broken:A-v0"], tmp_path)
    assert (ended.returncode, ended.stderr.count("\n")) == (2, 1)
