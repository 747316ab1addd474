"""Which planner needs the fewest environment steps in this maze?

    python examples/compare_planners.py
"""

import sys

from pbcs_ompl import compare


def main(seeds: str = "5") -> None:
    comparison = compare(["Ex", "RRTNH", "EST", "KPIECE1"], "pbcs/Maze-v0", env_kwargs={"size": 3},
                         seeds=int(seeds), max_transitions=100_000)
    for row in comparison.summary()["rows"]:
        low, high = row["wilson"]
        median = row["transitions_median"] or float("nan")
        print(f"{row['planner']:<10}{row['solved']}/{row['runs']} solved ({low:.0%} to {high:.0%}), "
              f"median {median:,.0f} transitions")


if __name__ == "__main__":
    main(*sys.argv[1:])
