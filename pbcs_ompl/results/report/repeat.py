"""The commands that repeat or resume a run, from the settings in its folder."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.registry import names
from pbcs_ompl.core.trust import config_modules, is_module_name
from pbcs_ompl.experiments.study import SWEEP, study_folders
from pbcs_ompl.resettable.make import is_known
from pbcs_ompl.results.command_line import (
    BUDGETS,
    Words,
    command,
    compare_words,
    distill_words,
    eval_words,
    follower_words,
    plan_words,
    resume_words,
    study_words,
    train_words,
    view_words,
)
from pbcs_ompl.results.files import CHECKPOINT, PLAN, TRAJECTORY, is_there, read_json, read_toml
from pbcs_ompl.results.folder import Folder
from pbcs_ompl.results.schema import PlanEffort


def repeating(folder: Folder) -> str:
    """Return what repeats a run: a command line or a Python script; "" where the settings name what is not available.

    That is so for environments, planners and agents that were given as Python objects, and for studies that are not
    here or were changed.
    """
    if not _is_available(folder):
        return ""
    if folder.kind == "compare" and not _fits_command_line(folder.config):
        return _comparison_script(folder.config)
    words = _words(folder)
    return command(words) if words else ""


def resuming(folder: Folder) -> str:
    """Return the command that resumes a run that has not ended; "" for one that has."""
    if folder.kind == "train" and (folder.result is None or is_there(folder.path / CHECKPOINT)):
        budget = 2 * folder.config["max_transitions"] if folder.result else None
        return command(resume_words(folder.path, budget, trust=_names_modules(folder.config)))
    if folder.kind == "follower" and folder.result is None:
        return command(resume_words(folder.path, trust=bool(EnvSpec.from_dict(folder.config["environment"]).modules)))
    if folder.kind in ("compare", "study") and folder.result is None and repeating(folder).startswith("pbcs "):
        return command([*_words(folder), "--out", str(folder.path)])
    return ""


def viewing(folder: Folder) -> str:
    """Return the command that shows a plan or a training in three dimensions; "" for other folders.

    A report holds no such page: it would run scripts, and needs the environment, which a report does not make.
    """
    if folder.kind not in ("plan", "train") or folder.result is None or not _is_available(folder):
        return ""
    return command(view_words(folder.path, trust=_names_modules(folder.config)))


def _is_available(folder: Folder) -> bool:
    config = folder.config
    environments = [config["environment"]] if "environment" in config else config.get("environments", [])
    planners = [config["planner"]] if "planner" in config else config.get("planners", [])
    agents = [config["agent"]] if folder.kind == "train" else []
    return folder.kind == "study" or (
        all(_is_environment(EnvSpec.from_dict(one).id) for one in environments)
        and all(_is_registered("agent", name) for name in agents)
        and all(_is_registered("planner", name) for name in planners))


def _names_modules(config: dict[str, Any]) -> bool:
    return bool(config_modules(config) or EnvSpec.from_dict(config["environment"]).modules)


def _is_environment(env_id: str) -> bool:
    """Return whether an id can be typed; a module that it names is not imported to see whether it is there."""
    return is_module_name(env_id) or is_known(env_id)


def _is_registered(kind: str, name: str) -> bool:
    return is_module_name(name) or name.lower() in map(str.lower, names(kind))


def _fits_command_line(config: dict[str, Any]) -> bool:
    """Return whether `pbcs compare` can express it: its seeds start at 0, and its memory is in whole MB."""
    return (config["seeds"] == list(range(len(config["seeds"])))
            and float(config.get("max_memory", 0)).is_integer())


def _words(folder: Folder) -> Words:
    config = folder.config
    words: dict[str, Callable[[], Words]] = {
        "plan": lambda: plan_words(config),
        "train": lambda: train_words(config, _given_trajectory(folder.path)),
        "eval": lambda: eval_words(config["chain"], episodes=config["episodes"], epsilon=config["epsilon"],
                                   trust=bool(EnvSpec.from_dict(config["environment"]).modules)),
        "compare": lambda: compare_words(config),
        "study": lambda: _study_words(config),
        "follower": lambda: follower_words(config), "distill": lambda: distill_words(config)}
    return words[folder.kind]()


def _given_trajectory(folder: Path) -> Path | None:
    """Return the trajectory that a training was given; None where it was planned, which takes a transition at least."""
    given = is_there(folder / PLAN) and read_json(folder / PLAN, PlanEffort)["transitions"] == 0
    return folder / TRAJECTORY if given else None


def _study_words(config: dict[str, Any]) -> Words:
    """Return nothing if no study that is available has this name and this sweep: it would be another study."""
    sweep = {key: value for key, value in config.items() if key not in ("kind", "study", "folder", "seeds")}
    places = [(name, place) for name, place in study_folders().items() if name == config["study"]]
    if "folder" in config:
        folder = Path(config["folder"]).expanduser()
        places.append((str(folder), folder))
    device = {key: sweep[key] for key in ("device",) if key in sweep}  # the only value that an option replaces
    words = [word for word, place in places if (place / SWEEP).is_file() and _sweep(place) | device == sweep]
    return study_words(words[0], seeds=config.get("seeds"), **device) if words else []


def _sweep(place: Path) -> dict[str, Any]:
    return {key: value for key, value in read_toml(place / SWEEP).items() if key not in ("title", "seeds")}


def _comparison_script(config: dict[str, Any]) -> str:
    """Return the script of a comparison that the command line cannot express."""
    planners = {name: config["planner_kwargs"].get(name, {}) for name in config["planners"]}
    environments = [EnvSpec.from_dict(place) for place in config["environments"]]
    settings = {name: config[name] for name in ("seeds", *BUDGETS) if name in config}
    return "\n".join([
        "from pbcs_ompl import EnvSpec, compare", "",
        'if __name__ == "__main__":', f"    compare({planners!r},", f"            {environments!r},",
        *(f"            {name}={value!r}," for name, value in settings.items()), '            out="runs/again")'])
