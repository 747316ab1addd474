"""`pbcs doctor`: what is installed, what does not go together, what was found, what can be reset."""

import os
import shutil
import sys
from argparse import Namespace
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from platform import platform, python_version
from typing import Any

from pbcs_ompl.bridge.planner_spec import PlannerSpec
from pbcs_ompl.cli.arguments import environment
from pbcs_ompl.cli.busy import Busy
from pbcs_ompl.cli.lists import MISSING_TORCH
from pbcs_ompl.cli.models import describe
from pbcs_ompl.cli.terminal import print_summary
from pbcs_ompl.core.errors import InvalidOption, PbcsError
from pbcs_ompl.core.registry import load_environments, module_of, names
from pbcs_ompl.results.command_line import command
from pbcs_ompl.results.files import write_text

SURVEY = "runs/doctor"
STRATEGIES = "pbcs_ompl.planners"
NEEDED = ("pbcs-ompl", "ompl", "gymnasium", "numpy", "scipy", "numba", "python-fcl", "matplotlib", "rich")
OPTIONAL = ("torch", "safetensors", "mujoco", "gymnasium-robotics", "imageio", "stable-baselines3")


def run(arguments: Namespace) -> int:
    """Look, change nothing. Returns 3 when a needed library is missing, 1 when the environment fails."""
    if arguments.all:
        return _run_survey(arguments)
    for name in ("out", "max_seconds"):
        if getattr(arguments, name) is not None:
            raise InvalidOption(f"--{name.replace('_', '-')} goes with --all")
    versions = {"python": python_version(), **{name: _version(name) for name in NEEDED + OPTIONAL}}
    missing = [name for name in NEEDED if versions[name] is None]
    result: dict[str, Any] = {
        "platform": platform(), "versions": versions, "missing": missing, "problems": bad_pairs(versions),
        "compiler": find_compiler(), "planners": _planners(), "agents": _agents(),
        "environments": _environments(),
        "environment": _check(arguments) if arguments.env else None,
    }
    print_summary(result, _closing_lines(result), as_json=arguments.json)
    if missing:
        return 3
    return 1 if result["environment"] and not result["environment"]["ok"] else 0


def _run_survey(arguments: Namespace) -> int:
    """Check all environments, and write the page."""
    from pbcs_ompl.resettable.survey import TIME_OUT, VERDICTS, Record, registered, survey
    from pbcs_ompl.resettable.survey_page import survey_page

    if arguments.env is not None:
        raise InvalidOption("--all checks every environment; leave out --env")
    out = Path(arguments.out or SURVEY)
    ids, limit = registered(), arguments.max_seconds or TIME_OUT

    def show(record: Record, done: int) -> None:
        print(f"{done}/{len(ids)} {record['id']}: {record['verdict']} {record['why']}".rstrip(), file=sys.stderr)

    records = survey(ids, out / "environments.json", seconds=limit, on_record=show)
    page = out / "environments.md"
    write_text(page, survey_page(records, command(["doctor", "--all"]), limit))
    counts = {verdict: sum(record["verdict"] == verdict for record in records) for verdict in VERDICTS}
    lines = [("", f"{count} {verdict}") for verdict, count in counts.items()]
    print_summary({"verdicts": counts, "page": str(page)}, [*lines, ("page", str(page))], as_json=arguments.json)
    return 0


def bad_pairs(versions: dict[str, str | None]) -> list[str]:
    """Return one line for each pair of installed versions that is known not to work together."""
    problems = []
    mujoco = versions.get("mujoco")
    if mujoco == "4.0.0":
        problems.append("mujoco 4.0.0 computes wrong accelerations for models with a sparse constraint "
                        "Jacobian; install mujoco 4.0.1 or newer, or 3.x")
    if mujoco and versions.get("gymnasium-robotics") and _numbers(mujoco) > (3, 8):
        problems.append(f"the Fetch, Hand and Kitchen environments of gymnasium-robotics fail with mujoco "
                        f"{mujoco}; install mujoco 3.8 for them (its mazes and Adroit work with both)")
    return problems


