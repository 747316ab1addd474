"""Options of the command line, as words: what a person may paste into a shell after `shlex.join`."""

import json
from typing import Any

from pbcs_ompl.results.folder import plain


def environment_words(env: str, env_kwargs: dict[str, Any]) -> list[str]:
    """Return the options that name an environment. Rules, such as "--goal", are options of their own."""
    options = {name: value for name, value in env_kwargs.items() if not name.startswith("--")}
    rules = [f"{name}={value}" for name, value in env_kwargs.items() if name.startswith("--")]
    return ["--env", env, *json_words("--env-kwargs", options), *rules]


def json_words(option: str, values: dict[str, Any]) -> list[str]:
    """Return an option whose value is a JSON object; nothing where that is empty."""
    return [option, json.dumps(values, default=plain)] if values else []
