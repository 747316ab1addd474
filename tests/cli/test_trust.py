"""What others wrote is data: a module that a folder names, or that lies beside it, is imported only when trusted."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import pbcs_ompl
from pbcs_ompl.cli import main
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import UntrustedModule
from pbcs_ompl.core.trust import is_module_name, module_names
from pbcs_ompl.resettable.make import fresh_env
from pbcs_ompl.results.files import read_toml, write_toml

EVIL = "import pathlib\npathlib.Path('PWNED').write_text('1')\n"
SHADOWED = ("imageio", "mujoco", "shimmy", "ray", "gymnasium_robotics", "stable_baselines3", "sitecustomize")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A training that a stranger sends, with a module beside it, and an installed package that announces it."""
    folder = tmp_path_factory.mktemp("stranger")
    pbcs_ompl.train("pbcs/Maze-v0", env_kwargs={"size": 2}, seed=0, max_transitions=2_000, out=folder / "run")
    (folder / "evil.py").write_text(EVIL)
    for name in SHADOWED:
        if not (name in sys.modules or shutil.which(name)):
            (folder / f"{name}.py").write_text(EVIL)
    metadata = folder / "evil-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Name: evil\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text("[pbcs_ompl.envs]\nevil = evil\n[gymnasium.envs]\nevil = evil:f\n")
    return folder


@pytest.fixture
def stranger(finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(finished, tmp_path / "copy")
    monkeypatch.chdir(tmp_path / "copy")
    return tmp_path / "copy"


def _run(*lines: str) -> "subprocess.CompletedProcess[str]":
    """Run command lines one after the other, in one new process, whose status is that of the last."""
    code = ("import sys; sys.path.pop(0); from pbcs_ompl.cli import main; "
            "raise SystemExit([main(line.split()) for line in sys.argv[1:]][-1])")
    path = os.pathsep.join([str(Path(pbcs_ompl.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    return subprocess.run([sys.executable, "-c", code, *lines], capture_output=True, text=True,
                          env=os.environ | {"PYTHONPATH": path}, check=False)


CONFIG_CHANGES = [{"agent": "evil:A"}, {"planner": "evil:P"}, {"planner_kwargs": {"x": ["evil:P"]}},
                  {"environment": {"id": "evil:Maze-v0", "kwargs": {}}},
                  {"environment": {"id": "pbcs/Maze-v0", "kwargs": {"size": 2}, "goal": "evil:goal"}},
                  {"environment": {"id": "pbcs/Maze-v0", "kwargs": {"size": 2}, "feature": " evil : f"}},
                  {"environment": {"id": "pbcs/Maze-v0", "kwargs": {"other": {"deep": ["evil:Maze-v0"]}}}}]


@pytest.mark.parametrize("change", CONFIG_CHANGES, ids=str)
def test_no_module_that_a_folder_names_is_imported(stranger: Path, change: dict[str, object]) -> None:
    config = read_toml(stranger / "run/config.toml")
    write_toml(stranger / "run/config.toml", config | change)
    (stranger / "run/result.json").unlink()
    with pytest.raises(UntrustedModule, match="add --trust to the command"):
        pbcs_ompl.resume(stranger / "run")
    assert main(["report", "run"]) == 0
    assert not (stranger / "PWNED").exists()


@pytest.mark.parametrize("change", [{"id": "evil:Maze-v0"}, {"goal": "evil:goal"}, {"feature": "evil:f"}], ids=str)
def test_the_environment_of_a_chain_imports_nothing(stranger: Path, change: dict[str, str]) -> None:
    spec = EnvSpec.from_dict({"id": "pbcs/Maze-v0", "kwargs": {"size": 2}} | change)
    with pytest.raises(UntrustedModule, match="evil"):
        pbcs_ompl.make(spec)
    with pytest.raises(UntrustedModule, match="evil"):
        fresh_env(spec)
    assert not (stranger / "PWNED").exists()


def test_nothing_beside_a_folder_is_imported(stranger: Path) -> None:
    """Not by entry points of a package in the working directory either, nor in place of what is not installed."""
    found = _run("report .", "report run", "train --resume run", "eval run",
                 "plan --env pbcs/Maze-v0 --max-transitions 50")
    assert "Traceback" not in found.stderr
    assert found.returncode == 1, found.stderr  # of the last line: a plan that its budget ended
    assert not (stranger / "PWNED").exists(), found.stderr


def test_a_folder_that_is_trusted_may_name_modules(stranger: Path, capsys: pytest.CaptureFixture[str],
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(sys.modules, "evil", raising=False)
    write_toml(stranger / "run/config.toml", read_toml(stranger / "run/config.toml") | {"agent": "evil:A"})
    (stranger / "run/result.json").unlink()
    assert main(["train", "--resume", "run", "--trust"]) == 2
    sys.modules.pop("evil", None)
    assert "cannot load the agent 'evil:A'" in capsys.readouterr().err
    assert (stranger / "PWNED").exists()


def test_names_that_import_a_module() -> None:
    for name in ("evil:Maze-v0", "evil.sub:f", "e-vil:f", " evil : f"):
        assert is_module_name(name)
    for name in ("pbcs/Maze-v0", "qpos[0:2]", "Ex", None):
        assert not is_module_name(name)
    assert list(module_names({"a": ["x:Y", {"b": "p.q:r"}], "device": "cuda:0", "z": 1})) == ["p.q:r", "x:Y"]
