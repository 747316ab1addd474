"""Let this process, and all that it spawns, import `deeds`."""

import os
import sys

FOLDER = os.path.dirname(__file__)
sys.path.append(FOLDER)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH"), FOLDER]))
