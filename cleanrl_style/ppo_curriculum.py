# Curriculum PPO: gated PPO trained on a part of the episodes, chosen by their site.
# Without the blocks marked CURRICULUM (a paragraph, or a class, each) this is ppo_gated.py. Skeleton: CleanRL's ppo.py.
import math
import random
import time
from dataclasses import dataclass
from typing import Literal

from cleanrl_style.flags import parse


@dataclass
class Args:
    """Gated PPO with a curriculum: trains on chosen episodes, evaluates, and leaves a run folder."""

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
    """steps, summed over all environments (None: 300000, in site-specific mode 100000)"""
    num_envs: int | None = None
    """number of environments (None: 8 async, 32 lockstep)"""
    vectorization: Literal["async", "lockstep"] = "async"
    """environments in worker processes, or all in one compiled call"""

    # Algorithm: the paper's hyperparameters; CleanRL's where the paper is silent
    learning_rate: float = 3e-4
    """learning rate of Adam"""
    rollout_steps: int = 2048
    """steps of a rollout, summed over all environments"""
    gamma: float = 0.99
    """discount factor"""
    gae_lambda: float = 0.95
    """lambda of generalised advantage estimation"""
    minibatch_size: int = 64
    """largest number of transitions in a minibatch"""
    update_epochs: int = 10
    """passes over the rollout in an update"""
    norm_adv: bool = True
    """normalise the advantages in each minibatch"""
    clip_coef: float = 0.2
    """clipping of the policy's probability ratio"""
    clip_vloss: bool = False
    """clip the value loss too (clip_coef is in units of return, of which a site has tens: learning slows)"""
    ent_coef: float = 0.01
    """weight of the entropy bonus"""
    vf_coef: float = 0.5
    """weight of the value loss"""
    max_grad_norm: float = 0.5
    """largest norm of the gradient"""
    scalarization: Literal["linear", "chebyshev"] = "linear"
    """what a return is worth: the weighted sum, or minus the largest weighted shortfall from an ideal point"""
    ideal_point: tuple[float, ...] | None = None
    """of chebyshev, a return for each objective (None: that of the constant plan which is best in it)"""
    reward_scales: tuple[float, ...] | None = None
    """factors of the rewards, before they are scalarised for training (None: 1 each)"""
    per_objective_advantages: bool = False
    """a value for each objective, whose advantages are normalised over the rollout before they are scalarised"""
    # CURRICULUM
    threshold: float = 0.5
    """first value of the threshold tau: an episode is trained on if its site's selector score is above"""
    raw_selector: bool = False
    """score by the random network's own logit, neither centred nor scaled over sampled sites"""
    selector: Literal["network", "coin"] = "network"
    """what scores an episode: a random network of its site, or, as a control, a uniform draw"""

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
    """A gate chooses planting (actions 15-24) or not (0-14); each has its own head."""

    def __init__(self, envs, num_values=1):
        super().__init__()
        observation_dim = np.array(envs.single_observation_space.shape).prod()
        self.critic = nn.Sequential(
            layer_init(nn.Linear(observation_dim, 64)),
            nn.Tanh(),
            layer_init(nn.Linear(64, 64)),
            nn.Tanh(),
            layer_init(nn.Linear(64, num_values), std=1.0),
        )
        self.actor = nn.Sequential(
            layer_init(nn.Linear(observation_dim, 64)),
            nn.Tanh(),
            layer_init(nn.Linear(64, 64)),
            nn.Tanh(),
            layer_init(nn.Linear(64, 2 + 15 + 10), std=0.01),  # gate, head of other actions, head of planting
        )

    def get_value(self, x):
        return self.critic(x)

    def get_logprobs(self, x, mask):
        """Logarithm of each action's probability (n, 25) for x (n, observation) and mask (n, 25) bool.

        At least one action is valid in each row. Written out, since torch's Categorical takes longer than its networks.
        """
        sides = torch.stack([mask[:, :15].any(dim=1), mask[:, 15:].any(dim=1)], dim=1)
        # -1e8 makes the probability exactly 0, and unlike -inf has no NaN in a side without a valid action
        logits = torch.where(torch.cat([sides, mask], dim=1), self.actor(x), -1e8)
        gate, other, plant = (part.log_softmax(dim=1) for part in logits.split([2, 15, 10], dim=1))
        return torch.cat([gate[:, :1] + other, gate[:, 1:] + plant], dim=1)

    def get_action_and_value(self, x, mask, action=None):
        logprobs = self.get_logprobs(x, mask)
        probs = logprobs.exp()
        if action is None:
            action = probs.multinomial(1).squeeze(1)
        logprob = logprobs.gather(1, action[:, None]).squeeze(1)
        return action, logprob, -(probs * logprobs).sum(dim=1), self.critic(x)


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


