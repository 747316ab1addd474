"""Films of states, and clear words where none can be made."""

import sys
from pathlib import Path

import numpy as np
import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import InvalidOption, MissingDependency, NoResetAnywhere
from pbcs_ompl.core.rendering import check_can_render, prefer_headless_rendering
from pbcs_ompl.figures.video import check_video, write_video
from pbcs_ompl.reset_anywhere import make

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
    with pytest.raises((InvalidOption, NoResetAnywhere)):
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
