"""The grammar of the command line, and one clear line for each way to get it wrong."""

import argparse
from collections.abc import Sequence
from typing import Any, NoReturn

from pbcs_ompl.cli.streams import print_output
from pbcs_ompl.cli.values import Choice, amount, fraction, integer, json_object, json_objects, part, seconds
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption, UnknownName, did_you_mean

EXECUTORS = ("local", "ray")
SCHEDULERS = ("make", "slurm")
TRACKERS = ("tensorboard", "wandb", "trackio")
FORMATS = ("numpy", "onnx", "sb3", "minari", "maniskill", "planner-arena", "csv")
SHELLS = ("bash", "zsh", "fish")
DESCRIPTION = """\
Plan with OMPL in any environment that can be reset,
then train a controller along the plan.
"""
EPILOG = """\
examples:
  pbcs plan --env pbcs/Maze-v0 --env-kwargs '{"size": 9, "maze_seed": 1}'
  pbcs train --env pbcs/Maze-v0 --env-kwargs '{"size": 5, "maze_seed": 1}' --seed 0
  pbcs compare --planners Rides Ex EST KPIECE1 --env pbcs/Maze-v0 --env-kwargs '{"size": 9}' --seeds 10
  pbcs report runs

exit status: 0 done, 1 ran and did not solve, 2 wrong usage or input, 3 something is not installed, 4 a mistake in pbcs,
128+n stopped by signal n; after SIGTERM and SIGHUP as after Ctrl-C, a training can be resumed
"""
ON_A_CLUSTER = """\
on a cluster:
  pbcs study ID --executor ray --out DIR       on a node of a Ray cluster: as many runs as it has processors
  pbcs study ID --emit slurm --out DIR         write DIR/slurm.sh, an array with a task for each run
  pbcs study ID --emit make --out DIR          write DIR/Makefile, for make --jobs
  pbcs study ID --shard 2/3 --out DIR          the second third of the runs, on a disk that all machines share
afterwards, or when it was stopped, the same command without --shard makes what is missing, and the analysis
"""


class Parser(argparse.ArgumentParser):
    """An argument parser that raises our errors, guesses no abbreviation, and knows its options by name."""

    def __init__(self, **settings: Any):
        self.options: list[str] = []
        self.verbs: dict[str, Parser] = {}
        settings.setdefault("formatter_class", argparse.RawDescriptionHelpFormatter)
        super().__init__(allow_abbrev=False, **settings)

    def add_argument(self, *names: str, **settings: Any) -> argparse.Action:
        self.options += [name for name in names if name.startswith("-")]
        return super().add_argument(*names, **settings)

    def print_help(self, file: Any = None) -> None:
        print_output(self.format_help().rstrip())

    def error(self, message: str) -> NoReturn:
        raise InvalidOption(f"{message} (see {self.prog} --help)")


class _Version(argparse.Action):
    """Look the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from pbcs_ompl import __version__

        print_output(f"pbcs {__version__}")
        parser.exit()


class _Completion(argparse.Action):
    """Print what a shell reads to complete command lines."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any,
                 option_string: str | None = None) -> None:
        from pbcs_ompl.cli.completion import completion

        print_output(completion(parser, values))
        parser.exit()


def build_parser() -> Parser:
    """Return the parser of all verbs."""
    parser = Parser(prog="pbcs", description=DESCRIPTION, epilog=EPILOG)
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    parser.add_argument("--print-completion", action=_Completion, type=Choice("shell", SHELLS), metavar="SHELL",
                        help=f"print what completes command lines in {', '.join(SHELLS)}, and exit")
    group = parser.add_subparsers(dest="verb", metavar="VERB", parser_class=Parser)
    for add in (_doctor, _plan, _train, _eval, _compare, _study, _report, _view, _export, _distill, _watch,
                _planners, _agents, _settings, _demo):
        name, purpose = add.__name__.removeprefix("_"), add.__doc__ or ""
        verb = group.add_parser(name, help=purpose, description=purpose)
        add(verb)
        verb.add_argument("--json", action="store_true",
                          help="end stdout with one JSON object; everything else goes to stderr")
        parser.verbs[name] = verb
    return parser


