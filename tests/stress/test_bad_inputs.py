"""Odd words on the command line: each ends with status 2 or 3 and one line, or does what it says.

    python -m pytest -m slow tests/stress/test_bad_inputs.py
"""

import importlib
import os
import random
from collections import Counter

import pytest
from stress.forked import call

from pbcs_ompl import cli

COUNT, SEED, SECONDS = 400, int(os.environ.get("STRESS_SEED", 20261127)), 20
MAZE = ["--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 2}']
FEW = ["--max-transitions", "300"]
VERBS = {
    "doctor": [],
    "plan": [*MAZE, *FEW],
    "train": [*MAZE, *FEW],
    "eval": ["nowhere"],
    "compare": ["--planners", "Ex", *MAZE, *FEW, "--seeds", "1"],
    "study": ["exploration-box"],
    "report": ["."],
}
WORDS = ["", " ", "x", "-1", "0", "1e18", "1e400", "nan", "inf", "-inf", "1.5", "0x10", "٣", "ü", "a\nb", "a\tb", "{",
         "[]", "null", "true", "{}", '{"": 1}', "[1]", '"x"', "/", ".", "..", "/dev/null", "/proc/self/mem",
         "/nowhere/at/all", "n" * 300, "m:x", ":", "os:getcwd", "../../x:y", "x:y:z", "-", "--", "--out",
         "$(true)", "`true`", "#", "%s",
         "\udcff", "pbcs/Maze-v1", "pbcs/Maze", "Ex", "ex", "cuda", "cuda:99", "1/0", "0/1", "3/2",
         "99999999999999999999/1"]
OBJECTS = ['{"size": null}', '{"size": 1e12}', '{"size": "x"}', '{"size": [1]}', '{"size": true}', '{"size": NaN}',
           '{"size": -3}', '{"render_mode": 5}', '{"render_mode": "human"}', '{"layout": [null]}', '{"layout": []}',
           '{"layout": ["\\ud800"]}', '{"no such": 1}', '{"a b": " "}', '{"bin_size": 0}', '{"bin_size": null}',
           '{"bin_size": [1e-300]}', '{"bin_size": true}', '{"hidden": [1e12]}', '{"hidden": []}', '{"hidden": [null]}',
           '{"epsilon": NaN}', '{"epsilon": "0.1"}', '{"epsilon": {"epsilon": 1}}', '{"episodes": 5}',
           '{"batch_size": 1e12}', '{"batch_size": true}', '{"discount": 2}', '{"replay_capacity": 1e18}',
           '{"seed": 1}',
           '{"Ex": 5}', '{"Ex": {"bin_size": null}}', '{"RRT": {"goal_bias": NaN}}', '{"goal_bias": NaN}',
           '{"control_duration": 1e12}', "[" * 2000, '{"a":' * 3000, '{"size": 2, "size": 3}', '{"size": 1e999}']
RULES = ["reward>nan", "reward>1e999", "reward>", "qpos[0]>1", "obs[99]>1", "obs[-99]>1", "obs[0]>0 and", "info.x>1",
         "os:system", "reward>0; import os", "|obs[0]|<1e-400", "obs[0:0]", "obs[1:0]", "obs[0],obs[0]", "obs"]
RESULTS_FIRST = {"--seeds": ["100001", "1e18"], "--episodes": ["1e11", "1e18"], "--jobs": ["1e18"]}


def command_lines(rng):
    """Yield command lines without end: a verb with its usual options, one of which has an odd value."""
    parser = cli.build_parser()
    while True:
        verb = rng.choice(list(VERBS))
        option = rng.choice([name for name in parser.verbs[verb].options if name.startswith("--") and name != "--help"])
        kind = rng.choice([WORDS, OBJECTS if option.endswith(("kwargs", "settings")) else WORDS,
                           RULES if option in ("--goal", "--feature") else RESULTS_FIRST.get(option, WORDS)])
        value = [option, rng.choice(kind)]
        glued = ["=".join(value)] if rng.random() < 0.3 else value
        base = VERBS[verb] if rng.random() < 0.9 else VERBS[verb][1:]
        if option in base and rng.random() < 0.7:
            place = base.index(option)
            base = base[:place] + base[place + 2:]
        yield [verb, *base, *glued]


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_odd_words_end_in_one_line(tmp_path, monkeypatch):
    for verb in VERBS:
        importlib.import_module(f"pbcs_ompl.cli.{verb}")
    found, wrong = Counter(), []
    lines = command_lines(random.Random(SEED))
    for number in range(COUNT):
        folder = tmp_path / str(number)
        folder.mkdir()
        words = next(lines)
        ended = call(lambda words=words: cli.main(words), seconds=SECONDS, folder=folder)
        found[ended.status] += 1
        why = fault(words, ended)
        if why:
            wrong.append(f"{why}: pbcs {words!r:.300}: status {ended.status}: {ended.text[-500:]}")
    print(dict(found))
    assert not wrong, f"{len(wrong)} of {COUNT}:\n" + "\n".join(wrong)


def fault(words, ended):
    """Return what is wrong with how a command line ended, or None."""
    errors = [line for line in ended.text.splitlines() if line.startswith("pbcs: error")]
    if "Traceback" in ended.text:
        return "traceback"
    if ended.status in (2, 3):
        return None if len(errors) == 1 or "doctor" in words else "not one line"
    return None if ended.status in (0, 1) else "hang or crash"
