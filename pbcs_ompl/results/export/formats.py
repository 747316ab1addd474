"""From a result folder to the files of another tool."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.bridge.tree import load_tree
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption, RunFolderError, UnknownName
from pbcs_ompl.core.options import check_range
from pbcs_ompl.experiments.compare import DATABASE
from pbcs_ompl.resettable import make
from pbcs_ompl.results.export.controller_data import ControllerData, controller_data
from pbcs_ompl.results.export.episodes import Episode, Recorder, driven_episodes, planned_episode, tree_episodes
from pbcs_ompl.results.export.maniskill import write_maniskill
from pbcs_ompl.results.export.minari_dataset import write_minari
from pbcs_ompl.results.export.numpy_controller import write_numpy
from pbcs_ompl.results.export.onnx_controller import write_onnx
from pbcs_ompl.results.export.stable_baselines import write_stable_baselines
from pbcs_ompl.results.export.tables import write_runs, write_steps
from pbcs_ompl.results.files import CHAIN, CONFIG, FOLLOWER, TRAJECTORY, TREE, write_errors
from pbcs_ompl.results.folder import read_config
from pbcs_ompl.skills.chain import SkillChain
from pbcs_ompl.skills.chain_files import STRUCTURE
from pbcs_ompl.skills.load_chain import load_chain
from pbcs_ompl.skills.path_following.chain import FollowChain
from pbcs_ompl.skills.robots.evaluation import check_robot, planned_line
from pbcs_ompl.skills.robots.follower import STRUCTURE as FOLLOWER_STRUCTURE
from pbcs_ompl.skills.robots.follower import RobotFollower, shipped_followers

MOST = 100_000
"""Episodes of an export."""


@dataclass(frozen=True)
class Export:
    """What an export wrote.

    Attributes:
        to: The format.
        out: The folder.
        files: The files, or folders of data sets.
        episodes: How many episodes they hold; None for formats without.
        successes: In how many of them the goal was granted; None for formats without.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", seed=0, out="runs/maze")
        >>> pbcs_ompl.export("runs/maze", to="csv", out="tables").out
        'tables'
    """

    to: str
    out: str
    files: list[str]
    episodes: int | None = None
    successes: int | None = None

    def summary(self) -> dict[str, Any]:
        """Return plain values."""
        return {"to": self.to, "out": self.out, "files": self.files, "episodes": self.episodes,
                "successes": self.successes}


class Request(NamedTuple):
    """What is exported, how many episodes, how noisy and with which seed; `path` is the plan of a robot's follower."""

    folder: Path
    out: Path
    episodes: int
    epsilon: float
    seed: int
    path: Path | None
    trust: bool


@checked
def export(folder: str | Path, to: str, *, out: str | Path, episodes: int = 10, epsilon: float = 0.0, seed: int = 0,
           path: str | Path | None = None, trust: bool = False) -> Export:
    """Write what a folder holds in the format of another tool.

    Args:
        folder: That of `train`, `plan`, `distill` or `compare`, a chain, or the name of a follower of the package.
        to: The format, one of `FORMATS`.
        out: A new folder.
        episodes: Of formats that hold episodes: how many a controller drives, and how many paths of a tree are taken.
        epsilon: Of these: fraction of the controller's actions that are replaced by random ones.
        seed: Of the random actions.
        path: A plan: the line that a robot's follower begins with.
        trust: Let the modules that the folder names be imported.

    Raises:
        UnknownName: no such format.
        InvalidOption: the folder holds nothing for this format.
        MissingDependency: the format's library is not installed; the message says which.
        RunFolderError: `out` is not empty, or cannot be written.
        DamagedFile: a file in the folder is damaged.
        NotVerified: no fresh environment can be made, in which episodes are recorded.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", seed=0, out="runs/maze")
        >>> pbcs_ompl.export("runs/maze", to="numpy", out="my_robot").to
        'numpy'
    """
    if to not in FORMATS:
        raise UnknownName("format", to, FORMATS)
    check_range("episodes", episodes, 0 <= episodes <= MOST, f"from 0 to {MOST}")
    check_range("epsilon", epsilon, 0 <= epsilon <= 1, "within [0, 1]")
    request = Request(_found(Path(folder)), Path(out), episodes, epsilon, seed, None if path is None else Path(path),
                      trust)
    with write_errors(request.out):
        if request.out.exists() and any(request.out.iterdir()):
            raise RunFolderError(f"{request.out} is not empty; choose another --out")
    return FORMATS[to].write(to, request)


def _found(folder: Path) -> Path:
    """Return a folder, or that of the follower of this name in the package."""
    if not folder.exists() and str(folder) in shipped_followers():
        return shipped_followers()[str(folder)]
    if not folder.is_dir():
        raise RunFolderError(f"{folder} is not a folder")
    return folder


def _controller(request: Request) -> SkillChain | FollowChain | RobotFollower | None:
    """Return the controller in a folder; None where there is none."""
    for place in (request.folder / FOLLOWER, request.folder):
        if (place / FOLLOWER_STRUCTURE).is_file():
            return RobotFollower.load(place, trust=request.trust)
    for place in (request.folder / CHAIN, request.folder):
        if (place / STRUCTURE).is_file():
            loaded = load_chain(place, trust=request.trust)
            return loaded if isinstance(loaded, SkillChain | FollowChain) else None
    return None


