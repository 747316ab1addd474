"""Options of the command line, as words: what a person may paste into a shell after `shlex.join`."""

import json
from typing import Any

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.plain import plain


def environment_words(spec: EnvSpec) -> list[str]:
    """Return the options that name an environment."""
    return ["--env", spec.id, *json_words("--env-kwargs", spec.kwargs), *rule_words(spec)]


def rule_words(spec: EnvSpec) -> list[str]:
    """Return the options of goal, feature and start."""
    rules = {"--goal": spec.goal, "--feature": spec.feature, "--start-seed": spec.start_seed}
    return [f"{name}={value}" for name, value in rules.items() if value is not None]


def json_words(option: str, values: dict[str, Any]) -> list[str]:
    """Return an option whose value is a JSON object; nothing where that is empty."""
    return [option, json.dumps(values, default=plain)] if values else []
