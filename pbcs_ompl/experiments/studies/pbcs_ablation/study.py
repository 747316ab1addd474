"""PBCS with one parameter changed at a time: [Matheron2020] 7.5."""

from typing import Any

from pbcs_ompl.experiments.training_run import trained


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each seed, size and value; the usual values are run once."""
    usual = sweep["usual"]
    points = [usual | {parameter: value} for parameter, values in sweep["values"].items() for value in values]
    distinct = {"-".join(f"{name}{value:g}" for name, value in point.items()): point for point in points}
    return [{"name": f"{name}-{size}-{index}", "size": size, "seed": sweep["first_seed"] + index, "usual": usual,
             "point": point, "settings": sweep["settings"], "preset": sweep["preset"],
             "max_transitions": sweep["max_transitions"]}
            for index in range(seeds) for size in sweep["sizes"] for name, point in distinct.items()]


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Train once."""
    size, seed = settings["size"], settings["seed"]
    kwargs = {"size": size} | ({"maze_seed": seed} if size > 3 else {})
    record, _ = trained("pbcs/Maze-v0", kwargs, method="pbcs", planner="Ex", seed=seed, preset=settings["preset"],
                        settings=settings["settings"] | settings["point"], max_transitions=settings["max_transitions"])
    return settings | record