def parse(parser: Parser, words: Sequence[str]) -> argparse.Namespace:
    """Parse the words after `pbcs`.

    Raises:
        UnknownName: an unknown verb or option; the closest one is suggested.
        InvalidOption: a missing or malformed value.
    """
    if not words:
        raise InvalidOption(f"a verb is missing; choose from {', '.join(parser.verbs)} (see pbcs --help)")
    if words[0].startswith("-"):
        _check_options(words[:1], parser)
    elif words[0] not in parser.verbs:
        raise UnknownName("verb", words[0], parser.verbs)
    else:
        _check_options(words[1:], parser.verbs[words[0]])
    arguments, surplus = parser.parse_known_args(words)
    if surplus:
        raise InvalidOption(f"unexpected word {surplus[0]!r} (see pbcs {arguments.verb} --help)")
    return arguments


def environment(arguments: argparse.Namespace) -> EnvSpec:
    """Return the environment that the options name."""
    return EnvSpec(arguments.env, arguments.env_kwargs, arguments.goal, arguments.feature, arguments.start_seed,
                   arguments.reset_options)


def _check_options(words: Sequence[str], parser: Parser) -> None:
    for word in words:
        name = word.partition("=")[0]
        if name.startswith("--") and name != "--" and name not in parser.options:
            closest = did_you_mean(name, parser.options)
            raise InvalidOption(f"unknown option {name}{closest} (see {parser.prog} --help)")


def _doctor(verb: Parser) -> None:
    """show versions, known bad pairs, plug-ins found, and whether an environment is resettable"""
    _add_environment(verb, required=False)
    verb.add_argument("--all", action="store_true",
                      help="check every environment that is registered here, and write a page; again to continue")
    verb.add_argument("--max-seconds", type=seconds, metavar="S",
                      help="of --all: how long one environment may take (60)")
    verb.add_argument("--out", metavar="DIR", help="of --all: folder of environments.md and .json (runs/doctor)")


def _plan(verb: Parser) -> None:
    """search a trajectory to the goal of an environment with a planner"""
    _add_environment(verb)
    _add_planner(verb)
    _add_seed(verb)
    _add_budget(verb, 1_000_000)
    verb.add_argument("--max-seconds", type=seconds, metavar="S", help="stop after this much wall time")
    _add_improve(verb)
    verb.add_argument("--video", metavar="FILE", help="film the path that was found; .mp4 or .gif")
    verb.add_argument("--follow", metavar="FOLLOWER",
                      help="let a robot's follower (a folder of pbcs train, or ant, ant-d4rl, car, quadrotor) drive "
                           "along it, smoothed but for a car")
    verb.add_argument("--episodes", type=integer(1), metavar="N", help="of --follow: number of executions (30)")
    verb.add_argument("--epsilon", type=fraction, metavar="X", help="of --follow: fraction of random actions (0)")
    _add_out(verb)
    verb.add_argument("--no-pictures", action="store_true", help="write no tree.png, which takes half a second")