def _data(to: str, request: Request) -> ControllerData:
    controller = _controller(request)
    if controller is None:
        raise InvalidOption(f"{request.folder} holds no controller; --to {to} takes a folder of pbcs train or distill")
    if not isinstance(controller, RobotFollower):
        if request.path is not None:
            raise InvalidOption("--path is for a robot's follower; this controller has a task of its own")
        return controller_data(controller)
    if request.path is None:
        return controller_data(controller)
    file = request.path / TRAJECTORY if request.path.is_dir() else request.path
    trajectory = Trajectory.load(file, trust=request.trust)
    model = make(trajectory.environment)
    check_robot(controller, model)
    return controller_data(controller, planned_line(controller, model, trajectory))


def _numpy(to: str, request: Request) -> Export:
    return _files(to, request, write_numpy(_data(to, request), request.out))


def _onnx(to: str, request: Request) -> Export:
    return _files(to, request, write_onnx(_data(to, request), request.out))


def _files(to: str, request: Request, files: list[Path], episodes: list[Episode] | None = None) -> Export:
    names = [str(file) for file in files]
    if episodes is None:
        return Export(to, str(request.out), names)
    return Export(to, str(request.out), names, len(episodes), sum(bool(one.success[-1]) for one in episodes))


def _with_episodes(write: Callable[[Recorder, list[Episode], Path], list[Path]]) -> "Writer":
    """Return the writer of a format that holds episodes."""

    def written(to: str, request: Request) -> Export:
        with Recorder(make(_task(to, request))) as recorder:
            episodes = _episodes(to, request, recorder)
            return _files(to, request, write(recorder, episodes, request.out), episodes)

    return written


def _task(to: str, request: Request) -> EnvSpec:
    """Return the environment of a folder whose episodes are exported."""
    controller = _controller(request)
    if isinstance(controller, SkillChain | FollowChain):
        return controller.environment
    if (request.folder / TRAJECTORY).is_file():
        return Trajectory.load(request.folder / TRAJECTORY, trust=request.trust).environment
    if (request.folder / CONFIG).is_file() and (request.folder / TREE).is_file():
        return EnvSpec.from_dict(read_config(request.folder, "plan")["environment"], trusted=request.trust)
    raise InvalidOption(f"{request.folder} holds no episodes; --to {to} takes a folder of pbcs plan, train or distill")


def _episodes(to: str, request: Request, recorder: Recorder) -> list[Episode]:
    """Return the episodes of a folder: its plan, what its controller drives, the best paths of its tree."""
    folder, found, seed = request.folder, [], None
    if (folder / TRAJECTORY).is_file():
        trajectory = Trajectory.load(folder / TRAJECTORY, trust=request.trust)
        trajectory.check_belongs_to(recorder.model)
        seed = trajectory.reset_seed
        found.append(planned_episode(recorder, trajectory))
    controller = _controller(request)
    if isinstance(controller, SkillChain | FollowChain):
        found += driven_episodes(recorder, controller, count=request.episodes, epsilon=request.epsilon,
                                 seed=request.seed)
    if (folder / TREE).is_file():
        config = read_config(folder, "plan")
        start = recorder.model.spec.reset_seed(config["seed"]) if seed is None else seed
        found += tree_episodes(recorder, load_tree(folder / TREE), start, request.episodes)
    if not found:
        raise InvalidOption(f"{folder} holds no episode that can be made again, so there is nothing for --to {to}")
    return found


def _stable_baselines(to: str, request: Request) -> Export:
    controller = _controller(request)
    chain = controller if isinstance(controller, SkillChain | FollowChain) else None

    def write(recorder: Recorder, episodes: list[Episode], folder: Path) -> list[Path]:
        return write_stable_baselines(recorder, episodes, folder, chain)

    return _with_episodes(write)(to, request)


def _is_comparison(request: Request) -> bool:
    return (request.folder / CONFIG).is_file() and read_config(request.folder)["kind"] == "compare"


def _csv(to: str, request: Request) -> Export:
    if _is_comparison(request):
        return _files(to, request, write_runs(request.folder, request.out))
    return _with_episodes(write_steps)(to, request)


def _planner_arena(to: str, request: Request) -> Export:
    database = request.folder / DATABASE
    if not _is_comparison(request) or not database.is_file():
        raise InvalidOption(f"{request.folder} holds no finished comparison; --to {to} takes a folder of pbcs compare")
    with write_errors(request.out):
        request.out.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(database, request.out / DATABASE)
    return _files(to, request, [request.out / DATABASE])


Writer = Callable[[str, Request], Export]


class Format(NamedTuple):
    """A format: how it is written, and what it is."""

    write: Writer
    meaning: str


FORMATS: dict[str, Format] = {
    "numpy": Format(_numpy, "a controller as one Python file and one npz, which need NumPy alone"),
    "onnx": Format(_onnx, "a controller as one ONNX graph"),
    "sb3": Format(_stable_baselines, "a TD3 of stable-baselines3 with actor and replay buffer"),
    "minari": Format(_with_episodes(write_minari), "episodes as Minari data sets, with the simulator's states"),
    "maniskill": Format(_with_episodes(write_maniskill), "episodes as ManiSkill's trajectory.h5 and trajectory.json"),
    "planner-arena": Format(_planner_arena, "the database of a comparison, for Planner Arena"),
    "csv": Format(_csv, "the steps of episodes, or the runs of a comparison, as a table"),
}