def weigh_advantages(advantages, weights, trained):
    """Advantages (n,) of m objectives' (n, m), each normalised over the positions `trained`."""
    mean = advantages[trained].mean(dim=0)
    # numpy's root: the last bit of torch's hangs on the processor
    std = torch.from_numpy(np.sqrt((advantages[trained] - mean).square().mean(dim=0).numpy()))
    return protocol.scalarize((advantages - mean) / (std + 1e-8), weights)


def ppo_losses(agent, x, mask, action, old_logprob, advantage, target, old_value, args):
    """Policy loss, value loss, entropy, two estimates of the KL divergence and clip fraction of a minibatch.

    x (n, observation), mask (n, 25), values and their targets (n, values), all else (n,).
    """
    _, logprob, entropy, value = agent.get_action_and_value(x, mask, action)
    value = value.view_as(target)
    logratio = logprob - old_logprob
    ratio = logratio.exp()

    # Policy loss
    if args.norm_adv and len(advantage) > 1:
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    pg_loss1 = -advantage * ratio
    pg_loss2 = -advantage * torch.clamp(ratio, 1 - args.clip_coef, 1 + args.clip_coef)
    pg_loss = torch.max(pg_loss1, pg_loss2).mean()

    # Value loss
    v_loss = (value - target) ** 2
    if args.clip_vloss:
        v_clipped = old_value + torch.clamp(value - old_value, -args.clip_coef, args.clip_coef)
        v_loss = torch.max(v_loss, (v_clipped - target) ** 2)
    v_loss = 0.5 * v_loss.mean()

    with torch.no_grad():
        # http://joschu.net/blog/kl-approx.html
        old_kl, kl = -logratio.mean(), (ratio - 1 - logratio).mean()
        clipfrac = ((ratio - 1).abs() > args.clip_coef).float().mean()
    return pg_loss, v_loss, entropy.mean(), old_kl, kl, clipfrac


# CURRICULUM
class Curriculum:
    """Chooses the episodes to train on: those that a fixed random network of the site, or a coin, scores above tau.

    On one site, and where no site parameters are observed (site-specific mode), the network accepts all episodes.
    """

    def __init__(self, task, args):
        self.coin = np.random.default_rng([args.seed, 1]) if args.selector == "coin" else None
        self.site_entries = list(task.site_entries)  # of the observation
        self.accepts_all = self.coin is None and not self.sees_sites(task)
        self.threshold = 0.0 if self.accepts_all else args.threshold
        # a generator of its own: the agent is the one that ppo_gated starts from
        generator = np.random.default_rng(args.seed)
        sizes = () if self.accepts_all or self.coin else (len(self.site_entries), 64, 64, 1)
        self.layers = [generator.normal(0, n**-0.5, (n, m)) for n, m in zip(sizes[:-1], sizes[1:], strict=True)]
        self.mean, self.std = 0.0, 1.0
        if not args.raw_selector and self.coin is None and not self.accepts_all:
            logits = self.logit(task.sample_sites(range(1000)))
            self.mean, self.std = logits.mean(), logits.std()
        # sum and number of the returns seen so far in each tenth of the preference (of each of its m - 1 weights)
        self.shape = (10,) * (task.num_objectives - 1)
        self.decile_sum, self.decile_count = np.zeros(self.shape).ravel(), np.zeros(self.shape).ravel()
        self.finished = []

    @staticmethod
    def sees_sites(task):
        """Whether episodes differ in a site that is observed."""
        return (task.draws_sites or not task.boreal) and len(task.site_entries) > 0

    def logit(self, sites):
        for layer in self.layers[:-1]:
            sites = np.tanh(sites @ layer)
        return (sites @ self.layers[-1])[:, 0]

    def score(self, observations):
        """Score in [0, 1] of each episode, by its site in the observations (n, observation)."""
        if self.coin is not None:
            return self.coin.random(len(observations))
        if self.accepts_all:
            return np.ones(len(observations))
        logits = self.logit(observations[:, self.site_entries].astype(np.float64))
        return 1 / (1 + np.exp(-(logits - self.mean) / self.std))

    def update_threshold(self):
        """Once a rollout: lower the threshold if its selected episodes did better than its skipped ones.

        Each return is taken less the running mean of its preference's decile (this rollout's included), since
        the preference sets the level of a return. Gives the numbers of selected and of skipped episodes.
        """
        *weights, returns, selected = np.array(self.finished).reshape(-1, len(self.shape) + 2).T
        selected = selected.astype(bool)
        deciles = np.ravel_multi_index(np.minimum(10 * np.array(weights), 9).astype(int), self.shape)
        np.add.at(self.decile_sum, deciles, returns)
        np.add.at(self.decile_count, deciles, 1)
        if selected.any() and not selected.all():
            excess = returns - self.decile_sum[deciles] / self.decile_count[deciles]
            better = excess[selected].mean() > excess[~selected].mean()
            self.threshold *= 0.999 if better else 1.001
        self.finished = []
        return selected.sum(), (~selected).sum()


