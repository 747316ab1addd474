"""Episodes as a Minari data set, with the simulator's states in its `infos`."""

import os
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pbcs_ompl.core.errors import MissingDependency
from pbcs_ompl.results.export.episodes import Episode, Recorder, stacked
from pbcs_ompl.results.files import write_errors

ROOT = "MINARI_DATASETS_PATH"


def write_minari(recorder: Recorder, episodes: Sequence[Episode], folder: Path) -> list[Path]:
    """Write a data set for each source of episodes, called as maze/plan-v0, and return their folders.

    `minari.load_dataset` finds them where the environment variable MINARI_DATASETS_PATH is `folder`. `infos["state"]`
    holds the states [T+1, D], `infos["success"]` whether the goal was granted.

    Raises:
        MissingDependency: minari is not installed.
        RunFolderError: a file cannot be written.
    """
    try:
        import h5py  # noqa: F401  what Minari keeps data in
        import minari
        from minari import data_collector
    except ModuleNotFoundError as error:
        raise MissingDependency('data sets of Minari need minari: pip install "pbcs-ompl[minari]"') from error
    buffer: Any = data_collector.EpisodeBuffer  # arrays will do, whatever its types say
    sources = list(dict.fromkeys(episode.source for episode in episodes))
    with write_errors(folder), _root(folder), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of Minari, about authors that it is not given
        for source in sources:
            buffers = [buffer(
                id=index, seed=episode.reset_seed, options=recorder.model.spec.reset_options,
                observations=stacked(episode.observations), actions=episode.actions, rewards=episode.rewards.tolist(),
                terminations=episode.terminated.tolist(), truncations=_cut(episode),
                infos={"state": episode.states, "success": episode.success})
                for index, episode in enumerate(one for one in episodes if one.source == source)]
            minari.create_dataset_from_buffers(
                dataset_id(recorder, source), buffers, env=recorder.env, algorithm_name=f"pbcs_ompl {source}",
                description=f"pbcs_ompl: {recorder.model.spec.label}", data_format="hdf5")
    return [folder / dataset_id(recorder, source) for source in sources]


def dataset_id(recorder: Recorder, source: str) -> str:
    """Return the id of the data set of a source of episodes: the environment's name, and the source."""
    name = recorder.model.spec.id.rpartition("/")[2].rpartition(":")[2]
    words = re.sub(r"[^a-z0-9]+", "-", re.sub(r"-v\d+$", "", name).lower()).strip("-")
    return f"{words or 'environment'}/{source}-v0"


def _cut(episode: Episode) -> list[bool]:
    """Return the truncations: an episode that we ended, at the goal or after the plan, is truncated."""
    cut: list[bool] = episode.truncated.tolist()
    if cut and not episode.terminated[-1]:
        cut[-1] = True
    return cut


@contextmanager
def _root(folder: Path) -> Iterator[None]:
    """Let Minari write into a folder."""
    before = os.environ.get(ROOT)
    os.environ[ROOT] = str(folder.resolve())
    try:
        yield
    finally:
        if before is None:
            del os.environ[ROOT]
        else:
            os.environ[ROOT] = before
