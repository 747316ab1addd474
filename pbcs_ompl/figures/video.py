"""A film of states of an environment, as the environment itself renders them."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.errors import InvalidOption, MissingDependency, NotResettable
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.rendering import check_can_render
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.adapters.mujoco import MujocoEnv
from pbcs_ompl.results.files import write_atomically

KINDS = (".mp4", ".gif")
FRAMES_A_SECOND = 30
"""Environments whose own rate is unknown are shown at 30 frames a second."""


def check_video(path: str | Path) -> None:
    """Refuse a file name of which no video can be made.

    Raises:
        InvalidOption: the name does not end in one of `KINDS`, or the file exists.
        MissingDependency: imageio is not installed.
    """
    path = Path(path)
    if path.suffix not in KINDS:
        raise InvalidOption(f"--video {path}: expected a name that ends in {', '.join(KINDS)}")
    if path.exists():
        raise InvalidOption(f"--video {path} already exists; choose another name, or remove it first")
    _imageio()


def write_video(model: ResettableModel, states: Array, path: str | Path) -> Path:
    """Write a film of `states` [T, D] of `model`, atomically, and return its path.

    Raises:
        InvalidOption: see `check_video`.
        MissingDependency: imageio, or what the environment renders with, is not installed.
        NotResettable: the environment cannot be made to render, or go to these states.
        RunFolderError: the file cannot be written.
    """
    check_video(path)
    path, frames = Path(path), _frames(model, states)
    first = next(frames)

    def write(file: Any) -> None:
        rate = {"duration": 1000 / _rate(model), "loop": 0} if path.suffix == ".gif" else {"fps": _rate(model)}
        with _imageio().get_writer(file, format=path.suffix, mode="I", **rate) as writer:
            writer.append_data(first)
            for frame in frames:
                writer.append_data(frame)

    write_atomically(path, write)
    return path


def _frames(model: ResettableModel, states: Array) -> Iterator[NDArray[np.uint8]]:
    """Yield an image [H, W, 3] of each state."""
    env = make(replace(model.spec, kwargs={**model.spec.kwargs, "render_mode": "rgb_array"})).env
    if isinstance(env, MujocoEnv):
        check_can_render()
    for state in states:
        env.set_env_state(np.array(state))
        try:
            frame = env.render()
        except gymnasium.error.DependencyNotInstalled as error:
            raise MissingDependency(f"{model.spec.id} cannot render: {error}") from error
        if frame is None:
            raise NotResettable(f"{model.spec.id} renders nothing for render_mode='rgb_array'")
        yield np.asarray(frame, dtype=np.uint8)
    env.close()


def _rate(model: ResettableModel) -> int:
    return int(model.env.metadata.get("render_fps", FRAMES_A_SECOND))


def _imageio() -> Any:
    try:
        import imageio.v2
        import imageio_ffmpeg  # noqa: F401
    except ModuleNotFoundError as error:
        raise MissingDependency(f"videos need {error.name}: pip install 'pbcs-ompl[video]'") from error
    return imageio.v2