def _train(verb: Parser) -> None:
    """plan a trajectory, then train a controller along it"""
    _add_environment(verb, required=False)
    verb.add_argument("--method", metavar="NAME", help="pbcs, follow, pb, backplay, plain, bootstrapped or offline "
                                                       "(follow; with --preset thesis pbcs)")
    _add_planner(verb, None, "Rides for follow, else Ex; none beside --path")
    verb.add_argument("--agent", default="ddpg", metavar="NAME", help="registered, or module:Class (ddpg)")
    verb.add_argument("--device", default="cpu", metavar="NAME", help="where the agent learns: cpu or cuda (cpu)")
    verb.add_argument("--preset", default="fast", metavar="NAME",
                      help="fast: ours; thesis: the settings of [Matheron2020] (fast)")
    verb.add_argument("--settings", type=json_object, default={}, metavar="JSON",
                      help="skill settings that differ from the preset, such as '{\"activation\": \"classifier\"}'")
    verb.add_argument("--agent-settings", type=json_object, default={}, metavar="JSON",
                      help="agent settings that differ from the preset, such as '{\"hidden\": [128, 128]}'")
    verb.add_argument("--path", metavar="DIR",
                      help="train along this plan, a folder of pbcs plan or a trajectory")
    verb.add_argument("--lines", type=Choice("kind of lines", ("random",)), metavar="KIND",
                      help="random: with --method follow, train one policy for any line of a robot, on random ones")
    verb.add_argument("--worlds", type=json_objects, metavar="JSON",
                      help="of --lines: options that differ from world to world, such as '[{\"maze_seed\": 1}]' (one)")
    _add_seed(verb)
    verb.add_argument("--max-transitions", type=integer(1), metavar="N",
                      help="stop after N environment steps (10,000,000)")
    _add_out(verb)
    verb.add_argument("--track", type=Choice("tracker", TRACKERS), metavar="NAME",
                      help="also write the progress for tensorboard, wandb or trackio")
    verb.add_argument("--resume", metavar="DIR", help="continue a training that was stopped")
    _add_trust(verb, "the folder of --resume")


def _eval(verb: Parser) -> None:
    """run a trained controller many times from the start"""
    verb.add_argument("dir", metavar="DIR", help="a folder of pbcs train; or ant, ant-d4rl, car, quadrotor: these come "
                                                 "with pbcs")
    verb.add_argument("--path", metavar="DIR", help="of a follower: the plan to drive along, a folder of pbcs plan")
    verb.add_argument("--env", metavar="ID", help="of a follower, without --path: drive the shortest way to the goal")
    verb.add_argument("--env-kwargs", type=json_object, default={}, metavar="JSON",
                      help="of --env: options of the environment")
    verb.add_argument("--seed", type=integer(0), default=0, metavar="N",
                      help="of a follower: seed of its starts and of random actions (0)")
    verb.add_argument("--episodes", type=integer(1), default=100, metavar="N", help="how many rollouts (100)")
    verb.add_argument("--epsilon", type=fraction, default=0.0, metavar="E",
                      help="probability of a random action in each step (0)")
    verb.add_argument("--video", metavar="FILE", help="film the first rollout; .mp4 or .gif")
    verb.add_argument("--out", metavar="DIR", help="new folder for the numbers, which pbcs report shows (none)")
    _add_trust(verb, "the folder")


def _compare(verb: Parser) -> None:
    """run several planners with several seeds and tabulate what they need"""
    verb.add_argument("--planners", nargs="+", required=True, metavar="NAME",
                      help="registered planners or module:Class")
    verb.add_argument("--planner-kwargs", type=json_object, default={}, metavar="JSON",
                      help="options by planner, such as '{\"Ex\": {\"bin_size\": 0.2}}'")
    _add_environment(verb, several=True)
    verb.add_argument("--seeds", type=integer(1), default=10, metavar="N", help="seeds of each planner (10)")
    _add_budget(verb, 1_000_000)
    verb.add_argument("--max-seconds", type=seconds, metavar="S", help="stop a run after this much wall time")
    verb.add_argument("--max-memory", type=integer(1), metavar="MB",
                      help="kill a run whose process holds more; Python and the libraries take about 250")
    _add_improve(verb)
    _add_execution(verb)
    _add_out(verb)


