"""Lists of what there is: names, options with their defaults, and what they mean."""

import json
from collections.abc import Mapping
from typing import Any

from pbcs_ompl.cli.streams import print_output
from pbcs_ompl.core.formatting import printable
from pbcs_ompl.core.plain import plain

MISSING_TORCH = 'needs torch and safetensors: pip install "pbcs-ompl[rl]"'


def print_list(found: Mapping[str, Mapping[str, Any]], *, as_json: bool) -> None:
    """Print what there is.

    Args:
        found: By name, "about" and "options": for each of these "default" and "meaning".
        as_json: Print one JSON object instead.
    """
    if as_json:
        print_output(json.dumps(found, default=plain))
        return
    for name, one in found.items():
        print_output(printable(f"{name}: {one['about']}"))
        for option, words in one["options"].items():
            default = "" if words["default"] is None else f" = {json.dumps(words['default'], default=plain)}"
            print_output(printable(f"  {option}{default}  {words['meaning']}".rstrip()))
