"""A controller that was exported to NumPy does what it did before, in a process that has NumPy alone."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.envs.car_robot import CarRobot
from pbcs_ompl.results.export.controller_data import controller_data
from pbcs_ompl.results.export.numpy_controller import write_numpy
from pbcs_ompl.skills.robots.follower import RobotFollower
from tests.results.export.controllers import CASES, actions_of

ALONE = """
import sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"torch", "ompl", "mujoco", "numba", "gymnasium", "scipy", "pbcs_ompl", "msgspec"}:
            raise ImportError(f"{name} is not installed here")

sys.meta_path.insert(0, Refuse())
sys.path.insert(0, sys.argv[1])
import numpy as np
from controller import load

observations = np.load(sys.argv[2])
controller = load()
controller.reset(observations.shape[1])
together = [controller.act(batch) for batch in observations]
controller.reset()
alone = [controller.act(batch[0]) for batch in observations]
np.savez(sys.argv[3], together=together, alone=alone)
"""


@pytest.mark.parametrize("kind", CASES)
def test_it_does_the_same_with_numpy_alone(kind: str, tmp_path: Path) -> None:
    if kind == "ant":
        pytest.importorskip("mujoco")
    case = CASES[kind]()
    write_numpy(controller_data(case.controller, case.line), tmp_path)
    np.save(tmp_path / "seen.npy", case.observations)
    subprocess.run([sys.executable, "-I", "-c", ALONE, str(tmp_path), str(tmp_path / "seen.npy"),
                    str(tmp_path / "done.npz")], check=True)
    expected, found = actions_of(case), np.load(tmp_path / "done.npz")
    assert expected[..., 0].size == 1000
    assert found["together"].dtype == expected.dtype
    np.testing.assert_allclose(found["together"], expected, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found["alone"], expected[:, 0], rtol=0, atol=1e-6)
    assert len(np.unique(np.round(expected, 6), axis=0)) > 1


class Sliding(CarRobot):
    """One of its entries is a speed in the world, which turns with it."""

    def turned(self, observations: np.ndarray, angles: np.ndarray) -> np.ndarray:
        turned = super().turned(observations, angles)
        turned[:, 3] *= np.cos(angles)
        return turned


def test_a_robot_that_turns_in_another_way_is_refused() -> None:
    case = CASES["car"]()
    assert isinstance(case.controller, RobotFollower)
    view = replace(case.controller.view, robot=Sliding(turning=0.9))
    with pytest.raises(InvalidOption, match="shows in entries that turn in another way"):
        controller_data(replace(case.controller, view=view), case.line)
