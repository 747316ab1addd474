"""The commands that repeat a run, from the settings in its folder."""

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.plain import plain
from pbcs_ompl.core.registry import names
from pbcs_ompl.experiments.study.study import SWEEP, study_folders
from pbcs_ompl.resettable.make import is_known
from pbcs_ompl.results.command_words import environment_words, json_words, rule_words
from pbcs_ompl.results.folder import read_json, read_toml
from pbcs_ompl.results.report.folder import Folder

Words = list[str]
BUDGET = ("max_transitions", "max_seconds", "max_memory")
PLAN, TRAJECTORY, CHECKPOINT = "plan.json", "trajectory.npz", "checkpoint.npz"


def repeating(folder: Folder) -> str:
    """Return what repeats a run: a command line or a Python script; "" where the settings name what is not at hand.

    That is so for environments, planners and agents that were handed over as Python objects, and for studies that are
    not here or were changed.
    """
    if not _at_hand(folder):
        return ""
    if folder.kind == "compare" and not _fits_command_line(folder.config):
        return _comparison_script(folder.config)
    words = _words(folder)
    return shlex.join(["pbcs", *words]) if words else ""


def going_on(folder: Folder) -> str:
    """Return the command that goes on with a run that has not ended; "" for one that has."""
    if folder.kind == "train" and (folder.result is None or (folder.path / CHECKPOINT).is_file()):
        budget = ["--max-transitions", str(2 * folder.config["max_transitions"])] if folder.result else []
        return shlex.join(["pbcs", "train", "--resume", str(folder.path), *budget])
    if folder.kind in ("compare", "study") and folder.result is None and repeating(folder).startswith("pbcs "):
        return f"{repeating(folder)} {shlex.join(['--out', str(folder.path)])}"
    return ""


def _at_hand(folder: Folder) -> bool:
    config = folder.config
    environments = {config["env"]} if "env" in config else {place["env"] for place in config.get("environments", [])}
    planners = {config["planner"]} if "planner" in config else set(config.get("planners", []))
    agents = {config["agent"]} if folder.kind == "train" else set()
    return folder.kind == "study" or (
        all(map(is_known, environments)) and all(_is_registered("agent", name) for name in agents)
        and all(_is_registered("planner", name) for name in planners))


def _is_registered(kind: str, name: str) -> bool:
    return ":" in name or name.lower() in map(str.lower, names(kind))


def _fits_command_line(config: dict[str, Any]) -> bool:
    """Return whether `pbcs compare` can say it: it counts seeds from 0, and memory in whole MB."""
    return (config["seeds"] == list(range(len(config["seeds"])))
            and float(config.get("max_memory", 0)).is_integer())


def _words(folder: Folder) -> Words:
    makers: dict[str, Callable[[Folder], Words]] = {
        "plan": _plan, "train": _training, "eval": _evaluation, "compare": _comparison, "study": _study}
    return makers[folder.kind](folder)


def _plan(folder: Folder) -> Words:
    config = folder.config
    return ["plan", *environment_words(EnvSpec.from_dict(config["environment"])), "--planner", config["planner"],
            *json_words("--planner-kwargs", config["planner_kwargs"]), "--seed", str(config["seed"]), *_budget(config)]


def _training(folder: Folder) -> Words:
    config = folder.config
    if (folder.path / PLAN).is_file() and read_json(folder.path / PLAN)["transitions"] == 0:
        planning = ["--path", str(folder.path / TRAJECTORY)]  # it was given: no planner finds one without a transition
    else:
        planning = ["--planner", config.get("planner", "Ex"),
                    *json_words("--planner-kwargs", config.get("planner_kwargs", {}))]
    named = [word for name in ("method", "agent", "preset", "device", "seed")
             for word in (f"--{name}", str(config[name]))]
    return ["train", *environment_words(EnvSpec.from_dict(config["environment"])), *planning, *named,
            *json_words("--settings", config["settings"]), *json_words("--agent-settings", config["agent_settings"]),
            *_budget(config)]


def _evaluation(folder: Folder) -> Words:
    config = folder.config
    return ["eval", config["chain"], "--episodes", str(config["episodes"]), "--epsilon", str(config["epsilon"])]


def _comparison(folder: Folder) -> Words:
    config, places = folder.config, folder.config["environments"]
    options = {name: chosen for name, chosen in config["planner_kwargs"].items() if chosen}
    specs = [EnvSpec.from_dict(place) for place in places]
    if len(specs) == 1:
        environments = environment_words(specs[0])
    else:
        environments = ["--env", *(spec.id for spec in specs),
                        "--env-kwargs", *(json.dumps(spec.kwargs, default=plain) for spec in specs),
                        *rule_words(specs[0])]
    return ["compare", "--planners", *config["planners"], *json_words("--planner-kwargs", options), *environments,
            "--seeds", str(len(config["seeds"])), *_budget(config)]


def _study(folder: Folder) -> Words:
    """Return nothing where no study at hand has this name and this sweep: it would be another study."""
    config = folder.config
    sweep = {key: value for key, value in config.items() if key not in ("kind", "study", "folder", "seeds")}
    seeds = ["--seeds", str(config["seeds"])] if "seeds" in config else []
    places = [(name, place) for name, place in study_folders().items() if name == config["study"]]
    places += [(config["folder"], Path(config["folder"]))] if "folder" in config else []
    device = {key: sweep[key] for key in ("device",) if key in sweep}  # the only value that an option replaces
    words = [word for word, place in places if (place / SWEEP).is_file() and _sweep(place) | device == sweep]
    return ["study", words[0], *seeds, *(word for key in device for word in (f"--{key}", device[key]))] if words else []


def _sweep(place: Path) -> dict[str, Any]:
    return {key: value for key, value in read_toml(place / SWEEP).items() if key not in ("title", "seeds")}


def _comparison_script(config: dict[str, Any]) -> str:
    """Return the script of a comparison that the command line cannot name."""
    places = config["environments"]
    planners = {name: config["planner_kwargs"].get(name, {}) for name in config["planners"]}
    settings = {name: config[name] for name in ("seeds", *BUDGET) if name in config}
    lines = [f"            {name}={value!r}," for name, value in settings.items()]
    environments = [EnvSpec.from_dict(place) for place in places]
    return "\n".join(["from pbcs_ompl.core.env_spec import EnvSpec",
                      "from pbcs_ompl.experiments.compare import compare", "", 'if __name__ == "__main__":', f"    compare({planners!r},", f"            {environments!r},",
                      *lines, '            out="runs/again")'])


def _budget(config: dict[str, Any]) -> Words:
    return [word for name in BUDGET if name in config
            for word in (f"--{name.replace('_', '-')}", str(config[name]))]
