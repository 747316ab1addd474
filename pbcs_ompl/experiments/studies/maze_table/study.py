"""Trainings in mazes of growing size: [Matheron2020] 7.3 and 7.4."""

from typing import Any

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.experiments.training_run import trained
from pbcs_ompl.resettable import make
from pbcs_ompl.skills.trained_controller import TrainedController

PICTURED_INDEX = 0
THESIS = "thesis"


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each seed, size and method, seed by seed: PBCS first, and last, by size, to the letter."""
    chosen = [{"name": f"{name.replace(', ', '-')}-{size}-{index}", "label": name, "size": int(size), "index": index,
               "seed": sweep["first_seed"] + index, "method": method["method"], "agent": method["agent"],
               "planner": method.get("planner"), "preset": method.get("preset", sweep["preset"]),
               "max_transitions": method["max_transitions"], "episode_steps": options["episode_steps"],
               "wall_penalty": sweep["wall_penalty"]}
              for index in range(seeds) for size, options in sweep["sizes"].items()
              for name, method in sweep["methods"].items() if index < min(_seeds(method, size), options["seeds"])]
    return sorted(chosen, key=_order)


def _order(settings: dict[str, Any]) -> tuple[int, ...]:
    literal = settings["preset"] == THESIS
    return literal, settings["method"] != "pbcs", settings["size"] if literal else 0


def _seeds(method: dict[str, Any], size: str) -> int:
    """Return how many seeds a method has in a size."""
    most = method["seeds"]
    return int(most.get(size, 0) if isinstance(most, dict) else most)


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Train once; record what it cost and whether the policy succeeds."""
    size, seed = settings["size"], settings["seed"]
    kwargs = {"size": size, "wall_penalty": settings["wall_penalty"]} | ({"maze_seed": seed} if size > 3 else {})
    changes = {} if settings["method"] in ("pbcs", "follow") else {"max_steps": settings["episode_steps"]}
    record, result = trained("pbcs/Maze-v0", kwargs, settings=changes, seed=seed,
                             **{key: settings[key] for key in ("method", "agent", "planner", "preset",
                                                               "max_transitions")})
    if settings["index"] == PICTURED_INDEX and result.chain is not None:
        return settings | record | _picture(result.chain, result.trajectory, kwargs)
    return settings | record


def _picture(chain: TrainedController, plan: Trajectory | None, kwargs: dict[str, Any]) -> dict[str, Any]:
    return {"plan": None if plan is None else plan.states.tolist(),
            "rollout": chain.rollout(make("pbcs/Maze-v0", kwargs)).tolist(),
            "activations": [[center.tolist(), radius] for center, radius in chain.circles]}
