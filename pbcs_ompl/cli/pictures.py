"""Pictures beside the results. A picture that cannot be drawn or written never costs the result."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pbcs_ompl.cli.terminal import warn
from pbcs_ompl.core.callbacks import describe
from pbcs_ompl.core.collector import no_collection
from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array

if TYPE_CHECKING:
    from pbcs_ompl.bridge.plan import PlanResult
    from pbcs_ompl.experiments.compare import Comparison
    from pbcs_ompl.skills.trained_controller import TrainedController


def draw(name: str, picture: Callable[[], Any], out: Path) -> None:
    """Write the figure that `picture` returns to out/name, or say in one line on stderr why not."""
    try:
        with no_collection():
            from pbcs_ompl.figures.canvas import save

            figure = picture()
        save(figure, out / name)
    except PbcsError as error:
        warn(f"no picture {name}: {error}")
    except Exception as error:  # of matplotlib, or of the environment
        warn(f"no picture {name}: {describe(error)}")


def draw_tree(model: ResettableModel, result: "PlanResult", out: Path) -> None:
    """Draw tree.png: the exploration tree, and the path when there is one."""
    tree, trajectory = result.tree, result.trajectory
    title = f"{result.planner} on {model.spec.id}: {result.transitions:,} transitions, {result.nodes:,} nodes"

    def picture() -> Any:
        from pbcs_ompl.figures.tree import tree_figure

        return tree_figure(model, tree.states, tree.parents, title=title,
                           path=None if trajectory is None else trajectory.states)

    draw("tree.png", picture, out)


def draw_chain(model: ResettableModel, chain: "TrainedController", trajectory: Array | None,
               rollout: Array | None, title: str, out: Path) -> None:
    """Draw chain.png: phase 1, the chain's rollout and its activation sets."""
    def picture() -> Any:
        from pbcs_ompl.figures.chain import chain_figure

        return chain_figure(model, trajectory=trajectory, rollout=rollout, activations=chain.circles, title=title)

    draw("chain.png", picture, out)


def draw_comparison(comparison: "Comparison", title: str, out: Path) -> None:
    """Draw compare.png, the distribution of the transitions to the goal, and coverage.png, how it grew.

    Where plans were made shorter, also length.png.
    """
    def picture(name: str) -> Any:
        from pbcs_ompl.figures import compare

        return getattr(compare, name)(comparison.by_environment(), title=title)

    draw("compare.png", lambda: picture("distribution_figure"), out)
    draw("coverage.png", lambda: picture("coverage_figure"), out)
    if any(record.get("improvement") for record in comparison.runs):
        draw("length.png", lambda: picture("length_figure"), out)
