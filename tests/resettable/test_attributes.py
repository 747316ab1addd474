"""The optional attributes: the page lists them as they are declared, and no library's names are taken for misspelt."""

import warnings
from dataclasses import fields
from pathlib import Path

import gymnasium
import pytest

from pbcs_ompl.core.registry import load_environments
from pbcs_ompl.resettable.attributes import EnvAttributes, misspelt

ROOT = Path(__file__).parents[2]


def test_the_page_lists_the_attributes_as_declared() -> None:
    page = (ROOT / "docs/environments.md").read_text()
    rows = "".join(f"| `{field.name}` | {field.metadata['default']} | {field.metadata['meaning']} |\n"
                   for field in fields(EnvAttributes))
    assert rows in page


def installed() -> list[str]:
    """One id of each registered class of environments."""
    load_environments()
    try:
        import gymnasium_robotics

        gymnasium.register_envs(gymnasium_robotics)
    except ImportError:
        pass
    latest = {str(spec.entry_point): name for name, spec in gymnasium.registry.items()}
    return sorted(latest.values())


@pytest.mark.parametrize("env_id", installed())
def test_no_environment_of_a_library_is_suspected(env_id: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            env = gymnasium.make(env_id, disable_env_checker=True).unwrapped
        except Exception as error:  # an extra that is not installed, or a version that does not run
            pytest.skip(f"{env_id}: {error}")
    assert misspelt(env) == {}
