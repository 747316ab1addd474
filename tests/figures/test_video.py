"""Films of states, and clear words where none can be made."""

import ctypes.util
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import InvalidOption, MissingDependency, NotResettable
from pbcs_ompl.core.rendering import check_can_render, prefer_headless_rendering
from pbcs_ompl.figures.video import check_video, write_video
from pbcs_ompl.resettable import make

MAZE = make("pbcs/Maze-v0")
STATES = np.linspace([0.5, 0.5], [1.5, 0.5], 12)


@pytest.mark.parametrize("ending", [".mp4", ".gif"])
def test_a_film_has_a_frame_for_each_state(ending: str, tmp_path: Path) -> None:
    imageio = pytest.importorskip("imageio.v2")
    pytest.importorskip("imageio_ffmpeg")
    path = write_video(MAZE, STATES, tmp_path / f"film{ending}")
    frames = [frame for frame in imageio.get_reader(path)]
    assert len(frames) == 12
    assert frames[0].shape[:2] == (480, 480)
    assert np.abs(frames[0][..., :3].astype(int) - frames[-1][..., :3]).max() > 100


def test_a_plan_is_filmed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("imageio_ffmpeg")
    monkeypatch.chdir(tmp_path)
    assert main(["plan", "--env", "pbcs/Maze-v0", "--video", "path.gif"]) == 0
    assert (tmp_path / "path.gif").stat().st_size > 1000
    assert main(["plan", "--env", "pbcs/Maze-v0", "--video", "path.gif"]) == 2


def test_names_that_make_no_film(tmp_path: Path) -> None:
    with pytest.raises(InvalidOption, match=r"\.mp4, \.gif"):
        check_video(tmp_path / "film.avi")
    (tmp_path / "film.mp4").touch()
    with pytest.raises(InvalidOption, match="already exists"):
        check_video(tmp_path / "film.mp4")


def test_what_is_not_installed_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingDependency, match=r"pbcs-ompl\[video\]"):
        check_video(tmp_path / "film.mp4")


def test_an_environment_that_cannot_render(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    model = make("pbcs/Toy1D-v0")
    with pytest.raises((InvalidOption, NotResettable)):
        write_video(model, np.array([[0.5]]), tmp_path / "film.mp4")
    assert list(tmp_path.iterdir()) == []


def test_where_nothing_can_render(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    with pytest.raises(MissingDependency, match="MUJOCO_GL=egl"):
        check_can_render()
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    prefer_headless_rendering()
    check_can_render()
    monkeypatch.delenv("MUJOCO_GL")
    monkeypatch.setenv("DISPLAY", ":0")
    prefer_headless_rendering()
    check_can_render()


def test_an_ant_is_filmed(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    pytest.importorskip("mujoco")
    model = make("pbcs/AntMaze-v0")
    states, path = np.tile(model.initial_state(0), (3, 1)), tmp_path / "ant.mp4"
    try:
        check_can_render()
    except MissingDependency as error:
        with pytest.raises(MissingDependency, match=str(error)[:20]):
            write_video(model, states, path)
    else:
        write_video(model, states, path)
        assert path.stat().st_size > 1000


def test_the_camera_follows_a_restored_robot() -> None:
    pytest.importorskip("mujoco")
    model: Any = make("Ant-v5", {"render_mode": "rgb_array"})
    try:
        check_can_render()
    except MissingDependency as error:
        pytest.skip(str(error))
    start, env = model.initial_state(0), model.env
    far = start.copy()
    far[len(env.feature_dims) + 1] += 30.0  # x, behind the feature and the time
    places = []
    for state in (start, far):
        env.set_env_state(state)
        assert env.render().ndim == 3
        places.append(env.inner.data.cam_xpos[0].copy())
    np.testing.assert_allclose(places[1] - places[0], [30.0, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("chosen", ["osmesa", "nonsense"])
def test_a_renderer_that_is_not_there(chosen: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    code = "import sys; from pbcs_ompl.cli import main; sys.exit(main(['plan', '--env', 'Ant-v5']))"
    if chosen == "osmesa" and ctypes.util.find_library("OSMesa"):
        pytest.skip("OSMesa is installed here")
    variables = {name: value for name, value in os.environ.items() if name != "PYOPENGL_PLATFORM"}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=variables | {"MUJOCO_GL": chosen},
                          capture_output=True, text=True)
    assert done.returncode == 3
    (line,) = done.stderr.splitlines()
    assert f"MUJOCO_GL={chosen}: install what it names, set MUJOCO_GL=egl, or unset it" in line
