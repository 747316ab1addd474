"""Compiled code that lies in a cache is that of the present sources."""

import subprocess
import sys
from pathlib import Path

import pytest

import pbcs_ompl
from pbcs_ompl.core.compiled import kernel_files

ROOT = Path(pbcs_ompl.__file__).parent
LEAVES = {"replay.py", "coverage.py", "study.py", "sight.py"}
"""Files whose kernels no others call; Numba sees by itself when they change."""
CALLED = """
from pbcs_ompl.core import compiled
@compiled.njit()
def called():
    return {}
"""
CALLER = """
from pbcs_ompl.core import compiled
from called import called
@compiled.njit()
def caller():
    return 10 * called()
"""
MAIN = """
from pathlib import Path
from pbcs_ompl.core import compiled
usual = compiled.kernel_files
compiled.kernel_files = lambda: [*usual(), Path("called.py")]
from caller import caller
print(caller())
"""


@pytest.mark.slow
def test_a_kernel_is_compiled_again_when_one_that_it_calls_has_changed(tmp_path):
    (tmp_path / "caller.py").write_text(CALLER)
    (tmp_path / "main.py").write_text(MAIN)
    printed = []
    for number in (1, 2, 2, 1):
        (tmp_path / "called.py").write_text(CALLED.format(number))
        done = subprocess.run([sys.executable, "main.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        printed.append(done.stdout.strip())
    assert printed == ["10", "20", "20", "10"]
    assert len(list((tmp_path / "__pycache__").glob("caller.caller-*.nbi"))) == 2


def test_all_kernels_are_looked_at():
    def python(folder):
        return {path.resolve() for path in folder.rglob("*.py")}

    sources = python(ROOT) | python((ROOT / "planners").resolve()) | python((ROOT / "envs").resolve())
    compiled = {path for path in sources if "njit(" in path.read_text("utf-8")}
    seen = {path.resolve() for path in kernel_files()}
    assert {path.name for path in compiled - seen} == LEAVES
    called_from = [path for path in seen for line in path.read_text("utf-8").splitlines()
                   if "import" in line and any(f".{Path(leaf).stem} " in line for leaf in LEAVES)]
    assert not called_from


def test_compiled_code_is_loaded_without_scipy_which_others_can_still_call():
    code = """
import sys, pbcs_ompl.core.step_kernels
from numba.np import arraymath, linalg
assert "scipy.linalg" not in sys.modules
linalg.ensure_blas()
assert "scipy.linalg" in sys.modules and arraymath._HAVE_BLAS
"""
    subprocess.run([sys.executable, "-c", code], check=True)
