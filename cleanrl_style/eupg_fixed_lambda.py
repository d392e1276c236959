# EUPG with fixed lambda: a policy gradient weighted by the utility of the rewards to come, whose policy sees the
# return accrued so far; one preference throughout. eupg_var_lambda.py draws one for each episode.
# After Roijers, Steckelmacher and Nowe (2018). Its skeleton is that of CleanRL's scripts.
import math
import random
import time
from dataclasses import dataclass
from typing import Literal

from cleanrl_style.flags import parse


@dataclass
class Args:
    """EUPG with one preference: trains, evaluates at this preference, and leaves a run folder."""

    seed: int = 1
    """seed of the run: agent, sampling and training episodes"""
    env_id: str | None = None
    """boreal-balanced-v0 or another that `python -m boreal_env` lists, or module:id of your own (None: the mode's)"""
    mode: Literal["generalist", "site-specific"] | None = None
    """a new site and weather in every episode, or one fixed site (None: the environment's)"""
    site_seed: int | None = None
    """another fixed site in site-specific mode; in generalist mode one site, under new weather in every episode"""
    thaw_formulation: Literal["asymmetric", "contrast", "raw_degree_days"] | None = None
    """formula of the thaw reward (None: the environment's, asymmetric)"""
    hide_site: bool = False
    """observe no site parameters"""
    total_timesteps: int | None = None
    """steps, summed over all environments; episodes are played whole (None: 300000, in site-specific mode 100000)"""
    num_envs: int = 1
    """number of environments, and of episodes in an update"""
    vectorization: Literal["async", "lockstep"] = "async"
    """environments in worker processes, or all in one compiled call"""
    preference: float | tuple[float, ...] = 0.5
    """carbon weight of every episode, in training and evaluation; of three and more objectives, a weight of each"""

    # Algorithm: the paper's hyperparameters
    learning_rate: float = 1e-3
    """learning rate of Adam"""
    gamma: float = 1.0
    """discount factor"""
    scalarization: Literal["linear", "chebyshev"] = "linear"
    """what a return is worth: the weighted sum, or minus the largest weighted shortfall from an ideal point"""
    ideal_point: tuple[float, ...] | None = None
    """of chebyshev, a return for each objective (None: that of the constant plan which is best in it)"""
    utility: Literal["total", "future"] = "future"
    """what weights an action's gradient: utility (--scalarization) of the whole return, or of what is to come"""
    baseline: Literal["none", "others"] = "none"
    """what is subtracted from a return: nothing, by the definition, or the mean of the batch's other episodes"""
    ent_coef: float = 0.0
    """coefficient of the entropy bonus, in units of return; 0 by the definition"""
    masks: bool = True
    """choose among valid actions (no: among all; what can be done of one is done, at the environment's penalties)"""

    # Evaluation and output
    eval_episodes: int = 200
    """evaluation episodes, each on another site (of one site: in another weather)"""
    run_dir: str | None = None
    """folder of the run (None: runs/<script>/<env-id>[-<what is not default>]/seed<seed>)"""
    overwrite: bool = False
    """start over in a folder that already holds a run"""
    track: tuple[Literal["tensorboard", "wandb"], ...] = ()
    """follow the run's tables in TensorBoard (files in the run's folder) or Weights & Biases"""
    wandb_project_name: str = "borearl"
    """project of Weights & Biases"""


if __name__ == "__main__":
    args = parse(Args)  # a bad flag is answered before all that follows is loaded

import numpy as np
import torch
import torch.nn as nn
import torch.optim as optim
from torch.distributions.categorical import Categorical

from cleanrl_style import protocol


def layer_init(layer, std=np.sqrt(2), bias_const=0.0):
    torch.nn.init.orthogonal_(layer.weight, std)
    torch.nn.init.constant_(layer.bias, bias_const)
    return layer


