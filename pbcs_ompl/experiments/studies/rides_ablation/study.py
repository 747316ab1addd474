"""Search with Rides, with Rides without each of its parts, and with Ex and KPIECE1."""

from typing import Any

from pbcs_ompl.bridge.plan import plan

WHOLE, ABLATED = "Rides", "pbcs_ompl.planners.rides_without:RidesWithout"


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each seed, scene and rule."""
    rules = {WHOLE: {"planner": WHOLE}} | {f"without-{part}": {"without": part} for part in sweep["without"]}
    return [{"name": f"{scene}-{rule}-{index}", "scene": scene, "rule": rule, "seed": sweep["first_seed"] + index,
             "max_transitions": sweep["max_transitions"], **options, **choice}
            for index in range(seeds) for scene, options in sweep["scenes"].items()
            for rule, choice in (rules | sweep["peers"]).items()]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Search once for the goal."""
    seed, kwargs = settings["seed"], settings.get("env_kwargs", {})
    if "size" in kwargs:
        kwargs = kwargs | {"maze_seed": seed}
    planner, options = settings.get("planner", ABLATED), settings.get("planner_kwargs", {})
    if "without" in settings:
        options = {"part": settings["without"]}
    found = plan(settings["env"], planner, env_kwargs=kwargs, planner_kwargs=options, seed=seed,
                 max_transitions=settings["max_transitions"])
    return settings | {"env_kwargs": kwargs, "solved": found.solved, "transitions": found.transitions,
                       "path_length": found.path_length, "replay_ok": found.replay_ok}
