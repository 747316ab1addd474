"""Plan with controls that last 1 to k steps."""

from typing import Any

from pbcs_ompl.bridge.plan import plan


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each seed, scene, planner and k."""
    return [{"name": f"{scene}-{planner}-{duration}-{seed}", "scene": scene, "planner": planner,
             "control_duration": duration, "seed": seed, "max_transitions": sweep["max_transitions"], **options}
            for seed in range(seeds) for scene, options in sweep["scenes"].items()
            for planner in sweep["planners"] for duration in sweep["control_durations"]]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Search once for the goal."""
    seed, kwargs = settings["seed"], settings.get("env_kwargs", {})
    if "size" in kwargs:
        kwargs = kwargs | {"maze_seed": seed}
    found = plan(settings["env"], settings["planner"], env_kwargs=kwargs,
                 planner_kwargs={"control_duration": settings["control_duration"]}, seed=seed,
                 max_transitions=settings["max_transitions"])
    return settings | {"env_kwargs": kwargs, "solved": found.solved, "transitions": found.transitions,
                       "path_length": found.path_length, "replay_ok": found.replay_ok}