def _study(verb: Parser) -> None:
    """run an experiment of the studies, draw its figures and check its claims"""
    verb.epilog = ON_A_CLUSTER
    verb.add_argument("id", nargs="?", metavar="ID", help="a study of --list, or the folder of one")
    verb.add_argument("--list", action="store_true", help="list the studies and what they are about")
    verb.add_argument("--seeds", type=integer(1), metavar="N", help="how many seeds (as the study says)")
    verb.add_argument("--from-records", action="store_true",
                      help="make no run: draw the figures from the records that come with the study")
    verb.add_argument("--device", metavar="NAME", help="where agents learn: cpu or cuda (as the study says)")
    verb.add_argument("--max-seconds", type=seconds, metavar="S", help="kill a run that takes longer")
    verb.add_argument("--max-memory", type=integer(1), metavar="MB", help="kill a run whose process holds more")
    _add_execution(verb)
    verb.add_argument("--shard", type=part, metavar="I/N",
                      help="make the I-th of N parts of the runs, from 1; parts may share --out at the same time")
    verb.add_argument("--emit", type=Choice("scheduler", SCHEDULERS), metavar="NAME",
                      help="make nothing, write the runs for a scheduler into --out: make (a Makefile) or slurm")
    verb.add_argument("--out", metavar="DIR", help="folder for the results; a study that was stopped continues there")


def _report(verb: Parser) -> None:
    """show a result folder, or all of those below one, as one HTML page"""
    verb.add_argument("dir", metavar="DIR", help="a folder of results, or one that holds many, such as runs")
    verb.add_argument("--out", metavar="FILE",
                      help="the page (report.html in DIR); an older report is replaced, another file never")


def _view(verb: Parser) -> None:
    """show a plan or a training in three dimensions, as one HTML page with a slider for the time"""
    verb.add_argument("dir", metavar="DIR", help="a folder of pbcs plan or pbcs train")
    verb.add_argument("--out", metavar="FILE",
                      help="the page (view.html in DIR); an older view is replaced, another file never")
    verb.add_argument("--open", action="store_true", help="open the page in the browser")
    _add_trust(verb, "the folder")


def _export(verb: Parser) -> None:
    """write a result folder in the format of another tool"""
    verb.add_argument("dir", metavar="DIR", help="a folder of pbcs train, plan, distill or compare; or ant, ant-d4rl, "
                                                 "quadrotor")
    verb.add_argument("--to", required=True, type=Choice("format", FORMATS), metavar="FORMAT",
                      help="a controller: numpy, onnx; episodes: minari, maniskill, csv; both: sb3; a comparison: "
                           "planner-arena, csv")
    verb.add_argument("--episodes", type=integer(0), default=10, metavar="N",
                      help="how many episodes a controller drives, and how many paths of a tree are taken (10)")
    verb.add_argument("--epsilon", type=fraction, default=0.0, metavar="E",
                      help="probability of a random action in each step of these (0)")
    verb.add_argument("--seed", type=integer(0), default=0, metavar="N", help="seed of the random actions (0)")
    verb.add_argument("--path", metavar="DIR", help="of a follower: the plan whose line it begins with")
    _add_out(verb)
    _add_trust(verb, "the folder")


def _distill(verb: Parser) -> None:
    """train one network to do what a controller of several does"""
    verb.add_argument("dir", metavar="DIR", help="a folder of pbcs train")
    verb.add_argument("--settings", type=json_object, default={}, metavar="JSON",
                      help="settings that differ from the defaults, such as '{\"width\": 64}'")
    _add_seed(verb)
    _add_out(verb)
    _add_trust(verb, "the folder")


def _watch(verb: Parser) -> None:
    """show the progress of a training of another process until it ends"""
    verb.add_argument("dir", metavar="DIR", help="the folder of pbcs train")
    verb.add_argument("--once", action="store_true", help="show the present state and end")


def _planners(verb: Parser) -> None:
    """list the planners, their options with defaults, and what they mean"""
    verb.add_argument("name", nargs="?", metavar="NAME", help="one of them, or module:attribute (all)")


