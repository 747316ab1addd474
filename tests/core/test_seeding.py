"""Laws of the seed tree: a path gives the same stream, in any order and process; other paths give others."""

import os
import subprocess
import sys

from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.core.seeding import SeedTree

seeds = st.integers(0, 2**64)
names = st.text(max_size=10) | st.integers(0, 2**32 - 1)


def subtree(seed, path):
    tree = SeedTree(seed)
    for name in path:
        tree = tree.child(name)
    return tree


@given(seeds, st.lists(names, max_size=3))
def test_equal_paths_give_equal_streams(seed, path):
    one, other = subtree(seed, path), subtree(seed, path)
    other.generator()
    other.child("something else").generator().random()
    assert one.integer() == other.integer()
    assert one.generator().random(3).tolist() == other.generator().random(3).tolist()


@given(seeds, st.lists(names, max_size=3))
def test_integers_are_what_libraries_take(seed, path):
    assert 1 <= subtree(seed, path).integer() <= 2**31 - 1


@given(seeds, st.lists(names, max_size=3))
def test_long_integers_have_64_bits(seed, path):
    assert 0 <= subtree(seed, path).integer64() <= 2**64 - 1
    assert subtree(seed, path).integer64() == subtree(seed, path).integer64()


def test_different_paths_give_different_streams():
    trees = [subtree(seed, path) for seed in range(20)
             for path in ([], ["a"], ["b"], ["a", "b"], ["b", "a"], [0], [1], [0, 1], ["a", 0])]
    assert len({tree.generator().random() for tree in trees}) == len(trees)
    assert len({tree.integer() for tree in trees}) == len(trees)


def test_streams_do_not_depend_on_the_process():
    program = ("from pbcs_ompl.core.seeding import SeedTree; "
               "print(SeedTree(7).child('ompl').child(3).integer())")
    for hash_seed in ("1", "2"):
        fresh = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True,
                               env={**os.environ, "PYTHONHASHSEED": hash_seed})
        assert int(fresh.stdout) == SeedTree(7).child("ompl").child(3).integer()
