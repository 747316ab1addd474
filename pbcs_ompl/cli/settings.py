"""`pbcs settings`: the settings of a training method in a preset."""

from argparse import Namespace
from typing import Any

from pbcs_ompl.cli.lists import MISSING_TORCH, print_list
from pbcs_ompl.core.docstrings import first_line, meanings
from pbcs_ompl.core.errors import MissingDependency


def run(arguments: Namespace) -> int:
    """List them, group by group."""
    try:
        from pbcs_ompl.skills.config import method_settings
        from pbcs_ompl.skills.settings import Settings, read_preset
    except ModuleNotFoundError as error:
        raise MissingDependency(MISSING_TORCH) from error
    method = arguments.method or read_preset(arguments.preset)["method"]
    chosen = method_settings(method, arguments.preset)
    groups: dict[str, Any] = {name: value for name, value in vars(chosen).items() if isinstance(value, Settings)}
    found = {name: _described(group) for name, group in {method: chosen, **groups}.items()}
    print_list({name: one for name, one in found.items() if one["options"]}, as_json=arguments.json)
    return 0


def _described(group: Any) -> dict[str, Any]:
    known = meanings(type(group))
    options = {name: {"default": value, "meaning": known.get(name, "")} for name, value in group.to_dict().items()
               if not isinstance(value, dict)}
    return {"about": first_line(type(group)), "options": options}
