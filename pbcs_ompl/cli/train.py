"""`pbcs train`: plan a trajectory, train a chain of skills along it, draw both."""

from argparse import Namespace
from pathlib import Path
from typing import Any

from pbcs_ompl.bridge.plan import TRAJECTORY
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.cli.arguments import build_parser
from pbcs_ompl.cli.folders import environment_words, fresh_folder
from pbcs_ompl.cli.pictures import draw_chain
from pbcs_ompl.cli.terminal import Report, conclude, duration, list_files, percent, short
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.run_folder import CONFIG, read_toml
from pbcs_ompl.reset_anywhere import make
from pbcs_ompl.skills import train


def run(arguments: Namespace) -> int:
    """Train, draw, report. Returns 1 when the chain does not reach the goal."""
    settings = _resumed(arguments) if arguments.resume else _new(arguments)
    out = Path(settings["out"])
    try:
        with Report("train", budget=settings.get("max_transitions")) as report:
            result = train(on_progress=report, **settings)
    except KeyboardInterrupt:
        if (out / CONFIG).is_file():
            raise KeyboardInterrupt(f"go on with: pbcs train --resume {out}") from None
        raise
    summary = result.summary()
    if result.chain is not None:
        _draw(result.chain, out, summary)
    conclude(summary, _closing_lines(summary, out), as_json=arguments.json)
    return 0 if result.solved else 1


def _new(arguments: Namespace) -> dict[str, Any]:
    """Return the settings of a new run."""
    if arguments.env is None:
        raise InvalidOption("--env is missing (see pbcs train --help)")
    settings = {name: getattr(arguments, name) for name in ("env", "env_kwargs", "method", "agent", "preset",
                                                            "seed", "max_transitions")}
    settings["trajectory"] = None if arguments.path is None else _read_trajectory(Path(arguments.path))
    settings["out"] = arguments.out or fresh_folder("train", arguments.env, arguments.method, arguments.seed)
    return settings


def _resumed(arguments: Namespace) -> dict[str, Any]:
    """Return the settings of the run that is resumed; they all come from its folder."""
    defaults = vars(build_parser().parse_args(["train"]))
    surplus = [name for name, value in vars(arguments).items()
               if name not in ("resume", "json") and value != defaults[name]]
    if surplus:
        raise InvalidOption(f"--resume takes every setting from {arguments.resume}; remove "
                            f"--{surplus[0].replace('_', '-')}")
    folder = Path(arguments.resume)
    config = read_toml(folder / CONFIG)
    ...


def _read_trajectory(path: Path) -> Trajectory:
    return Trajectory.load(path / TRAJECTORY if path.is_dir() else path)
