"""The command line in words: what a person may paste into a shell to make a run, to repeat it, and to continue from it.

Each function returns the words after `pbcs`; `command` joins them. The configurations are those of config.toml.
"""

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unicodedata import category

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.formatting import is_printable
from pbcs_ompl.core.plain import plain

Words = list[str]
BUDGETS = ("max_transitions", "max_seconds", "max_memory", "improve")


def command(words: Sequence[str]) -> str:
    """Return a command line of ours, quoted for a shell."""
    return shell("pbcs", *words)


def shell(*words: str) -> str:
    """Return words quoted for a shell, in one line without control characters."""
    return " ".join(map(_quoted, words))


def _quoted(word: str) -> str:
    if not any(category(letter) in ("Cc", "Cs") for letter in word):
        return shlex.quote(word)
    bytes_in_word = word.encode(errors="surrogateescape")
    letters = (chr(byte) if 32 <= byte < 127 and chr(byte) not in "'\\" else f"\\{byte:03o}" for byte in bytes_in_word)
    return f"$'{''.join(letters)}'"


def environment_words(spec: EnvSpec) -> Words:
    """Return the options that name an environment."""
    return ["--env", spec.id, *_json_words("--env-kwargs", spec.kwargs), *_rule_words(spec)]


def plan_words(config: dict[str, Any]) -> Words:
    """Return the words of a plan."""
    return ["plan", *_environment(config), *_planner(config), "--seed", str(config["seed"]), *_budgets(config)]


def train_words(config: dict[str, Any], trajectory: Path | None = None) -> Words:
    """Return the words of a training.

    Args:
        config: Its settings.
        trajectory: The trajectory that was given to it; None where it was planned, or where there is no plan.
    """
    planning = [] if trajectory is None else ["--path", str(trajectory)]
    if "planner" in config:
        planning = _planner(config)
    named = [word for name in ("method", "agent", "preset", "device", "seed")
             for word in (f"--{name}", str(config[name]))]
    return ["train", *_environment(config), *planning, *named, *_json_words("--settings", config["settings"]),
            *_json_words("--agent-settings", config["agent_settings"]), *_budgets(config)]


def follower_words(config: dict[str, Any]) -> Words:
    """Return the words of the training of a robot's follower."""
    worlds = "[" + ", ".join(config["worlds"]) + "]"
    return ["train", "--method", "follow", "--lines", "random", *_environment(config), "--worlds", worlds, "--seed",
            str(config["seed"]), *_json_words("--settings", config["settings"]),
            *_json_words("--agent-settings", config["agent_settings"]), *_budgets(config)]


def resume_words(folder: Path, max_transitions: int | None = None, *, trust: bool = False) -> Words:
    """Return the words that resume a training in a folder.

    Args:
        folder: The folder.
        max_transitions: Another budget; None for the old one.
        trust: Import the modules that the folder names.
    """
    budget = [] if max_transitions is None else ["--max-transitions", str(max_transitions)]
    return ["train", "--resume", str(folder), *budget, *_trust(trust)]


def eval_words(folder: str | Path, *, episodes: int | None = None, epsilon: float | None = None,
               trust: bool = False) -> Words:
    """Return the words of an evaluation of the chain in a folder.

    Args:
        folder: The folder.
        episodes, epsilon: Options; None to leave them out.
        trust: Import the modules that the folder names.
    """
    options = {"--episodes": episodes, "--epsilon": epsilon}
    return ["eval", str(folder), *(word for name, value in options.items() if value is not None
                                   for word in (name, str(value))), *_trust(trust)]


def view_words(folder: Path, *, trust: bool = False) -> Words:
    """Return the words that show a folder in three dimensions; `trust` imports the modules that it names."""
    return ["view", str(folder), *_trust(trust)]


def distill_words(config: dict[str, Any]) -> Words:
    """Return the words of a distillation; none where it is not known which chain it was made from."""
    if not config["chain"]:
        return []
    trust = bool(EnvSpec.from_dict(config["environment"]).modules)
    return ["distill", config["chain"], "--seed", str(config["seed"]), *_json_words("--settings", config["settings"]),
            *_trust(trust)]


def compare_words(config: dict[str, Any]) -> Words:
    """Return the words of a comparison whose seeds are 0, 1, ..."""
    options = {name: chosen for name, chosen in config["planner_kwargs"].items() if chosen}
    specs = [EnvSpec.from_dict(place) for place in config["environments"]]
    if len(specs) == 1:
        environments = environment_words(specs[0])
    else:
        environments = ["--env", *(spec.id for spec in specs), "--env-kwargs",
                        *(_json(spec.kwargs) for spec in specs), *_rule_words(specs[0])]
    return ["compare", "--planners", *config["planners"], *_json_words("--planner-kwargs", options), *environments,
            "--seeds", str(len(config["seeds"])), *_budgets(config)]


def study_words(study: str | Path, *, seeds: int | None = None, device: str | None = None) -> Words:
    """Return the words of a study, named by its id or folder; what is None is left out."""
    options = {"--seeds": seeds, "--device": device}
    return ["study", str(study), *(word for name, value in options.items() if value is not None
                                   for word in (name, str(value)))]


def report_words(folder: Path) -> Words:
    """Return the words that write the report of a folder."""
    return ["report", str(folder)]


def _trust(trust: bool) -> Words:
    return ["--trust"] if trust else []


def _environment(config: dict[str, Any]) -> Words:
    return environment_words(EnvSpec.from_dict(config["environment"]))


def _planner(config: dict[str, Any]) -> Words:
    return ["--planner", config["planner"], *_json_words("--planner-kwargs", config["planner_kwargs"])]


def _rule_words(spec: EnvSpec) -> Words:
    rules = {"--goal": spec.goal, "--feature": spec.feature, "--start-seed": spec.start_seed}
    words = [f"{name}={value}" for name, value in rules.items() if value is not None]
    return [*words, *_json_words("--reset-options", spec.reset_options or {})]


def _json_words(option: str, values: dict[str, Any]) -> Words:
    """Return an option whose value is a JSON object; nothing where that is empty."""
    return [option, _json(values)] if values else []


def _json(values: dict[str, Any]) -> str:
    text = json.dumps(values, default=plain, ensure_ascii=False)
    return text if is_printable(text) else json.dumps(values, default=plain)


def _budgets(config: dict[str, Any]) -> Words:
    return [word for name in BUDGETS if name in config
            for word in (f"--{name.replace('_', '-')}", str(config[name]))]
