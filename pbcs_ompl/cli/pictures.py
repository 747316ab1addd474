"""Pictures beside the results. A picture that cannot be drawn or written never costs the result."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pbcs_ompl.cli.terminal import warn
from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array

if TYPE_CHECKING:
    from pbcs_ompl.bridge.plan import PlanResult
    from pbcs_ompl.experiments.compare import Comparison
    from pbcs_ompl.skills.chain import SkillChain


def draw(name: str, picture: Callable[[], Any], out: Path) -> None:
    """Write the figure that `picture` returns to out/name, or say in one line on stderr why not."""
    from pbcs_ompl.figures.canvas import save

    try:
        save(picture(), out / name)
    except (PbcsError, OSError) as error:
        warn(f"no picture {name}: {error}")


def draw_tree(model: ResettableModel, result: "PlanResult", out: Path) -> None:
    """Draw tree.png: the exploration tree, and the path when there is one."""
    from pbcs_ompl.figures.tree import tree_figure

    tree, trajectory = result.tree, result.trajectory
    title = f"{result.planner} on {model.spec.id}: {result.transitions:,} transitions, {result.nodes:,} nodes"
    draw("tree.png", lambda: tree_figure(model, tree.states, tree.parents, title=title,
                                         path=None if trajectory is None else trajectory.states), out)


def draw_chain(model: ResettableModel, chain: "SkillChain", trajectory: Array | None,
               rollout: Array | None, title: str, out: Path) -> None:
    """Draw chain.png: phase 1, the chain's rollout and its activation sets."""
    from pbcs_ompl.figures.chain import chain_figure

    sets = [(skill.activation.center, skill.activation.radius) for skill in chain.skills]
    draw("chain.png", lambda: chain_figure(model, trajectory=trajectory, rollout=rollout, activations=sets,
                                           title=title), out)


def draw_comparison(comparison: "Comparison", title: str, out: Path) -> None:
    """Draw compare.png, the distribution of the transitions to the goal, and coverage.png, how it grew."""
    from pbcs_ompl.figures.compare import coverage_figure, distribution_figure

    draw("compare.png", lambda: distribution_figure(comparison.by_environment(), title=title), out)
    draw("coverage.png", lambda: coverage_figure(comparison.by_environment(), title=title), out)
