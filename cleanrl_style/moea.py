# NSGA-II and MOEA/D, by pymoo, over the weights of a small policy or over plans: a population and no gradient.
# What a candidate is: `Agent`, `first_candidates`. How it is judged: the loop at the end. The rest is pymoo's.
import random
import time
from dataclasses import dataclass
from typing import Literal

from cleanrl_style.flags import MAX_ENVS, parse, require


@dataclass
class Args:
    """NSGA-II or MOEA/D on the boreal forest environments: searches, evaluates, and leaves a run folder."""

    seed: int = 1
    """seed of the run: candidates and the episodes that they are judged by"""
    env_id: str | None = None
    """boreal-balanced-v0 or another that `python -m boreal_env` lists, or a BorealEnv's module:id (None: the mode's)"""
    mode: Literal["generalist", "site-specific"] | None = None
    """sites and weathers that are drawn, or one fixed site (None: the environment's)"""
    site_seed: int | None = None
    """another fixed site in site-specific mode; in generalist mode one site, under several weathers"""
    thaw_formulation: Literal["asymmetric", "contrast", "raw_degree_days"] | None = None
    """formula of the thaw reward (None: the environment's, asymmetric)"""
    hide_site: bool = False
    """observe no site parameters"""
    total_timesteps: int | None = None
    """steps, summed over all environments (None: 300000, in site-specific mode 100000)"""
    vectorization: Literal["async", "lockstep"] = "async"
    """environments in worker processes, or all in one compiled call"""

    # Algorithm
    algorithm: Literal["nsga2", "moead"] = "nsga2"
    """NSGA-II (Deb et al. 2002), or MOEA/D (Zhang and Li 2007) with a weight vector a candidate"""
    genome: Literal["policy", "plan"] = "policy"
    """what a candidate is: weights of a policy that looks at the stand, or an action for each block of years"""
    block_years: int = 10
    """years of a plan's block"""
    population: int = 30
    """candidates of a generation"""
    episodes_each: int | None = None
    """sites and weathers that every candidate is judged on, the same for all (None: 8, in site-specific mode 1)"""

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

    num_envs = 1  # no flag: population x episodes_each
    trial = 12000, "ten minutes"  # a generation; what `--help` says
    left = """A stopped search goes on with the same
command, to the same bytes. The folder gets config.json, episodes.csv, updates.csv, evaluation.csv, policy.pt and
summary.png, which docs/planners.md explains"""
    limits = {"block_years": (1, 10**6), "population": (4, MAX_ENVS), "episodes_each": (1, MAX_ENVS)}


if __name__ == "__main__":
    args = parse(Args)  # a bad flag is answered before all that follows is loaded
    require("pymoo", extra="planners")

import numpy as np
import torch
import torch.nn as nn

from boreal_env import where_valid
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts

LEVELS = np.linspace(-1, 1, 5)  # genes of the five density changes, and of the five conifer shares
# What a policy looks at: where the stand is, and of its site what decides gains.
INPUTS = (
    "year",
    "density",
    "conifer_fraction",
    "biomass",
    "soil",
    "site_latitude_deg",
    "site_mean_annual_temperature_c",
    "site_deep_boundary_temperature_k",
    "site_winter_snow_mm_day",
    "site_wind_speed_m_s",
)


# --------------------------------------------------------------------------------------------------- a candidate


