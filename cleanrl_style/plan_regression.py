# Plan regression: a contextual bandit. Its arms are plans that do the same every year, its context is the site, and
# what an arm returns is learned by ridge regression, from sites on which all play under the same weather and dice.
import random
import time
from dataclasses import dataclass
from typing import Literal

from cleanrl_style.flags import parse


@dataclass
class Args:
    """Plan regression on the boreal forest environments: trains, evaluates, and leaves a run folder."""

    seed: int = 1
    """seed of the run: training episodes"""
    env_id: str | None = None
    """boreal-balanced-v0 or another that `python -m boreal_env` lists, or a BorealEnv's module:id (None: the mode's)"""
    mode: Literal["generalist", "site-specific"] | None = None
    """a new site and weather in every episode of a group, or one fixed site (None: the environment's)"""
    site_seed: int | None = None
    """another fixed site in site-specific mode; in generalist mode one site, under new weather in every episode"""
    thaw_formulation: Literal["asymmetric", "contrast", "raw_degree_days"] | None = None
    """formula of the thaw reward (None: the environment's, asymmetric)"""
    hide_site: bool = False
    """observe no site parameters: what is then learned is one plan for each preference"""
    total_timesteps: int | None = None
    """steps, summed over all environments (None: 300000, in site-specific mode 100000)"""
    vectorization: Literal["async", "lockstep"] = "async"
    """environments in worker processes, or all in one compiled call"""

    # Algorithm
    screening: float = 0.2
    """share of the steps in which all 21 plans are played, a round at least; then those closest to the best"""
    finalists: Literal[3, 4, 6, 7, 12, 21] = 6
    """how many are played on; divides the number of environments, 84"""
    ridge: float = 100.0
    """penalty of the slopes, of parameters with mean 0 and deviation 1: weighs as much as so many sites; not 0"""

    # Evaluation and output
    eval_episodes: int = 200
    """evaluation episodes per weight, each on another site (of one site: in another weather)"""
    eval_weights: tuple[float, ...] | None = None
    """carbon weights of the evaluation (None: 0 0.25 .. 1); of three and more objectives, as many numbers a weight"""
    run_dir: str | None = None
    """folder of the run (None: runs/<script>/<env-id>[-<what is not default>]/seed<seed>)"""
    overwrite: bool = False
    """start over in a folder that already holds a run"""
    track: tuple[Literal["tensorboard", "wandb"], ...] = ()
    """follow the run's tables in TensorBoard (files in the run's folder) or Weights & Biases"""
    wandb_project_name: str = "borearl"
    """project of Weights & Biases"""

    num_envs = 84  # no flag: four groups of 21 plans, then as many as there are of the finalists
    limits = {"screening": (0, 1), "ridge": (0.001, 10**9)}


if __name__ == "__main__":
    args = parse(Args)  # a bad flag is answered before all that follows is loaded

import numpy as np
import torch
import torch.nn as nn

from boreal_env import where_valid
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts

# Doing nothing, and the four changes of density with five conifer shares each: all plans that do the same every year.
PLANS = (12, *range(10), *range(15, 25))


class Agent(nn.Module):
    """Of every plan and objective, the return as a linear function of what is observed of the site.

    inputs : entries of the observation. Parameters are buffers, not trained by gradients.
    """

    def __init__(self, envs, plans, inputs, num_objectives):
        super().__init__()
        self.plans, self.inputs = np.array(plans), list(inputs)
        self.register_buffer("mean", torch.zeros(len(inputs), dtype=torch.double))
        self.register_buffer("std", torch.ones(len(inputs), dtype=torch.double))
        self.register_buffer("slopes", torch.zeros(1 + len(inputs), len(plans), num_objectives, dtype=torch.double))

    def features(self, sites):
        """1 and the scaled inputs, (n, 1 + inputs), of sites (n, inputs)."""
        return torch.cat([torch.ones((len(sites), 1), dtype=torch.double), (sites - self.mean) / self.std], dim=1)

    def predict(self, sites):
        """Returns (n, plans, m), less the plans' mean, on sites (n, inputs)."""
        return torch.tensordot(self.features(sites), self.slopes, dims=1)

    def fit(self, sites, returns, ridge):
        """Ridge regression of returns (n, plans, m) on sites (n, inputs).

        What a site gives to all plans is taken off: it decides nothing, and is most of what varies.
        """
        if self.inputs:
            std = sites.std(dim=0, correction=0)
            self.mean.copy_(sites.mean(dim=0))
            self.std.copy_(torch.where(std > 1e-6, std, 1.0))  # what is the same on all sites says nothing
        features = self.features(sites)
        penalty = torch.full((features.shape[1],), ridge, dtype=torch.double)
        penalty[0] = 0.0  # a plan's own mean is not shrunk
        apart = returns - returns.mean(dim=1, keepdim=True)
        known = features.T @ apart.flatten(1)
        self.slopes.copy_(torch.linalg.solve(features.T @ features + penalty.diag(), known).view_as(self.slopes))


