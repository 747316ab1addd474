"""Reading the result of a training, whatever its method."""

from pathlib import Path

from pbcs_ompl.core.checked import checked
from pbcs_ompl.skills.chain import SkillChain
from pbcs_ompl.skills.chain_files import kind_in
from pbcs_ompl.skills.path_following.chain import FollowChain
from pbcs_ompl.skills.trained_controller import TrainedController

CHAINS: dict[str, type[TrainedController]] = {one.kind: one for one in (SkillChain, FollowChain)}


@checked
def load_chain(folder: str | Path, *, trust: bool = False) -> TrainedController:
    """Read a skill chain or a follower.

    Args:
        folder: The folder.
        trust: Let its environment be made where that imports a module which the folder names.

    Raises:
        DamagedFile: a file is missing, truncated, or of another version.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", seed=0, out="runs/maze")
        >>> chain = pbcs_ompl.load_chain("runs/maze/chain")
        >>> chain.controller().act(chain.start).shape
        (2,)
    """
    return CHAINS[kind_in(Path(folder))].load(folder, trust=trust)
