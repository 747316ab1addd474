"""PBCS in the same mazes, with the same budget, by two presets."""

from typing import Any

from pbcs_ompl.experiments.training_run import trained


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each seed, size and preset."""
    return [{"name": f"{preset}-{size}-{index}", "preset": preset, "size": int(size),
             "seed": sweep["first_seed"] + index, "max_transitions": sweep["max_transitions"]}
            for index in range(seeds) for size, options in sweep["sizes"].items() if index < options["seeds"]
            for preset in sweep["presets"]]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Train once."""
    record, _ = trained("pbcs/Maze-v0", {"size": settings["size"]}, method="pbcs", planner="Ex",
                        **{key: settings[key] for key in ("preset", "seed", "max_transitions")})
    return settings | record
