# Group PPO: gated PPO whose stands are judged against others on the same site, under the same weather and dice.
# `diff ppo_gated.py ppo_group.py` is the algorithm. Its skeleton is that of CleanRL's ppo.py.
import math
import random
import time
from dataclasses import dataclass
from typing import Literal

from cleanrl_style.flags import parse


@dataclass
class Args:
    """Group PPO on the boreal forest environments: trains, evaluates, and leaves a run folder."""

    seed: int = 1
    """seed of the run: agent, sampling and training episodes"""
    env_id: str | None = None
    """boreal-balanced-v0 or another that `python -m boreal_env` lists, or module:id of your own (None: the mode's)"""
    mode: Literal["generalist", "site-specific"] | None = None
    """a new site and weather in every episode of a group, or one fixed site (None: the environment's)"""
    site_seed: int | None = None
    """another fixed site in site-specific mode; in generalist mode one site, under new weather in every episode"""
    thaw_formulation: Literal["asymmetric", "contrast", "raw_degree_days"] | None = None
    """formula of the thaw reward (None: the environment's, asymmetric)"""
    hide_site: bool = False
    """observe no site parameters"""
    total_timesteps: int | None = None
    """steps, summed over all environments (None: 300000, in site-specific mode 100000)"""
    num_envs: int = 64
    """number of environments"""
    group_size: int = 8
    """neighbours that share site, start, weather and dice, but not the preference; divides num_envs (1: no groups)"""
    vectorization: Literal["async", "lockstep"] = "async"
    """environments in worker processes, or all in one compiled call"""

    # Algorithm: of ours, chosen in trials; CleanRL's where nothing was tried
    learning_rate: float = 1e-3
    """learning rate of Adam at the start; it falls linearly to 0"""
    rollout_steps: int = 3200
    """steps of a rollout, summed over all environments: one episode of 50 years of each of 64"""
    gamma: float = 1.0
    """discount factor"""
    gae_lambda: tuple[float, ...] | None = None
    """lambda of generalised advantage estimation, one or one for each objective (None: 0.95, and 1 for thaw)"""
    minibatch_size: int = 640
    """largest number of transitions in a minibatch"""
    update_epochs: int = 5
    """passes over the rollout in an update"""
    clip_coef: float = 0.2
    """clipping of the policy's probability ratio"""
    ent_coef: float = 0.1
    """weight of the entropy bonus at the start; it falls linearly to 0"""
    objective_logits: bool = True
    """each objective has logits of its own, which the preference weighs (no: one set for all)"""
    vf_coef: float = 0.5
    """weight of the value loss"""
    max_grad_norm: float = 0.5
    """largest norm of the gradient"""
    reward_scales: tuple[float, ...] | None = None
    """factors of the rewards, before they are scalarised for training (None: 1 each)"""

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


if __name__ == "__main__":
    args = parse(Args)  # a bad flag is answered before all that follows is loaded

import numpy as np
import torch
import torch.nn as nn
import torch.optim as optim

from cleanrl_style import protocol


def layer_init(layer, std=np.sqrt(2), bias_const=0.0):
    torch.nn.init.orthogonal_(layer.weight, std)
    torch.nn.init.constant_(layer.bias, bias_const)
    return layer


