"""Episodes as ManiSkill keeps demonstrations: trajectory.h5 and trajectory.json, which code of reverse curricula reads.

Source of the format: the documentation of ManiSkill, "Trajectory Datasets"; RFCL reads the same fields.
"""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pbcs_ompl.core.errors import MissingDependency
from pbcs_ompl.results.export.episodes import Episode, Recorder, stacked
from pbcs_ompl.results.files import write_atomically, write_json


def write_maniskill(recorder: Recorder, episodes: Sequence[Episode], folder: Path) -> list[Path]:
    """Write trajectory.h5 and trajectory.json, and return their paths.

    Args:
        recorder: Of the task.
        episodes: What to write; `traj_0`, `traj_1`, ... in the file.
        folder: Where.

    Raises:
        MissingDependency: h5py is not installed.
        RunFolderError: a file cannot be written.
    """
    try:
        import h5py
    except ModuleNotFoundError as error:
        raise MissingDependency('ManiSkill files are written with h5py: pip install "pbcs-ompl[maniskill]"') from error
    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        for index, episode in enumerate(episodes):
            group = file.create_group(f"traj_{index}")
            _add(group, "obs", stacked(episode.observations))
            for name, array in (("actions", episode.actions), ("env_states", episode.states),
                                ("rewards", episode.rewards), ("terminated", episode.terminated),
                                ("truncated", episode.truncated), ("success", episode.success[1:])):
                group.create_dataset(name, data=array)
    numbers, words = folder / "trajectory.h5", folder / "trajectory.json"
    write_atomically(numbers, lambda file: file.write(content.getvalue()))
    spec = recorder.model.spec
    write_json(words, {
        "env_info": {"env_id": spec.id, "env_kwargs": spec.to_dict()["kwargs"],
                     "max_episode_steps": recorder.model.episode_limit},
        "source_type": "motionplanning", "source_desc": "pbcs_ompl",
        "episodes": [_described(index, episode, recorder) for index, episode in enumerate(episodes)]})
    return [numbers, words]


def _described(index: int, episode: Episode, recorder: Recorder) -> dict[str, Any]:
    done = bool(episode.success[-1])
    return {"episode_id": index, "episode_seed": episode.reset_seed, "control_mode": None,
            "elapsed_steps": episode.length, "success": done, "info": {"success": done}, "source": episode.source,
            "reset_kwargs": {"seed": episode.reset_seed, "options": recorder.model.spec.reset_options or {}}}


def _add(group: Any, name: str, observations: Any) -> None:
    """Add observations: an array, or a group of them."""
    if isinstance(observations, dict | tuple):
        inner = group.create_group(name)
        parts = observations if isinstance(observations, dict) else dict(enumerate(observations))
        for key, part in parts.items():
            _add(inner, str(key), part)
    else:
        group.create_dataset(name, data=observations)
