"""Solve rates of PBCS on the mazes: `python tests/benchmarks/pbcs_solve_rates.py [--sizes 2 3 4 5 7] [--preset fast]`.

Seed s plans and trains with seed s; mazes of size 4 and more are maze_seed s. "Solved" = the chain reaches the target
from the start without noise, and in at least 95 of 100 executions in which a tenth of the actions is random. The
verification that belongs to training is counted in the transitions; the evaluation that decides "solved" is not.
"""

import argparse
import json
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from statistics import median

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.skills import train

SEEDS = {2: 20, 3: 20, 4: 20, 5: 20, 7: 10, 10: 5, 15: 5}
BUDGET = 10_000_000


def run(size: int, seed: int, method: str, preset: str, budget: int) -> dict:
    """Train once and return the summary."""
    kwargs = {"size": size} if size < 4 else {"size": size, "maze_seed": seed}
    result = train("pbcs/Maze-v0", env_kwargs=kwargs, method=method, preset=preset, seed=seed, max_transitions=budget)
    return result.summary() | {"size": size}


def row(label: str, runs: list[dict]) -> str:
    """Return one line of the table."""
    solved = sum(r["solved"] for r in runs)
    low, high = wilson(solved, len(runs))
    middle = {key: median(r[key] for r in runs) for key in ("plan_transitions", "train_transitions", "updates",
                                                            "skills", "seconds")}
    return (f"| {label} | {solved}/{len(runs)} [{low:.2f}, {high:.2f}] | {middle['plan_transitions']:,.0f} | "
            f"{middle['train_transitions']:,.0f} | {middle['updates']:,.0f} | {middle['skills']:g} | "
            f"{middle['seconds']:.1f} |")


def main() -> None:
    """Run all sizes and seeds in separate processes and print one row for each size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[2, 3, 4, 5, 7])
    parser.add_argument("--seeds", type=int, help="runs of each size (default: 20, ten for 7x7, five above)")
    parser.add_argument("--first-seed", type=int, default=0, help="100 for seeds that no setting was chosen on (0)")
    parser.add_argument("--method", default="pbcs")
    parser.add_argument("--preset", default="fast")
    parser.add_argument("--max-transitions", type=int, default=BUDGET)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    print("| maze | solved (95 % Wilson) | plan transitions | training transitions | updates | skills | seconds |")
    print("|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        for size in options.sizes:
            count = options.seeds or SEEDS.get(size, 5)
            seeds = range(options.first_seed, options.first_seed + count)
            futures = [pool.submit(run, size, seed, options.method, options.preset, options.max_transitions)
                       for seed in seeds]
            runs = [future.result() for future in futures]
            print(row(f"{size}x{size}", runs), flush=True)
            for record in runs:
                if not record["solved"]:
                    print(f"  not solved: {json.dumps(record)}", flush=True)


if __name__ == "__main__":
    main()