class Agent(nn.Module):
    """A gate chooses planting (actions 15-24) or not (0-14), each by logits of its own; so for each objective.

    The preference weighs the objectives' logits, as it does their advantages. num_logits : one for each, or 1 for all.
    """

    def __init__(self, envs, num_values=2, num_logits=2):
        super().__init__()
        observation_dim = np.array(envs.single_observation_space.shape).prod()
        self.critic = nn.Sequential(
            layer_init(nn.Linear(observation_dim, 64)),
            nn.Tanh(),
            layer_init(nn.Linear(64, 64)),
            nn.Tanh(),
            layer_init(nn.Linear(64, num_values), std=0.01),
        )
        self.actor = nn.Sequential(
            layer_init(nn.Linear(observation_dim, 64)),
            nn.Tanh(),
            layer_init(nn.Linear(64, 64)),
            nn.Tanh(),
            layer_init(nn.Linear(64, num_logits * (2 + 15 + 10)), std=0.01),
            nn.Unflatten(1, (num_logits, 2 + 15 + 10)),  # gate, head of other actions, head of planting
        )

        # of the first rollout's observations, and of returns: networks get and give numbers of mean 0 and deviation 1
        for name, size in (("observation", observation_dim), ("value", num_values)):
            self.register_buffer(f"{name}_mean", torch.zeros(size))
            self.register_buffer(f"{name}_std", torch.ones(size))

    def normalize(self, x):
        return ((x - self.observation_mean) / self.observation_std).clamp(-5, 5)

    def get_value(self, x):
        return self.critic(self.normalize(x)) * self.value_std + self.value_mean

    def get_logprobs(self, x, mask):
        """Logarithm of each action's probability (n, 25) for x (n, observation) and mask (n, 25) bool.

        At least one action is valid in each row. Written out, since torch's Categorical takes longer than its networks.
        """
        sides = torch.stack([mask[:, :15].any(dim=1), mask[:, 15:].any(dim=1)], dim=1)
        logits = self.actor(self.normalize(x))
        weights = x[:, : logits.shape[1] - 1]  # the last one's is what they leave
        weights = torch.cat([weights, 1.0 - weights.sum(dim=1, keepdim=True)], dim=1)
        logits = (weights[:, :, None] * logits).sum(dim=1)
        # -1e8 makes the probability exactly 0, and unlike -inf has no NaN in a side without a valid action
        logits = torch.where(torch.cat([sides, mask], dim=1), logits, -1e8)
        gate, other, plant = (part.log_softmax(dim=1) for part in logits.split([2, 15, 10], dim=1))
        return torch.cat([gate[:, :1] + other, gate[:, 1:] + plant], dim=1)

    def get_action_and_value(self, x, mask, action=None):
        logprobs = self.get_logprobs(x, mask)
        probs = logprobs.exp()
        if action is None:
            action = probs.multinomial(1).squeeze(1)
        logprob = logprobs.gather(1, action[:, None]).squeeze(1)
        return action, logprob, -(probs * logprobs).sum(dim=1), self.get_value(x)


def make_policy(agent):
    """Action probabilities (n, 25) of observations (n, d) and masks (n, 25); accrued returns (n, m) are not needed."""

    def action_probabilities(observations, masks, accrued_returns):
        with torch.no_grad():
            return agent.get_logprobs(torch.from_numpy(observations), torch.from_numpy(masks)).exp().numpy()

    return action_probabilities


def compute_gae(rewards, values, dones, next_value, next_done, gamma, gae_lambda):
    """Advantages (steps, envs, values), each value's for itself, of rewards and values (steps, envs, values).

    dones (steps, envs, 1) say that a step follows an episode's end; next_value (envs, values) and next_done (envs, 1)
    are of what comes after the last step. The end of an episode is terminal: nothing is worth anything beyond it, so
    nothing is bootstrapped.
    """
    advantages = torch.zeros_like(rewards)
    lastgaelam = 0
    for t in reversed(range(len(rewards))):
        last = t == len(rewards) - 1
        nextnonterminal = 1.0 - (next_done if last else dones[t + 1])
        nextvalues = next_value if last else values[t + 1]
        delta = rewards[t] + gamma * nextvalues * nextnonterminal - values[t]
        advantages[t] = lastgaelam = delta + gamma * gae_lambda * nextnonterminal * lastgaelam
    return advantages


def less_the_others(rewards, group_size):
    """Rewards (steps, envs, m), each less the mean of what the others of its group get in the same year.

    No action of a stand changes what the others get, so no expected gradient changes. What site and weather add to
    all of a group is gone, and with it most of the noise.
    """
    if group_size == 1:
        return rewards
    groups = rewards.unflatten(1, (-1, group_size))
    others = (groups.sum(dim=2, keepdim=True) - groups) / (group_size - 1)
    return (groups - others).flatten(1, 2)


