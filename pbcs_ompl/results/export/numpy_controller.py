"""A controller as two files that need NumPy alone: the source of `pbcs_ompl.deploy`, and the numbers."""

import json
from inspect import getsource
from pathlib import Path

import numpy as np

from pbcs_ompl import deploy
from pbcs_ompl.results.export.controller_data import ControllerData
from pbcs_ompl.results.files import write_arrays, write_text


def write_numpy(data: ControllerData, folder: Path) -> list[Path]:
    """Write controller.py and controller.npz into a folder, and return their paths.

    Raises:
        RunFolderError: a file cannot be written.
    """
    code, numbers = folder / "controller.py", folder / "controller.npz"
    write_arrays(numbers, words=np.array(json.dumps(data.words)), **data.arrays)
    write_text(code, getsource(deploy))
    return [code, numbers]
