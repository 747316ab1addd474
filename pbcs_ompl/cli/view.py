"""`pbcs view`: tree, plan and controller in three dimensions, as one page for the browser."""

import webbrowser
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.bridge.tree import load_tree
from pbcs_ompl.cli.terminal import print_summary
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.utf8 import utf8
from pbcs_ompl.figures.scene import GENERATOR, scene_page
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import CHAIN, TRAJECTORY, TREE, VIEW, check_replaceable, write_atomically, write_errors
from pbcs_ompl.results.folder import read_folder

if TYPE_CHECKING:
    from pbcs_ompl.skills.trained_controller import TrainedController

KINDS = ("plan", "train")


def run(arguments: Namespace) -> int:
    """Write the page; say where it is and what it shows."""
    folder = Path(arguments.dir)
    found = read_folder(folder)
    if found.kind not in KINDS:
        raise InvalidOption(f"{folder} is a folder of pbcs {found.kind}; pbcs view shows those of plan and train")
    page = Path(arguments.out or folder / VIEW)
    with write_errors(page):
        check_replaceable(page, GENERATOR, "pbcs view")
    model = make(EnvSpec.from_dict(found.config["environment"], trusted=arguments.trust))
    tree = load_tree(folder / TREE) if (folder / TREE).is_file() else None
    path = Trajectory.load(folder / TRAJECTORY, trust=arguments.trust) if (folder / TRAJECTORY).is_file() else None
    chain = _chain(folder / CHAIN, trust=arguments.trust) if (folder / CHAIN).is_dir() else None
    rollout = None if chain is None else chain.rollout(model)
    text = scene_page(model, tree=tree, path=None if path is None else path.states, rollout=rollout,
                      activations=() if chain is None else chain.circles)
    write_atomically(page, lambda file: file.write(utf8(text)))
    shown = {"tree": tree is not None, "plan": path is not None, "controller": chain is not None}
    lines = [("shows", ", ".join(name for name, there in shown.items() if there) or "nothing but the environment"),
             ("page", str(page))]
    print_summary({"out": str(page), **shown}, lines, as_json=arguments.json)
    if arguments.open:
        webbrowser.open(page.resolve().as_uri())
    return 0


def _chain(folder: Path, *, trust: bool) -> "TrainedController":
    from pbcs_ompl.skills.load_chain import load_chain  # here, because it needs torch, and plans do not

    return load_chain(folder, trust=trust)
