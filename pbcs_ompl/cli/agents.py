"""`pbcs agents`: what can learn, with which settings."""

from argparse import Namespace
from typing import Any

from pbcs_ompl.cli.lists import MISSING_TORCH, print_list
from pbcs_ompl.core.docstrings import first_line, meanings
from pbcs_ompl.core.errors import InvalidOption, MissingDependency
from pbcs_ompl.core.registry import names


def run(arguments: Namespace) -> int:
    """List them."""
    found = {name: described(name, arguments.preset)
             for name in ([arguments.name] if arguments.name else names("agent"))}
    print_list(found, as_json=arguments.json)
    return 0


def described(name: str, preset: str) -> dict[str, Any]:
    """Return what an agent is, and its settings in a preset; why it cannot be used here where it cannot."""
    try:
        from pbcs_ompl.skills.agent_interface import load_agent

        kind: Any = load_agent(name)
        values = kind.settings_type.from_preset(preset).to_dict()
    except (MissingDependency, ModuleNotFoundError):
        return {"about": MISSING_TORCH, "options": {}}
    except InvalidOption as error:
        return {"about": str(error), "options": {}}
    known = meanings(kind.settings_type)
    return {"about": first_line(kind), "options": {setting: {"default": value, "meaning": known.get(setting, "")}
                                                   for setting, value in values.items()}}
