"""Ex with other bins, and with several nodes expanded together: [Matheron2020] 3.3."""

from typing import Any

from pbcs_ompl.bridge.plan import plan

WARM_UP = 1000
"""Transitions of a search beforehand, so that the seconds are not those of a compiler."""


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each seed, scene and value; batches have the suggested bins."""
    values = [("bin_size", value) for value in sweep["bin_size"]] + [("batch", value) for value in sweep["batch"]]
    return [{"name": f"{scene}-{option}-{value}-{index}", "scene": scene, "option": option, "value": value,
             "seed": sweep["first_seed"] + index, "env": options["env"], "env_kwargs": options["env_kwargs"],
             "suggested": sweep["suggested"], "max_transitions": sweep["max_transitions"]}
            for index in range(seeds) for scene, options in sweep["scenes"].items() for option, value in values]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Search once for the goal."""
    seed, kwargs = settings["seed"], settings["env_kwargs"]
    if "size" in kwargs:
        kwargs = kwargs | {"maze_seed": seed}
    options = {"bin_size": settings["suggested"], settings["option"]: settings["value"]}
    for budget in (WARM_UP, settings["max_transitions"]):
        found = plan(settings["env"], "Ex", env_kwargs=kwargs, planner_kwargs=options, seed=seed,
                     max_transitions=budget)
    return settings | {"env_kwargs": kwargs, "solved": found.solved, "transitions": found.transitions,
                       "seconds": found.seconds, "path_length": found.path_length, "replay_ok": found.replay_ok}
