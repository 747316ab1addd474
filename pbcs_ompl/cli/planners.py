"""`pbcs planners`: what can plan, with which options."""

from argparse import Namespace
from typing import Any

from pbcs_ompl.bridge.planner_spec import PlannerSpec
from pbcs_ompl.cli.lists import print_list
from pbcs_ompl.core.docstrings import first_line, meanings
from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.registry import load, names

OF_ALL = {"control_duration": "Steps that a control lasts: one number, or the least and the most, all equally likely.",
          "goal_bias": "How often OMPL samples the goal instead of a random state, a fraction.",
          "intermediate_states": "Whether OMPL keeps the states in the middle of a control as nodes.",
          "batch": "How many nodes are expanded together; \"grow\" leaves it to the strategy."}
"""Options that planners have beside their own."""


def run(arguments: Namespace) -> int:
    """List them."""
    found = {name: _described(name) for name in ([arguments.name] if arguments.name else names("planner"))}
    print_list(found, as_json=arguments.json)
    return 0


def _described(name: str) -> dict[str, Any]:
    try:
        source, defaults = load("planner", name), PlannerSpec(name, {}).defaults
    except PbcsError as error:
        return {"about": f"not available: {error}", "options": {}}
    known = OF_ALL | meanings(source if isinstance(source, type) else type(source))
    about = first_line(source) if isinstance(source, type) else f"OMPL's {name}, as it is."
    return {"about": about, "options": {option: {"default": default, "meaning": known.get(option, "")}
                                        for option, default in defaults.items()}}
