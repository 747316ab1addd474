"""What a user installs: one package, complete, that the folders of the user's own project cannot hide."""

import json
import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this checkout, built from a copy of what git tracks."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    tracked = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT,
                             capture_output=True, check=True).stdout.split(b"\0")
    names = [os.fsdecode(name) for name in tracked if name and os.path.lexists(ROOT / os.fsdecode(name))]
    for name in names:
        target = source / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_symlink():
            target.symlink_to(os.readlink(ROOT / name))
        else:
            target.write_bytes((ROOT / name).read_bytes())
    subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation",
                    "--wheel-dir", out, source], check=True)
    (built,) = out.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The interpreter of a new environment: the wheel, and the libraries of this one without this checkout.

    The libraries come in as a plain path, so their own .pth files, an editable installation among them, do not count.
    """
    folder = tmp_path_factory.mktemp("clean") / "venv"
    venv.create(folder, with_pip=False)
    interpreter = folder / "bin" / "python"
    subprocess.run([sys.executable, "-m", "pip", "--python", interpreter, "install", "--quiet", "--no-deps", wheel],
                   check=True)
    (site,) = (folder / "lib").glob("python*/site-packages")
    (site / "libraries.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return interpreter


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder as users have them: with `envs/`, `planners/` and modules of the same names as ours."""
    for package in ("envs", "agents"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text("mine = True\n")
    (tmp_path / "planners.py").write_text("mine = True\n")
    (tmp_path / "planners").mkdir()
    (tmp_path / "planners" / "__init__.py").write_text("mine = True\n")
    return tmp_path


def run(python: Path, project: Path, *words: str) -> str:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}  # which may lead here
    done = subprocess.run([python, *words], cwd=project, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_one_top_level_name_is_installed(wheel: Path) -> None:
    names = {name.split("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
    assert {name for name in names if not name.endswith(".dist-info")} == {"pbcs_ompl"}


def test_the_wheel_holds_what_the_checkout_holds(wheel: Path) -> None:
    packed = set(zipfile.ZipFile(wheel).namelist())
    package = ROOT / "pbcs_ompl"
    found = {Path(folder, name).relative_to(ROOT).as_posix()
             for folder, _, names in os.walk(package, followlinks=True) for name in names
             if "__pycache__" not in folder and not name.startswith(".")}
    assert found - packed == set()


def test_a_project_with_its_own_envs_and_planners(python: Path, project: Path) -> None:
    where = run(python, project, "-c", "import pbcs_ompl, envs, planners; print(pbcs_ompl.__file__, envs.mine)")
    assert str(python.parents[1]) in where
    pbcs = (str(python.parent / "pbcs"),)
    words = (*pbcs, "plan", "--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 2}', "--json", "--out", "found")
    assert json.loads(run(python, project, *words).splitlines()[-1])["replay_ok"]
    run(python, project, "-c", "import pbcs_ompl\n"
        "assert pbcs_ompl.plan('pbcs/Maze-v0', 'KPIECE1', env_kwargs={'size': 2}).replay_ok")


def test_the_studies_are_installed(python: Path, project: Path) -> None:
    listed = run(python, project, str(python.parent / "pbcs"), "study", "--list", "--json")
    studies = json.loads(listed.splitlines()[-1])["studies"]
    assert {"maze-table", "deadlock", "toy-analysis"} <= studies.keys()
