"""Progress for other tools: TensorBoard, Weights & Biases, trackio; each is one optional library."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from pbcs_ompl.core.errors import MissingDependency

TAGS = {"success_rate": "rollout/success_rate", "actor_loss": "train/actor_loss", "critic_loss": "train/critic_loss",
        "updates": "train/n_updates", "transitions": "time/total_timesteps", "covered": "pbcs/covered",
        "skills": "pbcs/skills", "start": "pbcs/start"}
"""The names that stable-baselines3 uses for the same numbers; `pbcs/` for what only we have."""
Track = Callable[[Mapping[str, Any]], None]


@contextmanager
def tracker(name: str, folder: Path) -> Iterator[Track]:
    """Give what takes the plain numbers of a `ProgressCallback` to a tool; it begins with the first of training.

    Args:
        name: One of `TRACKERS`.
        folder: Of the training; its name is that of the run.

    Raises:
        MissingDependency: the tool is not installed.
    """
    if find_spec(name) is None:
        raise MissingDependency(f'--track {name} needs {name}: pip install "pbcs-ompl[{name}]"')
    begun: list[Writer] = []

    def track(numbers: Mapping[str, Any]) -> None:
        if numbers.get("phase") == "train":
            if not begun:
                begun.append(TRACKERS[name](folder))
            begun[0][0]({tag: float(numbers[key]) for key, tag in TAGS.items() if numbers.get(key) is not None},
                        int(numbers["transitions"]))

    try:
        yield track
    finally:
        for _, close in begun:
            close()


Writer = tuple[Callable[[dict[str, float], int], None], Callable[[], None]]
"""What writes numbers by tag at a step, and what closes the run."""


def _tensorboard(folder: Path) -> Writer:
    from torch.utils.tensorboard import SummaryWriter

    events = SummaryWriter(str(folder / "tensorboard"))

    def write(numbers: dict[str, float], step: int) -> None:
        for tag, value in numbers.items():
            events.add_scalar(tag, value, step)

    return write, events.close


def _like_wandb(module: str) -> Callable[[Path], Writer]:
    def start(folder: Path) -> Writer:
        library = import_module(module)
        library.init(project="pbcs_ompl", name=folder.name)
        return lambda numbers, step: library.log(numbers, step=step), library.finish

    return start


TRACKERS: dict[str, Callable[[Path], Writer]] = {
    "tensorboard": _tensorboard, "wandb": _like_wandb("wandb"), "trackio": _like_wandb("trackio")}