def make_policy(agent):
    """Action probabilities (n, 25) of observations (n, d): of the plan that is best at the weights observed.

    A site's parameters stay the same for all of an episode, and so does its plan.
    """

    def action_probabilities(observations, masks, accrued_returns):
        predicted = agent.predict(torch.from_numpy(observations[:, agent.inputs]).double()).numpy()
        weights = protocol.observed_weights(observations, predicted.shape[2])
        best = protocol.scalarize(predicted, weights[:, None]).argmax(axis=1)
        return np.eye(25)[where_valid(agent.plans[best], masks)]

    return action_probabilities


def closest_to_the_best(returns, weights, number):
    """Which plans to play on, `number` of them in ascending order: by how near each comes to the best of any weight.

    returns (n, plans, m) on n sites, weights (k, m). The shortfall at a weight is in deviations that returns have
    between the plans, so that each weight counts alike; what counts of a plan is its smallest. Of more best plans than
    `number`, those that are best for most weights are kept.
    """
    scalarised = protocol.scalarize(returns.mean(dim=0), weights[:, None])
    shortfall = scalarised.max(dim=1, keepdim=True).values - scalarised
    shortfall /= scalarised.std(dim=1, keepdim=True) + 1e-9
    weights_won = (shortfall == 0).sum(dim=0)
    order = np.lexsort((-weights_won.numpy(), shortfall.min(dim=0).values.numpy()))
    return torch.from_numpy(order[:number]).sort().values


