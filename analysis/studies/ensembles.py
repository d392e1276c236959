"""What trainings score together: policies of several seeds of Group PPO, averaged, beside each for itself.

    python analysis/studies/ensembles.py      # five minutes on two idle cores

Seeds of one method differ, though they learn the same. Is that chance, of sites, dice and actions that a training
happened to see? Then the mean of several policies is better than any of them: chance is averaged away, and what all
have learnt stays. Here the mean of the logarithms of their probabilities chooses. Disjoint sets of the seeds whose
policies are archived play the evaluation's sites. Leaves results/studies/ensembles.csv, a row a task, set and site: the
scalarised gain.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import experiments, metrics, paths, stored
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts, reference

SCRIPT = "ppo_group"
TASKS = (experiments.GENERALIST, experiments.BALANCED)
LEAST = 1e-12  # a probability of 0 would be a veto of one for all


@dataclass
class Args:
    """Measures what averaged policies gain."""

    eval_episodes: int = 200
    """evaluation episodes per weight"""
    quick: bool = False
    """2 episodes, all seeds together: to see that it runs, into results/quick/studies"""


def policies_of(folder: Path) -> dict[int, Path]:
    """Training seed -> archived policy, in their order."""
    found = {int(file.parent.name.removeprefix("seed")): file for file in folder.glob("seed*/policy.pt")}
    return dict(sorted(found.items()))


def sets_of(seeds: list[int], size: int) -> list[list[int]]:
    """Disjoint sets of training seeds, as many as there are."""
    return [seeds[first : first + size] for first in range(0, len(seeds) - size + 1, size)]


def together(policies: list):
    """The policy that a mean of policies is: action probabilities (n, 25)."""

    def probabilities(observations, masks, accrued_returns):
        logs = [np.log(np.maximum(one(observations, masks, accrued_returns), LEAST)) for one in policies]
        mean = np.where(masks, np.exp(np.mean(logs, axis=0)), 0.0)
        return mean / mean.sum(axis=1, keepdims=True)

    return probabilities


def gains_of(policies: list, task: protocol.Task, episodes: int) -> pd.Series:
    """Scalarised gain of each site, mean over the weights, of policies together."""
    weights = fronts.evaluation_weights(task.num_objectives)
    evaluation, _ = protocol.evaluate(task, together(policies), weights, episodes, ("greedy",))
    plans = reference.reference_returns(task, evaluation.seed.drop_duplicates().tolist())
    nothing = plans[plans.plan == reference.NOTHING]
    return metrics.of_sites(metrics.gains(evaluation, nothing))


def path(quick: bool = False) -> Path:
    """The table."""
    return paths.studies(quick) / "ensembles.csv"


def main(args: Args) -> None:
    """Play every set on both tasks, and write the table."""
    episodes = 2 if args.quick else args.eval_episodes
    archive = paths.there(paths.archive())
    there = {task_id: policies_of(archive / SCRIPT / f"{task_id}-vectorization=lockstep") for task_id in TASKS}
    if lacking := [task_id for task_id, files in there.items() if len(files) < 2]:
        commands = "python analysis/reproduce.py --only main balanced, python analysis/archive.py"
        protocol.fail(f"{archive / SCRIPT}: two policies or more of {lacking[0]} are needed ({commands})")
    digest = hashlib.sha256(b"".join(file.read_bytes() for files in there.values() for file in files.values()))
    made_by = {"episodes": episodes, "policies": digest.hexdigest()[:16]}
    if stored.is_finished(path(args.quick), made_by):
        print(f"{path(args.quick)} is finished")
        return
    tables = []
    for task_id, files in there.items():
        policies = {seed: protocol.load_policy(file.parent) for seed, file in files.items()}
        seeds, number = list(policies), len(policies)
        task = policies[seeds[0]].task()
        sizes = {number} if args.quick else {2, number // 2, number} - {1}  # single seeds are the main table's
        for size in sorted(sizes):
            for chosen in sets_of(seeds, size):
                print(f"{task_id}: seeds {', '.join(map(str, chosen))}", flush=True)
                gained = gains_of([policies[seed] for seed in chosen], task, episodes)
                rows = {"task": task_id, "size": size, "first_seed": chosen[0], "seed": gained.index, "gain": gained}
                tables.append(pd.DataFrame(rows))
    stored.write(path(args.quick), pd.concat(tables, ignore_index=True), made_by)
    print(f"wrote {path(args.quick)}")


if __name__ == "__main__":
    main(protocol.parse(Args))