class Agent(nn.Module):
    """A policy of the observation and, at its end, of the returns accrued so far."""

    def __init__(self, envs, num_objectives=2, masked=True):
        super().__init__()
        self.masked = masked
        observation_dim = np.array(envs.single_observation_space.shape).prod()
        self.actor = nn.Sequential(
            layer_init(nn.Linear(observation_dim + num_objectives, 128)),
            nn.Tanh(),
            layer_init(nn.Linear(128, 64)),
            nn.Tanh(),
            layer_init(nn.Linear(64, 25), std=0.01),
        )

    def get_distribution(self, x, mask):
        """x (n, observation + m), mask (n, 25) bool, at least one action valid in each row."""
        logits = self.actor(x)
        if self.masked:
            # -1e8 makes the probability exactly 0, and unlike -inf has no NaN in the entropy
            logits = torch.where(mask, logits, -1e8)
        return Categorical(logits=logits, validate_args=False)

    def get_action(self, x, mask, action=None):
        distribution = self.get_distribution(x, mask)
        if action is None:
            action = distribution.sample()
        return action, distribution.log_prob(action), distribution.entropy()


def policy_input(observations, accrued_returns):
    """x of the agent (n, observation + m), for observations (n, observation) and undiscounted returns (n, m)."""
    return torch.from_numpy(np.hstack([observations, accrued_returns / 50]).astype(np.float32))


def make_policy(agent):
    """Action probabilities (n, 25) of observations (n, d), masks (n, 25) and accrued returns (n, m)."""

    def action_probabilities(observations, masks, accrued_returns):
        with torch.no_grad():
            x = policy_input(observations, accrued_returns)
            distribution = agent.get_distribution(x, torch.from_numpy(masks))
        return distribution.probs.numpy()

    return action_probabilities


def compute_utilities(rewards, preferences, gamma, which, baseline="none", utility=protocol.scalarize):
    """Utility (steps, n) that weights each step's gradient, of n episodes with rewards (steps, n, m).

    The utility of a return is its scalarisation by the episode's preference (n, m). "total" is that of the whole
    return, accrued before the step and future, the same for all steps; "future" that of what comes from the step on.
    "others" takes it less what the other episodes' returns would be worth, at its own preference, in the mean. This
    changes no expected gradient: it knows nothing of the action.
    """
    to_go = np.zeros_like(rewards)
    future = np.zeros(rewards.shape[1:])
    for t in reversed(range(len(rewards))):
        to_go[t] = future = rewards[t] + gamma * future
    returns = to_go if which == "future" else np.broadcast_to(to_go[0], to_go.shape)
    utilities = utility(returns, preferences)
    if baseline == "others":
        others = [utility(np.delete(returns, i, axis=1), own).mean(axis=1) for i, own in enumerate(preferences)]
        utilities = utilities - np.stack(others, axis=1)
    return utilities


def eupg_loss(agent, x, mask, action, utility):
    """Loss whose gradient is EUPG's, and the policy's mean entropy, for the utility (n,) that weights each action (n,).

    x (n, observation + m) and mask (n, 25) are what the actions were drawn under.
    """
    _, logprob, entropy = agent.get_action(x, mask, action)
    return -(logprob * utility).mean(), entropy.mean()


