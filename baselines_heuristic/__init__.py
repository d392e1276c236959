"""Fixed strategies, four of the paper and random actions, as functions of the observations, and their command line."""

import time
from dataclasses import dataclass
from typing import Literal

from cleanrl_style.flags import parse


@dataclass
class Args:
    """Evaluates a strategy that does not learn under the protocol of the trained agents and leaves a run folder."""

    seed: int = 1
    """names the run's folder: episodes, and random actions, are always the same"""
    env_id: str | None = None
    """boreal-balanced-v0 or another that `python -m boreal_env` lists, or a BorealEnv's module:id (None: the mode's)"""
    mode: Literal["generalist", "site-specific"] | None = None
    """a new site and weather in every episode, or one fixed site (None: the environment's)"""
    site_seed: int | None = None
    """another fixed site in site-specific mode; in generalist mode one site, under new weather in every episode"""
    thaw_formulation: Literal["asymmetric", "contrast", "raw_degree_days"] | None = None
    """formula of the thaw reward (None: the environment's, asymmetric)"""
    masks: bool = True
    """do nothing in a year whose action cannot be carried out in full; without masks what can be done of it is done,
    and the rest costs carbon reward (not for random_valid.py)"""
    eval_episodes: int = 200
    """evaluation episodes per weight, each on another site (of one site: in another weather)"""
    eval_weights: tuple[float, ...] | None = None
    """carbon weights of the evaluation (None: 0 0.25 .. 1); of three and more objectives, as many numbers a weight"""
    run_dir: str | None = None
    """folder of the run (None: runs/<script>/<env-id>[-<what is not default>]/seed<seed>)"""
    overwrite: bool = False
    """start over in a folder that already holds a run"""


def obeying(policy, masked: bool = True):
    """A strategy as it is played: probabilities (n, 25), of observations (n, d) and masks (n, 25).

    policy gives actions (n,), or probabilities already. Where the mask forbids its action, nothing is done; not masked,
    it is played.
    """
    import numpy as np

    from boreal_env import where_valid

    def probabilities(observations, masks, accrued_returns=None):
        chosen = policy(observations, masks)
        if chosen.ndim == 2:
            return chosen
        return np.eye(25)[where_valid(chosen, masks) if masked else chosen]

    return probabilities


def main(script: str, policy) -> None:
    """Evaluate `policy`, a function of observations (n, d) and masks (n, 25), as a script.

    script : its file, `__file__`.

    It does not look at the preference: its episodes are the same under every weight, and are simulated once. One that
    does is refused in the first year. None has another policy when greedy: random actions stay random.
    """
    args = parse(Args)  # a bad flag is answered before all that follows is loaded

    import numpy as np

    import boreal_env
    from cleanrl_style import protocol

    task = protocol.make_task(args)
    if not task.boreal:
        protocol.fail(f"--env-id {args.env_id}: fixed strategies know the boreal environments alone")
    if not task.bare:
        protocol.fail(f"--env-id {args.env_id}: a wrapper may change what fixed strategies look at; none is allowed")
    seen = task.make().unwrapped.observation_names
    needed = {row.name for row in boreal_env.OBSERVATION if row.group != "site"} - {"preference"}
    if task.masks is None or not task.observes_preference or not needed <= set(seen):
        groups = ", ".join(group for group in boreal_env.OBSERVATION_GROUPS if group != "site")
        protocol.fail(f"--env-id {args.env_id}: fixed strategies look at {groups}; observation_groups must have them")

    if not args.masks and policy(np.zeros((1, len(seen))), np.ones((1, 25), bool)).ndim == 2:
        protocol.fail(
            "--no-masks: actions of this strategy are drawn from the valid ones; it is for those that name one"
        )
    played = obeying(policy, args.masks)

    def action_probabilities(observations, masks, accrued_returns):
        # laid out as for two objectives, whatever their number: a strategy does not look at the weights
        observations = observations[:, task.num_objectives - 2 :]
        probabilities = played(observations, masks)
        others = observations.copy()
        others[:, 0] = 1.0 - others[:, 0]
        if not np.array_equal(probabilities, played(others, masks)):
            protocol.fail(f"{script}: it looks at the preference, and is played once for all; protocol.evaluate can")
        return probabilities

    with protocol.Run(args, task, script) as run:
        start = time.perf_counter()
        corner = np.eye(task.num_objectives)[0]
        episodes, years = protocol.evaluate(task, action_probabilities, [corner], args.eval_episodes, ("sampled",))
        run.time("evaluation", 0, time.perf_counter() - start)
        run.finish(*(repeat(task, table, args.eval_weights) for table in (episodes, years)))


def repeat(task, table, weights):
    """The table of episodes, or of their years, once for every policy and weight, scalarised anew."""
    import pandas as pd

    from cleanrl_style import protocol
    from cleanrl_style.protocol import fronts

    copies = []
    for policy in protocol.POLICIES:
        for its_weights in map(task.check_weights, weights):
            copy = table.assign(policy=policy, **task.weights_row(its_weights))
            if "scalarized_return" in copy:
                copy["scalarized_return"] = protocol.scalarize(fronts.returns_of(copy), its_weights)
            copies.append(copy)
    return pd.concat(copies, ignore_index=True)
