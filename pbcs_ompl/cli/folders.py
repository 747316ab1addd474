"""Where results go when the user does not say, and how to name things in the next command."""

import json
import shlex
from argparse import Namespace
from itertools import chain, count
from pathlib import Path


def fresh_folder(*words: object) -> Path:
    """Return runs/<words joined by hyphens>, with the next free number behind it when that one exists."""
    name = "-".join(str(word).rpartition("/")[2].replace(":", ".") for word in words)
    candidates = chain([name], (f"{name}-{number}" for number in count(2)))
    folders = (Path("runs") / candidate for candidate in candidates)
    return next(folder for folder in folders if not folder.exists())


def environment_words(arguments: Namespace) -> str:
    """Return the options that name the environment, ready to be pasted into a shell."""
    kwargs = f" --env-kwargs {shlex.quote(json.dumps(arguments.env_kwargs))}" if arguments.env_kwargs else ""
    return f"--env {shlex.quote(arguments.env)}{kwargs}"
