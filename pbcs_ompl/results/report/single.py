"""What a report says of one plan, one training, one evaluation."""

from textwrap import shorten
from typing import Any

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.formatting import duration, percent, short
from pbcs_ompl.results.report.content import UNFINISHED, Content
from pbcs_ompl.results.report.folder import Folder


def plan_content(folder: Folder) -> Content:
    """Return what the folder of `pbcs plan` holds."""
    config, result = folder.config, folder.result
    title, seeds = f"{config['planner']} in {environment_name(config)}", str(config["seed"])
    if result is None:
        return Content(title, UNFINISHED, None, [], seeds)
    summary = [("transitions", short(result["transitions"])), ("seconds", duration(result["seconds"])),
               ("nodes", short(result["nodes"]))]
    if not result["solved"]:
        return Content(title, "not solved", False, summary, seeds,
                       failures=[("not solved", "the budget ended before the goal was reached")])
    replay = "replays exactly" if result["replay_ok"] else "does not replay"
    return Content(title, f"solved, {replay}", bool(result["replay_ok"]),
                   [("path", f"{short(result['path_length'])} steps"), *summary], seeds)


def training_content(folder: Folder) -> Content:
    """Return what the folder of `pbcs train` holds."""
    config, result = folder.config, folder.result
    title = f"{config['method']} with {config['agent']} in {environment_name(config)}"
    if result is None:
        return Content(title, UNFINISHED, None, [], str(config["seed"]))
    summary = [("skills", str(result["skills"])), ("transitions of planning", short(result["plan_transitions"])),
               ("transitions of training", short(result["train_transitions"])),
               ("updates", short(result["updates"])), ("time", duration(result["seconds"]))]
    if result["wilson"] is not None:
        summary.insert(0, ("arrive, a tenth of the actions random", percent(result["success_rate"], result["wilson"])))
    reason = result["stalled"] or "the chain does not reach the goal often enough"
    return Content(title, "solved" if result["solved"] else "not solved", result["solved"], summary,
                   str(config["seed"]), failures=[] if result["solved"] else [("not solved", reason)])


def evaluation_content(folder: Folder) -> Content:
    """Return what the folder of `pbcs eval --out` holds."""
    config, result = folder.config, folder.result
    title = f"Evaluation of {config['chain']} in {environment_name(config)}"
    if result is None:
        return Content(title, UNFINISHED, None, [])
    rate = percent(result["success_rate"], result["wilson"])
    steps = "none arrived" if result["steps_median"] is None else short(result["steps_median"])
    return Content(title, f"{result['success_rate']:.0%} arrive", result["success_rate"] > 0,
                   [("arrive", rate), ("episodes", short(result["episodes"])), ("steps, median", steps),
                    ("random actions", f"{result['epsilon']:.0%}")])


def environment_name(config: dict[str, Any]) -> str:
    """Return the id of an environment with its options, for a title: the settings have them in full."""
    return shorten(EnvSpec.from_dict(config["environment"]).label, 100, placeholder=" ...")
