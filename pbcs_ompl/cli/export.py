"""`pbcs export`: a result folder in the format of another tool."""

from argparse import Namespace
from pathlib import Path

from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.terminal import print_summary
from pbcs_ompl.results.export import Export, export

NEXT = {
    "numpy": "from controller import load; controller = load(); controller.reset(); controller.act(observation)",
    "onnx": "onnxruntime.InferenceSession('{file}')",
    "sb3": "stable_baselines3.TD3.load('{file}', env=env)",
    "minari": "MINARI_DATASETS_PATH={out} minari list local",
    "maniskill": "h5py.File('{file}')",
    "planner-arena": "plannerarena {file}",
    "csv": "numpy.genfromtxt('{file}', delimiter=',', names=True)",
}
"""How the files are read, in one line."""


def run(arguments: Namespace) -> int:
    """Export and report."""
    out = arguments.out or fresh_folder("export", Path(arguments.dir).name, arguments.to)
    done = export(arguments.dir, arguments.to, out=out, episodes=arguments.episodes, epsilon=arguments.epsilon,
                  seed=arguments.seed, path=arguments.path, trust=arguments.trust)
    print_summary(done.summary(), _closing_lines(done), as_json=arguments.json)
    return 0


def _closing_lines(done: Export) -> list[tuple[str, str]]:
    lines = [("wrote", ", ".join(done.files))]
    if done.episodes is not None:
        lines.append(("episodes", f"{done.episodes}, the goal was granted in {done.successes}"))
    return [*lines, ("read", NEXT[done.to].format(file=done.files[0], out=done.out))]