def weigh_advantages(advantages, weights):
    """Advantages (n,) of m objectives' (n, m), weighed, and divided by the deviation that they have at those weights.

    A factor that hangs on the preference alone leaves each preference's best policy as it is. Without it those whose
    objectives vary most would be all that is learnt.
    """
    variance = ((weights @ advantages.T.cov()) * weights).sum(dim=1).clamp(min=0).numpy()
    # numpy's root: the last bit of torch's hangs on the processor
    return protocol.scalarize(advantages, weights) / (torch.from_numpy(np.sqrt(variance)) + 1e-8)


def spread_preferences(num_groups, group_size, num_objectives):
    """Observed weights (num_groups * group_size, m - 1) of preferences that in every group are spread over all.

    Each preference is uniform. Of two objectives each eighth of [0, 1] has one of a group of eight, in random order; of
    m objectives the weights have such shares, one after the other, of what those before them leave.
    """
    shape = (num_groups, group_size, num_objectives - 1)
    shares = (np.random.random(shape).argsort(axis=1) + np.random.random(shape)) / group_size
    weights, rest = np.zeros(shape), 1.0
    for k in range(num_objectives - 1):
        weights[..., k] = rest * (1.0 - (1.0 - shares[..., k]) ** (1.0 / (num_objectives - 1 - k)))
        rest = rest - weights[..., k]
    return weights.reshape(-1, num_objectives - 1)


def ppo_losses(agent, x, mask, action, old_logprob, advantage, target, args):
    """Policy loss, value loss, entropy, two estimates of the KL divergence and clip fraction of a minibatch.

    x (n, observation), mask (n, 25), values and their targets (n, values), all else (n,).
    """
    _, logprob, entropy, value = agent.get_action_and_value(x, mask, action)
    logratio = logprob - old_logprob
    ratio = logratio.exp()

    # Policy loss
    pg_loss1 = -advantage * ratio
    pg_loss2 = -advantage * torch.clamp(ratio, 1 - args.clip_coef, 1 + args.clip_coef)
    pg_loss = torch.max(pg_loss1, pg_loss2).mean()

    # Value loss
    v_loss = 0.5 * (((value - target) / agent.value_std) ** 2).mean()

    with torch.no_grad():
        # http://joschu.net/blog/kl-approx.html
        old_kl, kl = -logratio.mean(), (ratio - 1 - logratio).mean()
        clipfrac = ((ratio - 1).abs() > args.clip_coef).float().mean()
    return pg_loss, v_loss, entropy.mean(), old_kl, kl, clipfrac