def find_compiler() -> str | None:
    """Return the C++ compiler that `torch.compile` would use, None when there is none."""
    candidates = (os.environ.get("CXX"), "g++", "clang++", "c++")
    return next((path for path in (shutil.which(name) for name in candidates if name) if path), None)


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(".")[:2] if part.isdigit())


def _planners() -> dict[str, str]:
    """Return for each registered planner "ready", or why it cannot be built here.

    Those of OMPL and of plug-ins are built. The strategies of the package need nothing that could be missing, and to
    build them all would compile their kernels.
    """
    space_information = _smallest_problem()
    states = {}
    for name in names("planner"):
        if module_of("planner", name) == STRATEGIES:
            states[name] = "ready"
            continue
        try:
            PlannerSpec(name, {}).build(space_information, 0)
            states[name] = "ready"
        except PbcsError as error:
            states[name] = str(error)
    return states


def _agents() -> dict[str, str]:
    """Return for each registered agent "ready", or what skill training lacks here; torch is not imported to see it."""
    lacking = [name for name in ("torch", "safetensors") if find_spec(name) is None]
    return dict.fromkeys(names("agent"), MISSING_TORCH if lacking else "ready")


def _smallest_problem() -> Any:
    """Return the space information of a problem in the plane, for planners to be built on."""
    from ompl import base as ob
    from ompl import control as oc

    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0)
    bounds.setHigh(1)
    states = ob.RealVectorStateSpace(2)
    states.setBounds(bounds)
    controls = oc.RealVectorControlSpace(states, 2)
    controls.setBounds(bounds)
    return oc.SpaceInformation(states, controls)


def _environments() -> list[str]:
    import gymnasium

    load_environments()
    return sorted(name for name in gymnasium.registry if name.startswith("pbcs/"))


def _check(arguments: Namespace) -> dict[str, Any]:
    from pbcs_ompl.resettable import check_resettable, make

    with Busy("pbcs doctor") as busy:
        busy.stage("making the environment, finding out what its state is")
        model = make(environment(arguments))
        report = check_resettable(model, on_check=busy.stage)
    return {"env": report.env_id, "ok": report.ok, "checks": [asdict(check) for check in report.checks],
            **describe(model)}


def _closing_lines(result: dict[str, Any]) -> list[tuple[str, str]]:
    installed = ", ".join(f"{name} {number}" for name, number in result["versions"].items() if number)
    lines = [("platform", result["platform"]), ("versions", installed)]
    lines += [("MISSING", f"{name}: pip install {name}") for name in result["missing"]]
    lines += [("PROBLEM", problem) for problem in result["problems"]]
    lines.append(("compiler", result["compiler"] or "none: gradient steps run eagerly, several times slower"))
    ready = [name for name, state in result["planners"].items() if state == "ready"]
    lines.append(("planners", ", ".join(ready)))
    lines += [("", f"{name}: {state}") for name, state in result["planners"].items() if state != "ready"]
    able = [name for name, state in result["agents"].items() if state == "ready"]
    lines.append(("agents", ", ".join(able) or f"none can train here: each {MISSING_TORCH}"))
    lines += [("envs", ", ".join(result["environments"]))]
    if result["environment"] is not None:
        checks = result["environment"]["checks"]
        verdict = "is resettable" if result["environment"]["ok"] else "is NOT resettable"
        lines.append(("reset", f"{result['environment']['env']} {verdict}"))
        lines += [("", f"{'ok  ' if c['ok'] else 'FAIL'} {c['name']} {c['detail']}".rstrip()) for c in checks]
        found = result["environment"]
        abilities = f"{', '.join(found['capabilities'])}; {found['adapter']}, {found['state_size']} numbers a state"
        lines += [("offers", abilities), ("feature", found["feature"]), ("goal", found["goal"])]
    return lines
