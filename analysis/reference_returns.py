"""Measures what ships with the code: returns of the constant plans and fixed strategies on the test sites,
and of the constant plans on the validation sites that a training's course is measured on.

    python analysis/reference_returns.py      # four minutes on two idle cores

The score of every run is measured by them. A table that is of this physics is left as it is. After a change of the
physics, or of the test sites, the tables that are there are not used until this is run again: a run then measures
its own, and says so. Writes cleanrl_style/protocol/reference/<environment>.csv.gz.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import paths
from analysis.studies.constant_plans import ENVIRONMENTS
from baselines_heuristic import conifer_restoration, obeying, random_valid, target_density
from cleanrl_style import protocol
from cleanrl_style.protocol import course, reference, sites

STRATEGIES = {
    "target_density": target_density.policy,
    "conifer_restoration": conifer_restoration.policy,
    "random_valid": random_valid.policy,
}  # those that are no constant plan


@dataclass
class Args:
    """Measures the returns that the score is measured by."""

    folder: Path = Path("cleanrl_style", "protocol", reference.FOLDER)
    """folder of the tables"""
    episodes: int | None = None
    """the first of the test sites (None: all)"""


def measure(task: protocol.Task, test: list[int], validation: list[int]) -> pd.DataFrame:
    """Returns of the constant plans on sites of both splits, and of the fixed strategies on the first test sites."""
    tables = [reference.measure(task, [*test, *validation])]
    for name, policy in STRATEGIES.items():
        corner = np.eye(task.num_objectives)[0]
        episodes, _ = protocol.evaluate(task, obeying(policy), [corner], len(test), ("sampled",))
        tables.append(episodes.assign(plan=name)[tables[0].columns])
    return pd.concat(tables, ignore_index=True)


def main(args: Args) -> None:
    """Measure what is missing or of another physics."""
    test = list(sites.published_seeds("test"))
    if args.episodes is not None and not 1 <= args.episodes <= len(test):
        protocol.fail(f"--episodes {args.episodes}: 1 to {len(test)} are allowed")
    test = test[: args.episodes]
    paths.make_writable("--folder", args.folder)
    validation = list(sites.published_seeds("validation"))[: course.STANDS]  # of a training's course
    for env_id in ENVIRONMENTS:
        task, path = protocol.Task.of(env_id), args.folder / f"{env_id}.csv.gz"
        physics = reference.fingerprint(task)
        if path.exists():
            table, its_physics = reference.read(path)
            if its_physics == physics and set(table.seed) == {*test, *validation}:
                print(f"{path} is of this physics")
                continue
        reference.write(path, measure(task, test, validation), physics)
        print(f"wrote {path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
