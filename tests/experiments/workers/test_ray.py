"""On a Ray cluster, here of two nodes on this machine, every run ends exactly once, whatever becomes of the nodes."""

import re
import shlex
import sys
from contextlib import closing
from pathlib import Path

import pytest
from deeds import deed, do

from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import InvalidOption, Mismatch, MissingDependency
from pbcs_ompl.experiments.compare import compare
from pbcs_ompl.experiments.run import Failure
from pbcs_ompl.experiments.workers import Limits
from pbcs_ompl.experiments.workers.ray import ray_cluster

NODE = {"num_cpus": 1, "object_store_memory": 100_000_000}


@pytest.fixture
def cluster(monkeypatch):
    """Start a cluster of one node; the test may add others."""
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'pbcs-ompl[ray]'")
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={**NODE, "include_dashboard": False})
    yield cluster
    cluster.shutdown()


def execute(cluster, runs, jobs=None, **limits):
    with ray_cluster(cluster.address, jobs) as executor:
        yield from executor(runs, do, Limits(**limits))


@pytest.mark.slow
def test_a_lost_node_costs_no_run(cluster):
    node = cluster.add_node(**NODE)
    runs = [deed("sleep", 0.5 + number / 1000) for number in range(12)]
    records, pids = [], set()
    with closing(execute(cluster, runs)) as ended:
        for _, record in ended:
            records.append(record)
            pids.add(record["pid"])
            if len(records) == 4:
                cluster.remove_node(node, allow_graceful=False)
    assert len(pids) >= 2  # both nodes had a part
    assert not any(isinstance(record, Failure) for record in records)
    assert sorted(record["value"] for record in records) == [run.settings["value"] for run in runs]


@pytest.mark.slow
def test_runs_that_go_wrong_cost_only_themselves_and_limits_hold(cluster):
    runs = [deed("square", 3), deed("kill", 1), deed("refuse", 2), deed("sleep", 60), deed("eat", 400),
            deed("square", 4)]
    found = {run.name: found for run, found in execute(cluster, runs, 1, max_seconds=6.0, max_memory=300.0)}
    assert len(found) == len(runs)
    assert (found["square-3"]["value"], found["square-4"]["value"]) == (9, 16)
    assert found["kill-1"].reason.startswith("the process died, Killed")
    assert found["refuse-2"].reason.startswith("ValueError")
    assert found["sleep-60"].reason.startswith("killed after 6 s")
    assert "MB of memory" in found["eat-400"].reason


@pytest.mark.slow
def test_a_node_with_other_versions_is_named_before_any_run(cluster, tmp_path):
    other = tmp_path / "numpy-9.9.9.dist-info"
    other.mkdir()
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: numpy\nVersion: 9.9.9\n")
    cluster.add_node(**NODE, env_vars={"PYTHONPATH": str(tmp_path)})
    with pytest.raises(Mismatch, match=r"^node \w+ has numpy 9\.9\.9 \(here 2[.\d]+\); install the same"):
        list(execute(cluster, [deed("note", str(tmp_path / "noted"))]))
    assert not (tmp_path / "noted").exists()


@pytest.mark.slow
def test_what_the_docs_say_of_a_cluster_works(cluster, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RAY_ADDRESS", cluster.address)
    page = (Path(__file__).parents[3] / "docs/execution.md").read_text()
    command, = re.findall(r"^pbcs (.*--executor ray.*)$", page, flags=re.MULTILINE)
    assert main(shlex.split(command)) == 0
    snippet, = re.findall(r"^```py\n(.*?)^```$", page, flags=re.MULTILINE | re.DOTALL)
    names = {}
    exec(snippet, names)
    assert len(names["result"].records) == 9


@pytest.mark.slow
def test_a_comparison_finds_there_what_it_finds_here(cluster):
    cluster.add_node(**NODE)
    settings = {"planners": ["Ex", "RRT"], "env": "pbcs/Maze-v0", "env_kwargs": {"size": 2}, "seeds": 3}
    with ray_cluster(cluster.address) as executor:
        there, again = (compare(**settings, jobs=executor).runs for _ in range(2))
    found = [[{key: record[key] for key in ("planner", "seed", "solved", "transitions", "nodes", "path_length")}
              for record in records] for records in (there, again, compare(**settings).runs)]
    assert found[0] == found[1] == found[2]


def test_an_address_without_a_cluster_is_named():
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'pbcs-ompl[ray]'")
    with pytest.raises(InvalidOption, match="no Ray cluster at 'localhost:1': "), ray_cluster("localhost:1"):
        pass


def test_a_cluster_of_another_ray_is_named(monkeypatch):
    ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'pbcs-ompl[ray]'")

    def refuse(**_):
        raise RuntimeError("Version mismatch: The cluster was started with:\n    Ray: 1.0")

    monkeypatch.setattr(ray, "init", refuse)
    with pytest.raises(Mismatch, match=r"cluster at 'auto': Version mismatch: .* with: Ray: 1\.0$"), ray_cluster():
        pass


def test_ray_that_is_not_installed_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingDependency, match=r"pip install 'pbcs-ompl\[ray\]'"), ray_cluster():
        pass