if __name__ == "__main__":
    if args.scalarization != "linear" and args.per_objective_advantages:
        protocol.fail("--per-objective-advantages is for --scalarization linear: it weighs each advantage by itself")
    task = protocol.make_task(args, hide_site=args.hide_site)
    if task.fixes_preference:
        protocol.fail(f"--env-id {args.env_id}: it has a fixed_preference, and training is over all of them")
    episode_columns = task.episode_columns
    loss_columns = ("policy_loss", "value_loss", "entropy", "old_approx_kl", "approx_kl", "clip_fraction")
    update_columns = (
        "iteration",
        "global_step",
        *loss_columns,
        "explained_variance",
    )
    # CURRICULUM
    if args.selector == "coin" and args.raw_selector:
        protocol.fail("--raw-selector is for --selector network: a coin has no logit")
    if args.selector == "network" and args.hide_site:
        protocol.fail("--hide-site leaves --selector network nothing to score; --selector coin has no need of the site")
    if args.selector == "network" and not Curriculum.sees_sites(task):
        for flag, given in (("--raw-selector", args.raw_selector), ("--threshold", args.threshold != Args.threshold)):
            if given:
                protocol.fail(f"{flag}: {args.env_id} shows no sites to choose from; without it all are selected")
    episode_columns += ("score", "threshold", "selected")
    update_columns += ("threshold", "selected_episodes", "skipped_episodes", "selected_transitions")

    with protocol.Run(args, task, __file__, episodes=episode_columns, updates=update_columns) as run:
        # TRY NOT TO MODIFY: seeding
        random.seed(args.seed)
        np.random.seed(args.seed)
        torch.manual_seed(args.seed)
        torch.set_num_threads(1)

        # env setup
        envs = run.make_envs()

        num_values = task.num_objectives if args.per_objective_advantages else 1  # of the scalarised reward
        agent = Agent(envs, num_values)
        parameters = protocol.flat_parameters(agent)
        optimizer = optim.Adam([parameters], lr=args.learning_rate, eps=1e-5, fused=True)

        # TRY NOT TO MODIFY: start the game
        first_iteration, global_step, episode = 1, 0, 0
        start_seed = args.seed * protocol.MAX_ENVS
        next_obs, _ = envs.reset(seed=[start_seed + i for i in range(args.num_envs)])
        next_done = np.zeros(args.num_envs, dtype=bool)
        episode_returns = np.zeros((args.num_envs, task.num_objectives))
        # CURRICULUM: of the episode under way in each environment
        curriculum = Curriculum(task, args)
        scores, thresholds = curriculum.score(next_obs), np.full(args.num_envs, curriculum.threshold)
        selected = scores > thresholds

        # RESUME: all is as when the checkpoint was written
        if state := run.resume(agent=agent, optimizer=optimizer):
            first_iteration, global_step, episode = state["iteration"] + 1, state["global_step"], state["episode"]
            next_obs, next_done, episode_returns = state["next_obs"], state["next_done"], state["episode_returns"]
            # CURRICULUM
            vars(curriculum).update(state["curriculum"])
            scores, thresholds, selected = state["scores"], state["thresholds"], state["selected"]

        # every environment makes the same number of steps, so num_envs may leave a few of the total over
        steps_per_env = args.total_timesteps // args.num_envs
        rollout_length = args.rollout_steps // args.num_envs
        num_iterations = math.ceil(steps_per_env / rollout_length)
        progress = run.progress(steps_per_env * args.num_envs, global_step)

        for iteration in range(first_iteration, num_iterations + 1):
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
            # CURRICULUM
            selecteds = torch.zeros((num_steps, args.num_envs), dtype=torch.bool)

            for step in range(num_steps):
                global_step += args.num_envs
                obs[step] = torch.from_numpy(next_obs)
                masks[step] = torch.from_numpy(task.action_masks(envs, next_obs))
                dones[step] = torch.from_numpy(next_done)[:, None]
                # CURRICULUM
                selecteds[step] = torch.from_numpy(selected)

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
                episode_returns += reward
                scaled = reward * args.reward_scales
                if not args.per_objective_advantages:
                    # what the year adds to the utility of the returns; if that is linear, its rewards' weighted sum
                    before = (episode_returns - reward) * args.reward_scales
                    scaled = task.utility.gain(before, scaled, preferences)[:, None]
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
                    # CURRICULUM: note the episode that ended, choose whether to train on the one that begins
                    row |= {"score": scores[i], "threshold": thresholds[i], "selected": int(selected[i])}
                    curriculum.finished.append((*preferences[i, :-1], row["scalarized_return"], selected[i]))
                    scores[i], thresholds[i] = curriculum.score(next_obs[i : i + 1])[0], curriculum.threshold
                    selected[i] = scores[i] > thresholds[i]

                    run.log("episodes", row)
                    progress.returns.append(episode_returns[i].copy())
                    episode_returns[i] = 0
                progress.show(global_step)
            run.time("environment", global_step, env_seconds)
            run.time("rollout", global_step, time.perf_counter() - rollout_start)
            update_start = time.perf_counter()

            # advantages, and bootstrap values of the episodes that the rollout cuts
            with torch.no_grad():
                next_value = agent.get_value(torch.Tensor(next_obs))
            last_done = torch.from_numpy(next_done).float()[:, None]
            advantages = compute_gae(rewards, values, dones, next_value, last_done, args.gamma, args.gae_lambda)
            returns = advantages + values

            # flatten the batch
            b_obs = obs.flatten(0, 1)
            b_masks = masks.flatten(0, 1)
            b_logprobs = logprobs.flatten()
            b_actions = actions.flatten()
            b_advantages = advantages.flatten(0, 1)
            b_returns = returns.flatten(0, 1)
            b_values = values.flatten(0, 1)
            b_inds = np.arange(num_steps * args.num_envs)
            # CURRICULUM: skipped episodes are in no gradient; a rollout without selected ones has no update
            b_inds = b_inds[selecteds.flatten().numpy()]

            # Optimizing the policy and value network
            if args.per_objective_advantages:
                b_advantages = weigh_advantages(b_advantages, weights.flatten(0, 1), b_inds)
            b_advantages = b_advantages.flatten()
            num_minibatches = math.ceil(len(b_inds) / args.minibatch_size)
            batch = (b_obs, b_masks, b_actions, b_logprobs, b_advantages, b_returns, b_values)
            losses = []
            y_pred, y_true = b_values[b_inds], b_returns[b_inds]
            for epoch in range(args.update_epochs):
                np.random.shuffle(b_inds)
                shuffled = [part[b_inds] for part in batch]
                for minibatch in range(num_minibatches):
                    parts = ppo_losses(agent, *(part[minibatch::num_minibatches] for part in shuffled), args)
                    pg_loss, v_loss, entropy = parts[:3]
                    loss = pg_loss - args.ent_coef * entropy + args.vf_coef * v_loss

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
            # CURRICULUM: the threshold of the next rollout's episodes
            num_selected, num_skipped = curriculum.update_threshold()
            row |= {
                "threshold": curriculum.threshold,
                "selected_episodes": num_selected,
                "skipped_episodes": num_skipped,
                "selected_transitions": len(b_inds),
            }

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
            # CURRICULUM
            state |= {"curriculum": vars(curriculum), "scores": scores, "thresholds": thresholds, "selected": selected}

            run.save(global_step, last, **state)

        envs.close()
        run.save_policy(agent, num_values=num_values)

        evaluation_start = time.perf_counter()
        evaluation, years = protocol.evaluate(task, make_policy(agent), args.eval_weights, args.eval_episodes)
        run.time("evaluation", global_step, time.perf_counter() - evaluation_start)
        run.finish(evaluation, years)