if __name__ == "__main__":
    task = protocol.make_task(args, hide_site=args.hide_site)
    if task.fixes_preference:
        protocol.fail(f"--env-id {args.env_id}: it has a fixed_preference, and training is over all of them")
    if args.num_envs == 1 and 1 in (args.rollout_steps, args.total_timesteps % args.rollout_steps):
        protocol.fail(f"--num-envs 1, --rollout-steps {args.rollout_steps}: a rollout of 1 step, 2 are the least")
    episode_columns = task.episode_columns
    gae_lambda = args.gae_lambda or [1.0 if name == "thaw" else 0.95 for name in task.objectives]
    if len(gae_lambda) not in (1, task.num_objectives):
        protocol.fail(f"--gae-lambda: 1 number or {task.num_objectives} are allowed, not {list(gae_lambda)}")
    loss_columns = ("policy_loss", "value_loss", "entropy", "old_approx_kl", "approx_kl", "clip_fraction")
    update_columns = (
        "iteration",
        "global_step",
        *loss_columns,
        "explained_variance",
    )

    with protocol.Run(args, task, __file__, episodes=episode_columns, updates=update_columns) as run:
        # TRY NOT TO MODIFY: seeding
        random.seed(args.seed)
        np.random.seed(args.seed)
        torch.manual_seed(args.seed)
        torch.set_num_threads(1)

        # env setup
        envs = run.make_envs()

        num_values = task.num_objectives
        num_logits = num_values if args.objective_logits else 1
        agent = Agent(envs, num_values, num_logits)
        parameters = protocol.flat_parameters(agent)
        optimizer = optim.Adam([parameters], lr=args.learning_rate, eps=1e-5, fused=True)

        # TRY NOT TO MODIFY: start the game
        first_iteration, global_step, episode = 1, 0, 0
        start_seed = args.seed * protocol.MAX_ENVS
        # from equal seeds stands of a group draw the same, a preference too: it is replaced by another for each
        next_obs, _ = envs.reset(seed=[start_seed + i // args.group_size for i in range(args.num_envs)])
        num_groups = args.num_envs // args.group_size
        next_obs[:, : num_values - 1] = spread_preferences(num_groups, args.group_size, num_values)
        next_done = np.zeros(args.num_envs, dtype=bool)
        episode_returns = np.zeros((args.num_envs, task.num_objectives))

        # RESUME: all is as when the checkpoint was written
        if state := run.resume(agent=agent, optimizer=optimizer):
            first_iteration, global_step, episode = state["iteration"] + 1, state["global_step"], state["episode"]
            next_obs, next_done, episode_returns = state["next_obs"], state["next_done"], state["episode_returns"]

        # every environment makes the same number of steps, so num_envs may leave a few of the total over
        steps_per_env = args.total_timesteps // args.num_envs
        rollout_length = args.rollout_steps // args.num_envs
        num_iterations = math.ceil(steps_per_env / rollout_length)
        progress = run.progress(steps_per_env * args.num_envs, global_step)

        for iteration in range(first_iteration, num_iterations + 1):
            remaining = 1.0 - (iteration - 1.0) / num_iterations
            optimizer.param_groups[0]["lr"], ent_coef = args.learning_rate * remaining, args.ent_coef * remaining
            # ALGO Logic: Storage setup (the last rollout may be shorter)
            num_steps = min(rollout_length, steps_per_env - global_step // args.num_envs)
            obs = torch.zeros((num_steps, args.num_envs) + envs.single_observation_space.shape)
            masks = torch.zeros((num_steps, args.num_envs, 25), dtype=torch.bool)
            actions = torch.zeros((num_steps, args.num_envs), dtype=torch.long)
            logprobs = torch.zeros((num_steps, args.num_envs))
            rewards = torch.zeros((num_steps, args.num_envs, num_values))
            weights = torch.zeros((num_steps, args.num_envs, task.num_objectives))
            dones = torch.zeros((num_steps, args.num_envs, 1))
            values = torch.zeros((num_steps, args.num_envs, num_values))
            rollout_start, env_seconds = time.perf_counter(), 0.0

            for step in range(num_steps):
                global_step += args.num_envs
                obs[step] = torch.from_numpy(next_obs)
                masks[step] = torch.from_numpy(task.action_masks(envs, next_obs))
                dones[step] = torch.from_numpy(next_done)[:, None]

                # ALGO LOGIC: action logic
                with torch.no_grad():
                    action, logprob, _, value = agent.get_action_and_value(obs[step], masks[step])
                    values[step] = value
                actions[step] = action
                logprobs[step] = logprob

                # TRY NOT TO MODIFY: execute the game and log data.
                preferences = protocol.observed_weights(next_obs, task.num_objectives)
                env_start = time.perf_counter()
                # SAME_STEP autoreset: after an end next_obs is already the next episode's first
                next_obs, reward, terminations, truncations, infos = envs.step(action.numpy())
                env_seconds += time.perf_counter() - env_start
                next_done = terminations | truncations
                ended = next_done.reshape(num_groups, args.group_size)
                if (ended != ended[:, :1]).any():
                    protocol.fail("--group-size: the episodes of a group must be of one length; 1 is allowed")
                # ALGO LOGIC: a preference is kept to the end of its episode, then each group draws others
                next_obs[:, : num_values - 1] = preferences[:, :-1]
                drawn = spread_preferences(ended[:, 0].sum(), args.group_size, num_values)
                next_obs[next_done, : num_values - 1] = drawn
                episode_returns += reward
                scaled = reward * args.reward_scales
                rewards[step] = torch.from_numpy(scaled)
                weights[step] = torch.from_numpy(preferences)

                for i in np.flatnonzero(next_done):
                    episode += 1
                    row = {
                        "global_step": global_step,
                        "episode": episode,
                        "env": i,
                        **task.returns_row(preferences[i], episode_returns[i]),
                        **protocol.final_info(infos, i),
                    }

                    run.log("episodes", row)
                    progress.returns.append(episode_returns[i].copy())
                    episode_returns[i] = 0
                progress.show(global_step)
            run.time("environment", global_step, env_seconds)
            run.time("rollout", global_step, time.perf_counter() - rollout_start)
            update_start = time.perf_counter()

            # from here on observations are scaled by the first rollout's mean and deviation
            if iteration == 1:
                agent.observation_mean.copy_(obs.mean(dim=(0, 1)))
                agent.observation_std.copy_(obs.std(dim=(0, 1)).clamp(min=1e-3))
                with torch.no_grad():
                    _, logprob, _, value = agent.get_action_and_value(*(p.flatten(0, 1) for p in (obs, masks, actions)))
                logprobs, values = logprob.view_as(logprobs), value.view_as(values)

            # advantages, and bootstrap values of the episodes that the rollout cuts
            with torch.no_grad():
                next_value = agent.get_value(torch.Tensor(next_obs))
            last_done = torch.from_numpy(next_done).float()[:, None]
            excess = less_the_others(rewards, args.group_size)
            lambdas = torch.tensor(gae_lambda)
            advantages = compute_gae(excess, values, dones, next_value, last_done, args.gamma, lambdas)
            returns = advantages + values
            share = 1.0 if iteration == 1 else 0.1
            agent.value_mean.lerp_(returns.mean(dim=(0, 1)), share)
            agent.value_std.lerp_(returns.std(dim=(0, 1)) + 1e-6, share)

            # flatten the batch
            b_obs = obs.flatten(0, 1)
            b_masks = masks.flatten(0, 1)
            b_logprobs = logprobs.flatten()
            b_actions = actions.flatten()
            b_advantages = weigh_advantages(advantages.flatten(0, 1), weights.flatten(0, 1))
            b_returns = returns.flatten(0, 1)
            b_values = values.flatten(0, 1)
            b_inds = np.arange(num_steps * args.num_envs)

            # Optimizing the policy and value network
            num_minibatches = math.ceil(len(b_inds) / args.minibatch_size)
            batch = (b_obs, b_masks, b_actions, b_logprobs, b_advantages, b_returns)
            losses = []
            y_pred, y_true = b_values, b_returns
            for epoch in range(args.update_epochs):
                np.random.shuffle(b_inds)
                shuffled = [part[b_inds] for part in batch]
                for minibatch in range(num_minibatches):
                    parts = ppo_losses(agent, *(part[minibatch::num_minibatches] for part in shuffled), args)
                    pg_loss, v_loss, entropy = parts[:3]
                    loss = pg_loss - ent_coef * entropy + args.vf_coef * v_loss

                    optimizer.zero_grad(set_to_none=False)  # None would cut the network off from `parameters`
                    loss.backward()
                    nn.utils.clip_grad_norm_(parameters, args.max_grad_norm)
                    optimizer.step()
                    losses.append(torch.stack(parts).detach().numpy())

            # TRY NOT TO MODIFY: record the update; means over its minibatches
            row = {"iteration": iteration, "global_step": global_step}
            if losses:
                row |= dict(zip(loss_columns, np.mean(losses, axis=0), strict=True))
            if len(y_true) > 1:
                row["explained_variance"] = (1 - (y_true - y_pred).var(dim=0).sum() / y_true.var(dim=0).sum()).item()

            run.log("updates", row)
            run.time("update", global_step, time.perf_counter() - update_start)

            last = iteration == num_iterations
            run.validate(global_step, last, make_policy(agent))
            state = {
                "agent": agent.state_dict(),
                "optimizer": optimizer.state_dict(),
                "iteration": iteration,
                "episode": episode,
                "next_obs": next_obs,
                "next_done": next_done,
                "episode_returns": episode_returns,
            }

            run.save(global_step, last, **state)

        envs.close()
        run.save_policy(agent, num_values=num_values, num_logits=num_logits)

        evaluation_start = time.perf_counter()
        evaluation, years = protocol.evaluate(task, make_policy(agent), args.eval_weights, args.eval_episodes)
        run.time("evaluation", global_step, time.perf_counter() - evaluation_start)
        run.finish(evaluation, years)
