"""PBCS in the same mazes, with the same budget: from the preset "thesis" to "fast", and "fast" without one change."""

from typing import Any

from pbcs_ompl.agents import DDPGSettings
from pbcs_ompl.experiments.studies.presets.analysis import ALL_BUT, FIRST
from pbcs_ompl.experiments.training_run import trained
from pbcs_ompl.skills import method_settings
from pbcs_ompl.skills.settings import flat_names

THESIS, FAST = "thesis", "fast"


def runs(sweep: dict[str, Any], seeds: int) -> list[dict[str, Any]]:
    """One run for each seed, size and row; those with an update for each transition or large networks come last."""
    changes, slow_seeds = sweep["changes"], sweep["slow"]["seeds"]
    names = list(changes)
    rows = [(FIRST, count, names[:count]) for count in range(len(names) + 1)]
    # All but the last change are the first ones.
    rows += [(ALL_BUT, count, names[:count - 1] + names[count:]) for count in range(1, len(names))]
    chosen = [{"name": f"{kind}-{count}-{size}-{index}", "kind": kind, "count": count, "changes": names, "size": size,
               "seed": sweep["first_seed"] + index, "slow": not {*names[:2]} <= {*made},
               "changed": [setting for name in made for setting in changes[name]],
               **{key: sweep[key] for key in ("planner", "max_transitions")}}
              for index in range(seeds) for size in sweep["sizes"] for kind, count, made in rows]
    return sorted((one for one in chosen if not one["slow"] or one["seed"] < sweep["first_seed"] + slow_seeds),
                  key=lambda one: bool(one["slow"]))


def method_values(preset: str) -> dict[str, Any]:
    """Return the settings of a preset for PBCS by their own names."""
    paths = flat_names(method_settings("pbcs", preset).to_dict())
    return {path.rpartition(".")[2]: value for path, value in paths.items()}


def agent_values(preset: str) -> dict[str, Any]:
    """Return the settings of a preset for DDPG."""
    return DDPGSettings.from_preset(preset).to_dict()


def run(settings: dict[str, Any]) -> dict[str, Any]:
    """Train once; `covered` is the fraction of the plan that the skills cover at the end."""
    size, seed, changed = settings["size"], settings["seed"], settings["changed"]
    method, agent = ({name: value for name, value in values(FAST).items() if name in changed}
                     for values in (method_values, agent_values))
    covered = [0.0]
    kwargs = {"size": size} | ({"maze_seed": seed} if size > 3 else {})
    record, _ = trained("pbcs/Maze-v0", kwargs, method="pbcs", preset=THESIS, settings=method, agent_settings=agent,
                        seed=seed, on_progress=lambda state: covered.append(float(state.get("covered", covered[-1]))),
                        **{key: settings[key] for key in ("planner", "max_transitions")})
    return settings | record | {"covered": covered[-1]}