if __name__ == "__main__":
    if args.scalarization != "linear" and args.utility == "future":
        protocol.fail(f"--utility future is for --scalarization linear; for {args.scalarization} total is allowed")
    if args.baseline == "others" and args.num_envs == 1:
        protocol.fail("--baseline others is the mean of a batch's other episodes: --num-envs 2 or more is allowed")
    task = protocol.make_task(args, preference=args.preference, hide_site=args.hide_site)
    episode_columns = task.episode_columns
    update_columns = (
        "iteration",
        "global_step",
        "policy_loss",
        "entropy",
        "gradient_norm",
        "utility_mean",
        "utility_std",
    )
    if task.years and args.total_timesteps < task.years * args.num_envs:
        protocol.fail(
            f"--total-timesteps {args.total_timesteps} has no room for a batch, an episode of each "
            f"environment: {task.years * args.num_envs} steps"
        )

    with protocol.Run(args, task, __file__, episodes=episode_columns, updates=update_columns) as run:
        # TRY NOT TO MODIFY: seeding
        random.seed(args.seed)
        np.random.seed(args.seed)
        torch.manual_seed(args.seed)
        torch.set_num_threads(1)

        # env setup
        envs = run.make_envs()

        agent = Agent(envs, task.num_objectives, args.masks)
        optimizer = optim.Adam(agent.parameters(), lr=args.learning_rate, fused=True)

        preferences = np.tile(task.preference, (args.num_envs, 1))

        # TRY NOT TO MODIFY: start the game
        iteration, global_step, episode, batch_steps = 0, 0, 0, 0
        start_seed = args.seed * protocol.MAX_ENVS
        next_obs, _ = envs.reset(seed=[start_seed + i for i in range(args.num_envs)])

        # RESUME: all is as when the checkpoint was written
        if state := run.resume(agent=agent, optimizer=optimizer):
            iteration, global_step, episode = state["iteration"], state["global_step"], state["episode"]
            next_obs, batch_steps = state["next_obs"], state["batch_steps"]

        progress = run.progress(args.total_timesteps, global_step)

        # a batch is an episode of every environment; the last one is the last that the total has room for
        while global_step + batch_steps <= args.total_timesteps:
            iteration += 1
            obs, masks, actions, rewards = [], [], [], []
            next_done = np.zeros(args.num_envs, dtype=bool)
            episode_returns = np.zeros((args.num_envs, task.num_objectives))
            rollout_start, env_seconds = time.perf_counter(), 0.0

            while not next_done.any():
                global_step += args.num_envs
                obs.append(policy_input(next_obs, episode_returns))
                masks.append(torch.from_numpy(task.action_masks(envs, next_obs)))

                # ALGO LOGIC: action logic
                with torch.no_grad():
                    action, _, _ = agent.get_action(obs[-1], masks[-1])
                actions.append(action)

                # TRY NOT TO MODIFY: execute the game and log data.
                env_start = time.perf_counter()
                next_obs, reward, terminations, truncations, infos = envs.step(action.numpy())
                env_seconds += time.perf_counter() - env_start
                next_done = terminations | truncations
                rewards.append(reward.astype(np.float64))
                episode_returns += reward

            if not next_done.all() or batch_steps not in (0, len(rewards) * args.num_envs):
                protocol.fail(
                    f"--env-id {args.env_id}: EUPG needs episodes of one length, and one ended at step {len(rewards)}, "
                    f"others did not"
                )
            if global_step > args.total_timesteps:
                protocol.fail(
                    f"--total-timesteps {args.total_timesteps} has no room for a batch, an episode of each "
                    f"environment: {global_step} steps"
                )
            for i in range(args.num_envs):
                episode += 1
                row = {
                    "global_step": global_step,
                    "episode": episode,
                    "env": i,
                    **task.returns_row(preferences[i], episode_returns[i]),
                    **protocol.final_info(infos, i),
                }
                run.log("episodes", row)
                progress.returns.append(episode_returns[i])
            run.time("environment", global_step, env_seconds)
            run.time("rollout", global_step, time.perf_counter() - rollout_start)
            update_start = time.perf_counter()

            # Optimizing the policy: one step of gradient ascent
            utilities = compute_utilities(
                np.stack(rewards), preferences, args.gamma, args.utility, args.baseline, task.utility
            )
            loss, entropy = eupg_loss(
                agent,
                torch.cat(obs),
                torch.cat(masks),
                torch.cat(actions),
                torch.from_numpy(utilities.ravel().astype(np.float32)),
            )
            optimizer.zero_grad()
            (loss - args.ent_coef * entropy).backward()
            gradient_norm = nn.utils.clip_grad_norm_(agent.parameters(), math.inf)  # measures, clips nothing
            optimizer.step()

            # TRY NOT TO MODIFY: record the update
            run.log(
                "updates",
                {
                    "iteration": iteration,
                    "global_step": global_step,
                    "policy_loss": loss.item(),
                    "entropy": entropy.item(),
                    "gradient_norm": gradient_norm.item(),
                    "utility_mean": utilities.mean(),
                    "utility_std": utilities.std(),
                },
            )
            run.time("update", global_step, time.perf_counter() - update_start)

            batch_steps = len(rewards) * args.num_envs
            last = global_step + batch_steps > args.total_timesteps
            progress.show(global_step, last)
            run.validate(global_step, last, make_policy(agent))
            state = {
                "agent": agent.state_dict(),
                "optimizer": optimizer.state_dict(),
                "iteration": iteration,
                "episode": episode,
                "next_obs": next_obs,
                "batch_steps": batch_steps,
            }
            run.save(global_step, last, **state)

        envs.close()
        run.save_policy(agent, num_objectives=task.num_objectives, masked=args.masks)

        evaluation_start = time.perf_counter()
        evaluation, years = protocol.evaluate(task, make_policy(agent), args.eval_weights, args.eval_episodes)
        run.time("evaluation", global_step, time.perf_counter() - evaluation_start)
        run.finish(evaluation, years)
