"""A laboratory's folder of results: one of each kind, made by the verbs themselves."""

import shlex

import pytest

from pbcs_ompl.cli import main

MAZE = "--env pbcs/Maze-v0 --env-kwargs '{\"size\": 2}'"
STUDY = {
    "sweep.toml": 'title = "Heads or tails"\nseeds = 3\nsides = 2\n',
    "study.py": '''
def runs(sweep, seeds):
    return [{"name": f"coin-{seed}", "seed": seed, "sides": sweep["sides"]} for seed in range(seeds)]

def run(settings):
    return {"seed": settings["seed"], "side": settings["seed"] % settings["sides"] if settings["seed"] < 3 else 1 / 0}
''',
    "analysis.py": '''
from pbcs_ompl.figures.canvas import new_figure, save
from pbcs_ompl.experiments.claims import Claim, rate

def analyse(records, figures):
    figure, axes = new_figure()
    save(figure, figures / "coins.png")
    heads = rate(sum(record["side"] for record in records), len(records))
    return [Claim("some are heads", True, {"heads": heads}, "a coin"), Claim("1 < 0 & <b>bold</b>", False, note="no"),
            Claim("coins dream", None)]
''',
}
LINES = {
    "plan": (0, f"plan {MAZE} --goal 'reward>0' --planner Ex --planner-kwargs '{{\"control_duration\": 2}}'"
             " --max-seconds 60 --improve 10"),
    "given": (1, f"train {MAZE} --method pbcs --path runs/plan --max-transitions 4000 --settings '{{\"beta\": 20}}'"),
    "training": (0, f"train {MAZE} --seed 3 --agent-settings '{{\"batch_size\": 90}}'"),
    "evaluation": (0, "eval runs/training --episodes 7 --epsilon 0.1"),
    "comparison": (0, f"compare --planners Ex SST {MAZE} '{{\"size\": 3}}' --seeds 2 --max-seconds 30 --max-memory 2000"
                      " --improve 1% --planner-kwargs '{\"Ex\": {\"bin_size\": 0.3}}'"),
    "study": (1, "study coin-toss --seeds 4"),
}


@pytest.fixture(scope="session")
def laboratory(tmp_path_factory):
    """The folder in which the verbs were used; their results lie in runs/."""
    folder = tmp_path_factory.mktemp("laboratory")
    (folder / "coin-toss").mkdir()
    for name, text in STUDY.items():
        (folder / "coin-toss" / name).write_text(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for name, (status, line) in LINES.items():
            line = line.replace(" --path", " --goal 'reward>0' --path") if name == "given" else line
            assert main(shlex.split(f"{line} --out runs/{name}")) == status, line
    return folder
