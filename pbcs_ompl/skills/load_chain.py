"""Reading the result of a training, whatever its method."""

from pathlib import Path

from pbcs_ompl.core.checked import checked
from pbcs_ompl.skills import chain
from pbcs_ompl.skills.chain_files import kind_in
from pbcs_ompl.skills.path_following import chain as followed
from pbcs_ompl.skills.trained_controller import TrainedController

LOADERS = {chain.KIND: chain.SkillChain.load, followed.KIND: followed.FollowChain.load}


@checked
def load_chain(folder: str | Path, *, trust: bool = False) -> TrainedController:
    """Read a skill chain or a follower.

    Args:
        folder: The folder.
        trust: Let its environment be made where that imports a module which the folder names.

    Raises:
        DamagedFile: a file is missing, truncated, or of another version.
    """
    return LOADERS[kind_in(Path(folder))](folder, trust=trust)
