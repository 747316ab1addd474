"""Trainings of PBCS outside the mazes of [Matheron2020], and with activation sets that are learnt (7.2.4)."""

from typing import Any

from pbcs_ompl.experiments.training_run import trained

KEPT = ("solved", "success_rate", "nominal_success_rate", "steps_median", "skills", "plan_transitions",
        "train_transitions", "updates", "cpu_seconds", "reason")


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each task and seed: seed by seed, so that a part is balanced, tasks with few seeds last."""
    chosen = [{"name": f"{task}-{sweep['first_seed'] + index}", "task": task, "seed": sweep["first_seed"] + index,
               "preset": sweep["preset"], "env_kwargs": {}, "planner_kwargs": {}, "settings": {}, **options}
              for index in range(seeds) for task, options in sweep["tasks"].items() if index < options["seeds"]]
    return sorted(chosen, key=lambda settings: -settings["seeds"])


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Train once; record what it cost and whether the chain succeeds."""
    options = {key: settings[key] for key in ("planner_kwargs", "preset", "settings", "seed", "max_transitions")}
    record, result = trained(settings["env"], settings["env_kwargs"], method="pbcs", planner="Ex", **options)
    length = None if result.trajectory is None else result.trajectory.length
    return settings | {key: record[key] for key in KEPT} | {"path_length": length}
