"""The claims of the deadlock study on records whose truth is known."""

import numpy as np

from pbcs_ompl.experiments.claims import rate
from pbcs_ompl.experiments.study import find_study

LOOP = {"steps": 200, "evaluate_every": 100, "patience": 3}
ANALYSE = find_study("deadlock").analyse


def record(variant, success, first, *, stuck=0.0, saturated=1.0, rewarded=0.01, expert_after=None):
    """One stack: `success` at 0, 100 and 200 steps [3, S]."""
    seeds = len(first)
    observed = {"saturation": saturated, "deadlock_index": stuck, "flat_share": 0.8,
                "distance_to_returns": 0.0 if stuck else 0.5}
    return {"variant": variant, "loop": LOOP, "expert_after": expert_after, "seeds": list(range(seeds)),
            "success": success, "first_reward": first, "rewarded": [[rewarded] * seeds] * 3, "critics": [],
            "observed": {name: [[value] * seeds] * 3 for name, value in observed.items()}}


def verdicts(records, tmp_path):
    return {claim.claim: claim for claim in ANALYSE(records, tmp_path)}


def find(claims, words):
    (claim,) = [claim for text, claim in claims.items() if words in text]
    return claim


def test_a_world_as_the_thesis_describes_it(tmp_path):
    greedy = record("ddpg-epsilon-greedy", [[0] * 100, [1] * 99 + [0], [1] * 99 + [0]], [1] * 63 + [80] * 37, stuck=0.5)
    ou = record("ddpg-ornstein-uhlenbeck", [[0] * 100, [1] * 94 + [0] * 6, [1] * 94 + [0] * 6], [1] * 60 + [80] * 40,
                stuck=0.5)
    expert = record("ddpg-epsilon-greedy-expert", [[0] * 2, [1, 0], [1, 0]], [1, 80], stuck=0.5, expert_after=100)
    argmax = record("ddpg-argmax-epsilon-greedy", [[0], [1], [1]], [1])
    td3 = record("td3-epsilon-greedy", [[0, 0], [1, 0], [1, 0]], [1, 80], stuck=0.5)
    drift = {"variant": "drift", "updates": [0, 50, 100], "largest_value": [[0.1], [0.2], [0.1]],
             "largest_action": [[0.01], [0.1], [0.1]]}
    claims = verdicts([greedy, ou, expert, argmax, td3, drift], tmp_path)
    assert [claim.agrees for claim in claims.values()] == [True] * len(claims)
    assert len(claims) == 15
    assert find(claims, "drifts").numbers["updates until then, median"] == 50
    names = {path.name for path in tmp_path.iterdir()}
    assert {"success.png", "expert.png", "first-reward.png", "drift.png", "rewarded.png"} <= names
    assert {name for name in names if name.startswith("diagnostics")} == {
        f"diagnostics-{one}.png" for one in ("ddpg-epsilon-greedy", "ddpg-ornstein-uhlenbeck", "td3-epsilon-greedy",
                                             "ddpg-epsilon-greedy-expert")}


def test_the_opposite_world(tmp_path):
    greedy = record("ddpg-epsilon-greedy", [[0] * 10, [1] * 10, [0] * 5 + [1] * 5], [1] * 5 + [80] * 5, stuck=0.0,
                    saturated=0.2, rewarded=0.0)
    ou = record("ddpg-ornstein-uhlenbeck", [[0] * 10, [1] * 10, [1] * 10], [1] * 10)
    expert = record("ddpg-epsilon-greedy-expert", [[0] * 2, [0, 0], [1, 1]], [1, -1], expert_after=100)
    argmax = record("ddpg-argmax-epsilon-greedy", [[0], [0], [0]], [1], saturated=0.0)
    td3 = record("td3-epsilon-greedy", [[0], [0], [0]], [-1])
    claims = verdicts([greedy, ou, expert, argmax, td3], tmp_path)
    for words in ("Ornstein-Uhlenbeck noise fails more", "success is certain", "ddpg-epsilon-greedy fails on about",
                  "at least 0.1 %", "saturated actor", "shows no way", "is Q^pi", "remain so", "DDPG-argmax reaches",
                  "TD3 fails"):
        assert find(claims, words).agrees is False, words
    assert find(claims, "remain so").numbers["of the others"] == rate(0, 1)


def test_without_failures_there_is_nothing_to_say_of_failed_seeds(tmp_path):
    greedy = record("ddpg-epsilon-greedy", [[0] * 4, [1] * 4, [1] * 4], [1, 1, 80, 80])
    claims = verdicts([greedy], tmp_path)
    for words in ("less often solved", "at least 0.1 %", "saturated actor", "shows no way", "is Q^pi", "remain so"):
        claim = find(claims, words)
        assert claim.agrees is None
        assert claim.note or words == "less often solved"


def test_the_critic_of_a_failed_seed_is_drawn(tmp_path):
    failed = record("ddpg-ornstein-uhlenbeck", [[0], [0], [0]], [80], stuck=0.5)
    line = np.linspace(-0.1, 0.1, 5)
    failed["critics"] = [{"seed": 0, "states": [0.0, 0.05, 0.1, 0.3], "actions": line.tolist(),
                          "values": [(line < 0).astype(float).tolist()] * 4, "chosen": [0.1] * 4}]
    ANALYSE([failed], tmp_path)
    for ending in ("-map.png", ".png", "-enlarged.png"):
        assert (tmp_path / f"critic-ddpg-ornstein-uhlenbeck{ending}").stat().st_size > 5000
