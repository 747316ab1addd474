"""What Docker and conda install is what pip installs."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_the_conda_recipe_needs_what_the_wheel_needs():
    text = (ROOT / "conda" / "meta.yaml").read_text()
    run = text.partition("  run:\n")[2].partition("\ntest:")[0]
    listed = {line.strip().removeprefix("- ").replace("matplotlib-base", "matplotlib") for line in run.splitlines()}
    declared = {re.sub(r"^([\w-]+)", r"\1 ", one) for one in PROJECT["dependencies"]}
    assert listed - {""} == declared | {f"python {PROJECT['requires-python']}"}
    assert all(f"{name} = {target}" in text for name, target in PROJECT["scripts"].items())


def test_the_image_holds_what_a_wheel_is_built_from():
    lines = (ROOT / "Dockerfile").read_text().splitlines()
    copied = [word for line in lines if line.startswith("COPY") for word in line.split()[1:-1]]
    assert all((ROOT / name).exists() for name in copied)
    links = [path.readlink().parts[-1] for path in (ROOT / "pbcs_ompl").iterdir() if path.is_symlink()]
    assert {*links, "pbcs_ompl", "pyproject.toml", PROJECT["readme"], *PROJECT["license-files"]} <= set(copied)
    allowed = [line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")]
    assert sorted(allowed) == sorted(copied)
