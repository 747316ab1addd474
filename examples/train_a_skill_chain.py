"""How do I turn a plan into a policy that withstands noise?

    python examples/train_a_skill_chain.py
"""

import sys
from pathlib import Path

import pbcs_ompl
from pbcs_ompl.figures.canvas import save
from pbcs_ompl.figures.chain import chain_figure


def main(size: str = "2", folder: str = "runs/example-chain") -> None:
    model = pbcs_ompl.make("pbcs/Maze-v0", {"size": int(size)})
    plan = pbcs_ompl.plan(model, planner="Ex", seed=0)
    if plan.trajectory is None:
        sys.exit("no path was found")
    print(f"plan: {plan.path_length} steps, open loop")

    result = pbcs_ompl.train(model, method="pbcs", trajectory=plan.trajectory, seed=0)
    if result.chain is None:
        sys.exit(result.reason)
    print(f"chain: {len(result.chain.skills)} skills, {result.summary()['train_transitions']:,} transitions")
    for epsilon in (0.0, 0.1, 0.2):
        evaluation = pbcs_ompl.evaluate(result.chain, epsilon=epsilon)
        print(f"success with {epsilon:.0%} random actions: {evaluation.success_rate:.0%}")

    result.chain.save(folder)
    chain = pbcs_ompl.SkillChain.load(folder)
    rollout = chain.rollout(model)
    sets = [(skill.activation.center, skill.activation.radius) for skill in chain.skills]
    figure = chain_figure(model, trajectory=plan.trajectory.states, rollout=rollout, activations=sets)
    print(f"chain and picture in {save(figure, Path(folder) / 'chain.png').parent}")


if __name__ == "__main__":
    main(*sys.argv[1:])