class Agent(nn.Module):
    """Candidates: those of a generation, or of a finished run those that no other dominates, with their mean gains.

    A candidate's genes weigh features of the observation; two sums, for density change and conifer share, name the
    nearest of the five levels. A policy's features are 1 and its inputs, a plan's say which block of years it is.
    """

    def __init__(self, envs, inputs, num_blocks, block_years, num_candidates, num_objectives):
        super().__init__()
        self.inputs, self.num_blocks, self.block_years = list(inputs), num_blocks, block_years
        self.num_features = num_blocks or 1 + len(inputs)
        self.register_buffer("genes", torch.zeros(num_candidates, 2 * self.num_features, dtype=torch.double))
        self.register_buffer("gains", torch.zeros(num_candidates, num_objectives, dtype=torch.double))

    def features(self, observations):
        seen = observations[:, self.inputs].astype(float)
        if not self.num_blocks:
            return np.column_stack([np.ones(len(seen)), 2 * seen - 1])
        years = np.rint(50 * seen[:, 0]).astype(int)
        return np.eye(self.num_blocks)[np.minimum(years // self.block_years, self.num_blocks - 1)]

    def get_action(self, observations, masks, candidates):
        """Actions (n,) of the candidates (n,) with these numbers; no change where theirs cannot be carried out."""
        genes = self.genes.numpy()[candidates].reshape(len(candidates), -1, 2)
        wanted = np.einsum("nf,nfk->nk", self.features(observations), genes)
        density, mix = np.clip(np.rint(2 + 2 * wanted), 0, 4).astype(int).T
        return where_valid(5 * density + mix, masks)


def make_policy(agent):
    """Action probabilities (n, 25) of observations (n, d): of the candidate with most gain at the weights observed."""

    def action_probabilities(observations, masks, accrued_returns):
        gains = agent.gains.numpy()
        best = (protocol.observed_weights(observations, gains.shape[1]) @ gains.T).argmax(axis=1)
        return np.eye(25)[agent.get_action(observations, masks, best)]

    return action_probabilities


def first_candidates(genome, number, num_features, generator):
    """Genes (number, 2 x features): doing nothing, the 20 other constant plans, then random ones, as many as fit."""
    levels = [(2, 2), *((density, mix) for density in (4, 3, 1, 0) for mix in range(5))]
    genes = np.zeros((len(levels), num_features, 2))
    if genome == "plan":
        genes[:] = LEVELS[np.array(levels)][:, None]
        drawn = LEVELS[generator.integers(5, size=(number, num_features, 2))]
    else:
        genes[:, 0] = LEVELS[np.array(levels)]  # the constant alone
        drawn = np.clip(generator.normal(0, 0.5, (number, num_features, 2)), -1, 1)
    return np.concatenate([genes, drawn])[:number].reshape(number, -1)


# --------------------------------------------------------------------------------------------------- the search


def make_algorithm(args, first, num_objectives):
    """pymoo's algorithm, to be asked for genes and told their gains, which it takes with the opposite sign.

    first : genes of the first generation, (population, genes).
    """
    from pymoo.algorithms.moo.moead import ParallelMOEAD
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.mutation import Mutation
    from pymoo.core.problem import Problem
    from pymoo.decomposition.tchebicheff import Tchebicheff
    from pymoo.operators.crossover.pntx import TwoPointCrossover
    from pymoo.operators.crossover.sbx import SBX
    from pymoo.operators.mutation.pm import PM
    from pymoo.util.ref_dirs import get_reference_directions

    class DrawAnew(Mutation):
        """Each gene is drawn anew with probability one over their number."""

        def _do(self, problem, X, random_state=None, **kwargs):
            drawn = LEVELS[random_state.integers(5, size=X.shape)]
            return np.where(random_state.random(X.shape) < 1 / X.shape[1], drawn, X)

    if args.genome == "plan":  # exchange a stretch of years, draw levels anew
        operators = {"crossover": TwoPointCrossover(), "mutation": DrawAnew()}
    else:
        operators = {"crossover": SBX(eta=5), "mutation": PM(eta=5)}
    if args.algorithm == "nsga2":
        algorithm = NSGA2(pop_size=len(first), sampling=first, **operators)
    else:
        if num_objectives == 2:
            directions = fronts.simplex_lattice(2, len(first) - 1)
        else:
            directions = get_reference_directions("energy", num_objectives, len(first), seed=1)
        neighbours = max(2, len(first) // 3)
        algorithm = ParallelMOEAD(
            directions, n_neighbors=neighbours, decomposition=Tchebicheff(), sampling=first, **operators
        )
    problem = Problem(n_var=first.shape[1], n_obj=num_objectives, xl=-1.0, xu=1.0)
    algorithm.setup(problem, termination=("n_gen", 10**9), seed=args.seed)
    return algorithm


def tell(algorithm, asked, gains):
    """Tell the algorithm what it asked for."""
    from pymoo.core.evaluator import Evaluator
    from pymoo.problems.static import StaticProblem

    algorithm.tell(infills=Evaluator().eval(StaticProblem(algorithm.problem, F=-gains), asked))


def nondominated(genes, gains):
    """Those candidates that no other one dominates, the first of equal ones."""
    kept = fronts.is_nondominated(gains)
    return genes[kept], gains[kept]


if __name__ == "__main__":
    task = protocol.make_task(args, hide_site=args.hide_site)
    if not task.boreal:
        protocol.fail(f"--env-id {args.env_id}: candidates know the boreal environments alone")
    episodes_each = args.episodes_each or (1 if task.mode == "site-specific" else 8)
    args.num_envs = args.population * episodes_each
    if args.num_envs > protocol.MAX_ENVS:
        protocol.fail(f"--population x --episodes-each = {args.num_envs}: at most {protocol.MAX_ENVS} is allowed")
    if args.genome != "plan" and args.block_years != Args.block_years:
        protocol.fail(f"--block-years {args.block_years} is for --genome plan")
    if args.genome == "plan" and args.block_years > task.years:
        protocol.fail(f"--block-years {args.block_years}: at most the episode's {task.years} is allowed")
    looked_at = task.make()
    names = looked_at.unwrapped.observation_names
    wanted = ("year",) if args.genome == "plan" else INPUTS
    lacking = [name for name in wanted if name not in names and not name.startswith("site_")]
    if lacking or len(names) != looked_at.observation_space.shape[0]:
        what = lacking[0] if lacking else "entries by name, and a wrapper changes what is observed"
        protocol.fail(f"--env-id {args.env_id}: candidates look at {what}")
    steps_a_generation = args.num_envs * task.years
    num_generations = args.total_timesteps // steps_a_generation
    if not num_generations:
        protocol.fail(f"--total-timesteps {args.total_timesteps}: at least {steps_a_generation}, a generation")
    update_columns = ("generation", "global_step", "front_size", "gain_hypervolume", "mean_best_gain")

    tables = {"episodes": task.episode_columns, "updates": update_columns}
    with protocol.Run(args, task, __file__, plays_validation=False, **tables) as run:
        # TRY NOT TO MODIFY: seeding
        random.seed(args.seed)
        np.random.seed(args.seed)
        torch.manual_seed(args.seed)
        torch.set_num_threads(1)

        # env setup: candidate i has the environments i * episodes_each and on, and all candidates the same seeds
        envs = run.make_envs()
        start_seed = args.seed * protocol.MAX_ENVS
        seeds = [start_seed + k for _ in range(args.population) for k in range(episodes_each)]
        lattice = np.array([task.check_weights(w) for w in fronts.evaluation_weights(task.num_objectives)])

        inputs = [names.index(name) for name in wanted if name in names]
        blocks = -(-task.years // args.block_years) if args.genome == "plan" else 0
        shape = {"inputs": inputs, "num_blocks": blocks, "block_years": args.block_years}
        agent = Agent(envs, **shape, num_candidates=args.population, num_objectives=task.num_objectives)
        generator = np.random.default_rng([args.seed, 1])  # another stream than the algorithm's
        first = first_candidates(args.genome, args.population, agent.num_features, generator)
        algorithm = make_algorithm(args, first, task.num_objectives)

        # TRY NOT TO MODIFY: start the game
        told, zero_change, first_generation, global_step, episode = [], None, 1, 0, 0

        # RESUME: the algorithm is told again what it was told
        if state := run.resume():
            told, zero_change = state["told"], state["zero_change"]
            first_generation, global_step, episode = len(told) + 1, state["global_step"], state["episode"]
            for _, gains in told:
                tell(algorithm, algorithm.ask(), gains)
        progress = run.progress(num_generations * steps_a_generation, global_step)

        for generation in range(first_generation, num_generations + 1):
            rollout_start, env_seconds = time.perf_counter(), 0.0
            asked = algorithm.ask()
            if asked is None:  # all plans there are have been tried
                break
            genes = asked.get("X").astype(float)
            # all stands play: those left over where pymoo found fewer new candidates repeat the first
            agent.genes.copy_(torch.from_numpy(np.resize(genes, first.shape)))
            of_stand = np.arange(args.population).repeat(episodes_each)

            next_obs, _ = envs.reset(seed=seeds)
            preferences = protocol.observed_weights(next_obs, task.num_objectives)
            returns = np.zeros((args.num_envs, task.num_objectives))
            for _ in range(task.years):
                global_step += args.num_envs
                actions = agent.get_action(next_obs, task.action_masks(envs, next_obs), of_stand)
                env_start = time.perf_counter()
                next_obs, rewards, _, _, infos = envs.step(actions)
                env_seconds += time.perf_counter() - env_start
                returns += rewards
                progress.show(global_step)
            for i in range(len(genes) * episodes_each):
                episode += 1
                row = {"global_step": global_step, "episode": episode, "env": i}
                row |= task.returns_row(preferences[i], returns[i]) | protocol.final_info(infos, i)
                run.log("episodes", row)
                progress.returns.append(returns[i])
            run.time("environment", global_step, env_seconds)
            run.time("rollout", global_step, time.perf_counter() - rollout_start)
            update_start = time.perf_counter()

            means = returns.reshape(args.population, episodes_each, -1).mean(axis=1)
            zero_change = means[0] if zero_change is None else zero_change  # the very first candidate does nothing
            gains = (means - zero_change)[: len(genes)]
            tell(algorithm, asked, gains)
            told.append((genes, gains))

            # TRY NOT TO MODIFY: record the generation, and with it all before
            best = nondominated(*map(np.concatenate, zip(*told, strict=True)))
            row = {
                "generation": generation,
                "global_step": global_step,
                "front_size": len(best[1]),
                "gain_hypervolume": fronts.hypervolume(best[1], 0.0),
                "mean_best_gain": (lattice @ best[1].T).max(axis=1).mean(),
            }
            run.log("updates", row)
            run.time("update", global_step, time.perf_counter() - update_start)
            last = generation == num_generations
            run.save(global_step, last=last, told=told, zero_change=zero_change, episode=episode)

        envs.close()
        best = nondominated(*map(np.concatenate, zip(*told, strict=True)))
        shape |= {"num_candidates": len(best[0]), "num_objectives": task.num_objectives}
        agent = Agent(envs, **shape)
        agent.genes.copy_(torch.from_numpy(best[0]))
        agent.gains.copy_(torch.from_numpy(best[1]))
        run.save_policy(agent, **shape)

        evaluation_start = time.perf_counter()
        evaluation, years = protocol.evaluate(task, make_policy(agent), args.eval_weights, args.eval_episodes)
        run.time("evaluation", global_step, time.perf_counter() - evaluation_start)
        run.finish(evaluation, years)