if __name__ == "__main__":
    task = protocol.make_task(args, hide_site=args.hide_site)
    if not task.boreal:
        protocol.fail(f"--env-id {args.env_id}: the plans are of the boreal environments alone")
    if task.mode == "generalist" and not task.site_entries and not args.hide_site:
        protocol.fail(f"--env-id {args.env_id}: it observes no site parameters by name; --hide-site is allowed")
    steps_a_round = args.num_envs * task.years
    num_rounds = args.total_timesteps // steps_a_round
    if not num_rounds:
        protocol.fail(f"--total-timesteps {args.total_timesteps}: at least {steps_a_round}, a round, is allowed")
    screening_rounds = max(1, round(args.screening * num_rounds))
    update_columns = ("round", "global_step", "sites", "plans", "explained_variance")

    with protocol.Run(args, task, __file__, episodes=task.episode_columns, updates=update_columns) as run:
        # TRY NOT TO MODIFY: seeding
        random.seed(args.seed)
        np.random.seed(args.seed)
        torch.manual_seed(args.seed)
        torch.set_num_threads(1)

        print(f"{num_rounds} rounds: {num_rounds * steps_a_round:,} of {args.total_timesteps:,} steps", end="; ")
        if screening_rounds < num_rounds:
            print(f"from round {screening_rounds + 1} on {args.finalists} of {len(PLANS)} plans", flush=True)
        else:
            print(f"all {len(PLANS)} plans in each, as none is left for --finalists", flush=True)

        # env setup
        envs = run.make_envs()
        start_seed = args.seed * protocol.MAX_ENVS
        lattice = torch.tensor([tuple(task.check_weights(w)) for w in fronts.evaluation_weights(task.num_objectives)])
        shape = {"inputs": list(task.site_entries), "num_objectives": task.num_objectives}

        # TRY NOT TO MODIFY: start the game
        plans, first_round, global_step, episode = np.array(PLANS), 1, 0, 0
        seen_sites = torch.zeros((0, len(task.site_entries)), dtype=torch.double)
        seen_returns = torch.zeros((0, len(plans), task.num_objectives), dtype=torch.double)
        # from equal seeds stands draw the same sites, weather and dice in every episode
        next_obs, _ = envs.reset(seed=[start_seed + i // len(PLANS) for i in range(args.num_envs)])

        # RESUME: all is as when the checkpoint was written
        if state := run.resume():
            plans, seen_sites, seen_returns = state["plans"], state["seen_sites"], state["seen_returns"]
            first_round, global_step, episode = state["round"] + 1, state["global_step"], state["episode"]
            next_obs = state["next_obs"]
            agent = Agent(envs, plans.tolist(), **shape)
            agent.fit(seen_sites, seen_returns, args.ridge)
        progress = run.progress(num_rounds * steps_a_round, global_step)

        for number in range(first_round, num_rounds + 1):
            rollout_start, env_seconds = time.perf_counter(), 0.0
            if number == screening_rounds + 1:
                kept = closest_to_the_best(seen_returns, lattice, args.finalists)
                plans, seen_returns = plans[kept], seen_returns[:, kept]
                first_seed = start_seed + args.num_envs  # other episodes than the screening's
                next_obs, _ = envs.reset(seed=[first_seed + i // len(plans) for i in range(args.num_envs)])
            of_stand = np.tile(plans, args.num_envs // len(plans))
            preferences = protocol.observed_weights(next_obs, task.num_objectives)
            sites = torch.from_numpy(next_obs[:: len(plans), shape["inputs"]]).double()
            returns = np.zeros((args.num_envs, task.num_objectives))

            # TRY NOT TO MODIFY: execute the game and log data.
            for _ in range(task.years):
                global_step += args.num_envs
                actions = where_valid(of_stand, task.action_masks(envs, next_obs))
                env_start = time.perf_counter()
                # SAME_STEP autoreset: after an end next_obs is already the next episode's first
                next_obs, rewards, _, _, infos = envs.step(actions)
                env_seconds += time.perf_counter() - env_start
                returns += rewards
                progress.show(global_step)
            for i in range(args.num_envs):
                episode += 1
                row = {"global_step": global_step, "episode": episode, "env": i}
                row |= task.returns_row(preferences[i], returns[i]) | protocol.final_info(infos, i)
                run.log("episodes", row)
                progress.returns.append(returns[i])
            run.time("environment", global_step, env_seconds)
            run.time("rollout", global_step, time.perf_counter() - rollout_start)
            update_start = time.perf_counter()

            # how well the plans' differences are predicted on sites that were not fitted
            returns = torch.from_numpy(returns).unflatten(0, (-1, len(plans)))
            row = {"round": number, "global_step": global_step, "plans": len(plans)}
            if number not in (1, screening_rounds + 1):
                apart = returns - returns.mean(dim=1, keepdim=True)
                scale = apart.std(dim=(0, 1)) + 1e-9
                left = ((apart - agent.predict(sites)) / scale).var() / (apart / scale).var()
                row["explained_variance"] = 1 - left.item()

            # ALGO LOGIC: all is fitted anew
            seen_sites = torch.cat([seen_sites, sites])
            seen_returns = torch.cat([seen_returns, returns])
            agent = Agent(envs, plans.tolist(), **shape)
            agent.fit(seen_sites, seen_returns, args.ridge)
            run.log("updates", row | {"sites": len(seen_sites)})
            run.time("update", global_step, time.perf_counter() - update_start)

            last = number == num_rounds
            run.validate(global_step, last, make_policy(agent))
            state = {
                "round": number,
                "episode": episode,
                "next_obs": next_obs,
                "plans": plans,
                "seen_sites": seen_sites,
                "seen_returns": seen_returns,
            }
            run.save(global_step, last, **state)

        envs.close()
        run.save_policy(agent, plans=plans.tolist(), **shape)

        evaluation_start = time.perf_counter()
        evaluation, years = protocol.evaluate(task, make_policy(agent), args.eval_weights, args.eval_episodes)
        run.time("evaluation", global_step, time.perf_counter() - evaluation_start)
        run.finish(evaluation, years)