def _agents(verb: Parser) -> None:
    """list the agents, their settings with defaults, and what they mean"""
    verb.add_argument("name", nargs="?", metavar="NAME", help="one of them, or module:Class (all)")
    verb.add_argument("--preset", default="fast", metavar="NAME", help="whose values are shown (fast)")


def _settings(verb: Parser) -> None:
    """list the settings of a preset for a training method, and what they mean"""
    verb.add_argument("preset", nargs="?", default="fast", metavar="PRESET", help="fast or thesis (fast)")
    verb.add_argument("--method", metavar="NAME", help="the training method (that of the preset)")


def _demo(verb: Parser) -> None:
    """plan in a 5x5 maze, train a controller along the plan, show the result"""
    _add_out(verb)


def _add_execution(verb: Parser) -> None:
    verb.add_argument("--jobs", type=integer(1), metavar="J",
                      help="runs side by side (1, or all processors of a cluster); more than there are cores makes the "
                           "seconds meaningless")
    verb.add_argument("--executor", type=Choice("executor", EXECUTORS), default="local", metavar="NAME",
                      help="local: processes here; ray: a Ray cluster (local)")
    verb.add_argument("--address", metavar="HOST:PORT", help="the Ray cluster (auto: the one this machine is part of)")


def _add_environment(verb: Parser, *, required: bool = True, several: bool = False) -> None:
    number: dict[str, Any] = {"nargs": "+"} if several else {}
    more = "; several are paired with the ids, or one of either goes with all of the other" if several else ""
    verb.add_argument("--env", required=required, metavar="ID", help="a Gymnasium id, such as pbcs/Maze-v0", **number)
    verb.add_argument("--env-kwargs", type=json_object, default=[{}] if several else {}, metavar="JSON",
                      help="options of the environment, such as '{\"size\": 5}'" + more, **number)
    verb.add_argument("--goal", metavar="RULE", help="what a success is, such as 'reward>0' or 'obs[0]>1 and "
                                                     "|obs[1]|<0.1', in place of what the environment reports")
    verb.add_argument("--start-seed", type=integer(0), metavar="N",
                      help="begin every episode as reset(seed=N) does, for environments that draw start and goal")
    verb.add_argument("--reset-options", type=json_object, metavar="JSON",
                      help="what every reset gets as options, such as '{\"start\": [0, 1]}'")
    verb.add_argument("--feature", metavar="RULE", help="what is explored, such as 'qpos[0:2]' or 'obs[0],obs[3]'")


def _add_planner(verb: Parser, default: str | None = "Rides", usual: str = "Rides") -> None:
    verb.add_argument("--planner", default=default, metavar="NAME", help=f"a registered one or module:Class ({usual})")
    verb.add_argument("--planner-kwargs", type=json_object, default={}, metavar="JSON",
                      help="options of the planner, such as '{\"bin_size\": 0.2}'")


def _add_seed(verb: Parser) -> None:
    verb.add_argument("--seed", type=integer(0), default=0, metavar="N", help="seed of everything random (0)")


def _add_budget(verb: Parser, default: int) -> None:
    verb.add_argument("--max-transitions", type=integer(1), default=default, metavar="N",
                      help=f"stop after N environment steps ({default:,})")


def _add_improve(verb: Parser) -> None:
    verb.add_argument("--improve", type=amount, metavar="AMOUNT",
                      help="make the plan shorter afterwards: with 5000 transitions, 10%% of those of the search, "
                           "or in 2s; planners that continue after a first solution (SSTCompiled, RidesSST) use it "
                           "themselves, and without it all of their budget")


def _add_trust(verb: Parser, source: str) -> None:
    verb.add_argument("--trust", action="store_true",
                      help=f"run the code of the modules that {source} names; only for folders of people you trust")


def _add_out(verb: Parser) -> None:
    verb.add_argument("--out", metavar="DIR", help="new folder for the results (one below runs/)")
