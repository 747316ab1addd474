"""Tables as CSV: the steps of episodes, and the runs of a comparison."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.compare import read_comparison
from pbcs_ompl.results.export.episodes import Episode, Recorder
from pbcs_ompl.results.export.meaning import entry_names
from pbcs_ompl.results.files import write_text

RUN_COLUMNS = ("planner", "seed", "solved", "reason", "transitions", "collision_checks", "seconds", "memory", "nodes",
               "path_length", "replay_ok", "coverage")


def write_steps(recorder: Recorder, episodes: Sequence[Episode], folder: Path) -> list[Path]:
    """Write steps.csv: a row for each observation of each episode, with the action that followed.

    The last row of an episode has no action.

    Args:
        recorder: Of the task.
        episodes: What to write.
        folder: Where.
    """
    actions, states = episodes[0].actions.reshape(len(episodes[0].actions), -1).shape[1], episodes[0].states.shape[1]
    seen = entry_names(recorder.model.spec, episodes[0].vectors.shape[1])
    header = ["episode", "source", "reset_seed", "step", *seen, *(f"state[{index}]" for index in range(states)),
              *(f"action[{index}]" for index in range(actions)), "reward", "terminated", "truncated", "success"]
    path = folder / "steps.csv"
    write_text(path, _text(header, (row for index, one in enumerate(episodes) for row in _rows(index, one, actions))))
    return [path]


def _rows(index: int, episode: Episode, actions: int) -> Iterable[list[Any]]:
    vectors, flat_actions = episode.vectors, episode.actions.reshape(episode.length, actions)
    for step in range(episode.length + 1):
        done = step == episode.length
        after = [""] * (actions + 3) if done else [*flat_actions[step].tolist(), episode.rewards[step],
                                                   episode.terminated[step], episode.truncated[step]]
        yield [index, episode.source, episode.reset_seed, step, *vectors[step].tolist(),
               *episode.states[step].tolist(), *after, episode.success[step]]


def write_runs(comparison: Path, folder: Path) -> list[Path]:
    """Write runs.csv: a row for each run of a comparison.

    Args:
        comparison: The folder of `pbcs compare`.
        folder: Where.
    """
    runs = [(environment, run) for environment, planners in read_comparison(comparison).by_environment().items()
            for several in planners.values() for run in several]
    path = folder / "runs.csv"
    write_text(path, _text(["environment", *RUN_COLUMNS],
                           ([environment, *(run.get(name) for name in RUN_COLUMNS)] for environment, run in runs)))
    return [path]


def _text(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([value.item() if isinstance(value, np.generic) else value for value in row] for row in rows)
    return file.getvalue()
