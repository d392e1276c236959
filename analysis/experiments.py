"""Every experiment: the main table on both tasks, what Group PPO owes to what, other libraries, then the paper's.

In this order, so that what is not run, if anything, is the end.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from analysis import paths
from analysis.methods import LEARNERS, METHODS, OUTSIDE, STRATEGIES
from analysis.runs import SITE_SPECIFIC, setting
from boreal_env import REGISTERED
from cleanrl_style.protocol.arguments import DEFAULT_STEPS, FREE_ARGUMENTS
from cleanrl_style.protocol.run_folder import as_text

ROOT = Path(__file__).parents[1]
GENERALIST, BALANCED, ONE_SITE = "boreal-generalist-v0", "boreal-balanced-v0", "boreal-site-specific-v0"
OTHER_WORLDS = ("boreal-timber-v0", "boreal-four-v0", "boreal-warming-v0")
STUDIES = ("constant_plans", "mechanism_pairs", "site_warming", "signal_to_noise", "gradient_noise")
READING = ("site_warming",)  # studies that read the runs before them
WEIGHTS = (0.0, 0.25, 0.5, 0.75, 1.0)
SITE_SEEDS = (1, 2, 3, 4, 5)
# analysis/studies/measure_balance.py: both returns vary equally between policies that none beats in both at 1.8 kgC m-2
# yr-1; the paper's rewards are at 2.0, so the carbon reward times 2.0 / 1.8
REWARD_SCALES = (1.11, 1.0)
OTHERS = {"baseline": "others", "num_envs": 8}  # of EUPG: the mean of a batch's other episodes
UNMASKED = ("plus_100", "target_density", "conifer_restoration")  # fixed strategies that a mask can forbid something


@dataclass(frozen=True)
class Job:
    """One command: a script and its flags, as name -> value."""

    experiment: str
    script: str
    flags: dict = field(default_factory=dict)

    @property
    def path(self) -> str:
        """The script's file, relative to the repository."""
        return f"analysis/studies/{self.script}.py" if self.is_study else METHODS[self.script].path

    @property
    def is_study(self) -> bool:
        """Whether it is a study of `analysis`, which leaves a table, not a run."""
        return self.script in STUDIES

    @property
    def waits(self) -> bool:
        """Whether the jobs before it have to be finished when it starts."""
        return self.script in READING

    @property
    def trains(self) -> bool:
        """Whether it trains an agent; else it evaluates a fixed strategy, or is a study."""
        return self.script in METHODS and METHODS[self.script].trains

    @property
    def arguments(self) -> list[str]:
        """The flags as on the command line."""
        words = []
        for name, value in self.flags.items():
            flag = f"--{'no-' if value is False else ''}{name.replace('_', '-')}"
            values = value if isinstance(value, tuple) else () if isinstance(value, bool) else (value,)
            words += [flag, *(f"{v:g}" if isinstance(v, float) else str(v) for v in values)]
        return words

    @property
    def command(self) -> str:
        """The command line, to be typed in the repository."""
        return " ".join(["python", self.path, *self.arguments])

    @property
    def mode(self) -> str:
        """The environment's mode."""
        return self.flags.get("mode", "generalist")

    @property
    def env_id(self) -> str:
        """The environment that the flags mean."""
        return self.flags.get("env_id") or (ONE_SITE if self.mode == SITE_SPECIFIC else GENERALIST)

    @property
    def steps(self) -> int:
        """Environment steps of its training."""
        return self.flags.get("total_timesteps", DEFAULT_STEPS[self.mode]) if self.trains else 0

    @property
    def row(self) -> tuple[str, str, str]:
        """(script, environment, setting): the row of a table that its run belongs to."""
        return self.script, self.env_id, setting(self.flags, self.mode)

    def made(self, config: dict) -> bool:
        """Whether a run with this config.json is this job's."""
        arguments, changed = config["arguments"], set(config["not_default"])
        return (
            config["script"] == self.script
            and arguments["env_id"] == self.env_id
            and all(
                as_text(arguments.get(name)) == as_text(value)
                for name, value in self.flags.items()
                if name not in FREE_ARGUMENTS
            )
            and changed <= {*self.flags, "env_id", "mode"}
        )


def trained(experiment: str, script: str, seed: int, **flags) -> Job:
    """A training run, in lockstep: on one core the faster of the two."""
    return Job(experiment, script, {"seed": seed, "vectorization": "lockstep", **flags})


def seeds_of(number: int, chosen: list[int] | None) -> list[int]:
    """Training seeds 1 .. number, or those of them that were chosen."""
    return [seed for seed in range(1, number + 1) if chosen is None or seed in chosen]


def main_table(seeds) -> list[Job]:
    """Heuristics and constant plans, then the methods, a seed of all before the next.

    The paper's strategies that plant or cut are played without masks, too: it names masks for its PPOs alone.
    """
    methods = [trained("main", script, seed) for seed in seeds_of(10, seeds) for script in LEARNERS]
    fixed = [Job("main", script) for script in (*STRATEGIES, "constant_plans")]
    unmasked = [Job("main", script, {"masks": False}) for script in UNMASKED]
    return [*fixed, *unmasked, *methods]


def balanced(seeds) -> list[Job]:
    """The same where the ground is in balance, and both returns vary equally between the policies worth choosing."""
    env = {"env_id": BALANCED}
    return [Job("balanced", script, env) for script in STRATEGIES] + [
        trained("balanced", script, seed, **env) for seed in seeds_of(10, seeds) for script in LEARNERS
    ]


def group(seeds) -> list[Job]:
    """Group PPO with one choice changed; with groups of one it is PPO with whole episodes."""
    changes = (
        {"group_size": 1},
        {"group_size": 2},
        {"hide_site": True},
        {"objective_logits": False},
        {"ent_coef": 0.0},
        {"gae_lambda": (0.95,)},
        {"reward_scales": REWARD_SCALES},
    )
    return [trained("group", "ppo_group", seed, **change) for seed in seeds_of(5, seeds) for change in changes]


def outside(seeds) -> list[Job]:
    """Algorithms of other libraries with our budget, on both tasks; they step one environment."""
    return [
        Job("outside", script, {"seed": seed, **env})
        for seed in seeds_of(5, seeds)
        for env in ({}, {"env_id": BALANCED})
        for script in OUTSIDE
    ]


def planners(seeds) -> list[Job]:
    """NSGA-II and MOEA/D with our budget, on both tasks."""
    return [
        trained("planners", "moea", seed, **algorithm, **env)
        for seed in seeds_of(5, seeds)
        for env in ({}, {"env_id": BALANCED})
        for algorithm in ({}, {"algorithm": "moead"})
    ]


def bandit(seeds) -> list[Job]:
    """A plan for each site by regression, on both tasks."""
    return [
        trained("bandit", "plan_regression", seed, **env)
        for seed in seeds_of(5, seeds)
        for env in ({}, {"env_id": BALANCED})
    ]


def other_worlds(seeds) -> list[Job]:
    """Group PPO with three and four objectives, and in a climate that warms."""
    return [
        trained("worlds", "ppo_group", seed, env_id=env_id) for seed in seeds_of(5, seeds) for env_id in OTHER_WORLDS
    ]


def fixed_weights(seeds) -> list[Job]:
    """EUPG trained for one weight, on all sites."""
    return [
        trained("fixed", "eupg_fixed_lambda", seed, preference=weight)
        for seed in seeds_of(5, seeds)
        for weight in WEIGHTS
    ]


def single_sites(seeds) -> list[Job]:
    """EUPG trained for one weight, on one site; the site's seed is the training seed too.

    Then its ends with a baseline, and thaw alone with the whole return, as EUPG is defined. In site-specific mode every
    episode has the same first stand and weather: what keeps an agent from learning there is no noise of sites.
    """
    numbers = seeds_of(len(SITE_SEEDS), seeds)
    sites = {seed: {"mode": SITE_SPECIFIC, "site_seed": SITE_SEEDS[seed - 1]} for seed in numbers}
    jobs = []
    for seed, site in sites.items():
        jobs.append(Job("site", "zero_change", site))
        jobs += [trained("site", "eupg_fixed_lambda", seed, preference=weight, **site) for weight in WEIGHTS]
    others = ((0.0, OTHERS), (1.0, OTHERS), (0.0, {"utility": "total"}))
    return jobs + [
        trained("site", "eupg_fixed_lambda", seed, preference=weight, **flags, **site)
        for seed, site in sites.items()
        for weight, flags in others
    ]


def thaw_formulations(seeds) -> list[Job]:
    """Gated PPO under the two formulations that are not the default."""
    formulations = ("contrast", "raw_degree_days")
    return [Job("thaw", "zero_change", {"thaw_formulation": formulation}) for formulation in formulations] + [
        trained("thaw", "ppo_gated", seed, thaw_formulation=formulation)
        for seed in seeds_of(5, seeds)
        for formulation in formulations
    ]


def controls(seeds) -> list[Job]:
    """No selection is ppo_gated of the main table; here half and twice its budget, and other ways to select.

    The curriculum trains on about half of its episodes: with half the budget, ppo_gated has as many in gradients.
    """
    variants = (
        ("ppo_gated", {"total_timesteps": DEFAULT_STEPS["generalist"] // 2}),
        ("ppo_curriculum", {"raw_selector": True}),
        ("ppo_gated", {"total_timesteps": 2 * DEFAULT_STEPS["generalist"]}),
        ("ppo_curriculum", {"selector": "coin"}),
    )
    return [trained("controls", script, seed, **flags) for script, flags in variants for seed in seeds_of(5, seeds)]


def variants(seeds) -> list[Job]:
    """Gated PPO and EUPG with one choice changed, each of which a sentence of claims or documents is about."""
    changes = (
        ("ppo_gated", {"ent_coef": 0.0}),
        ("ppo_gated", {"ent_coef": 0.0, "per_objective_advantages": True}),
        ("ppo_gated", {"hide_site": True}),
        ("ppo_gated", {"reward_scales": REWARD_SCALES}),
        ("eupg_var_lambda", {"utility": "total", "num_envs": 8}),
        ("eupg_var_lambda", OTHERS),
        ("eupg_var_lambda", {"masks": False}),  # the paper names no masks for its EUPG
    )
    return [trained("variants", script, seed, **change) for script, change in changes for seed in seeds_of(5, seeds)]


def budgets(seeds) -> list[Job]:
    """Group PPO with a third of the budget, with three times and a bit of it, and with ten times."""
    changes = (
        (5, {"total_timesteps": 100_000}),
        (10, {"total_timesteps": 1_000_000}),  # rows of the README, as those of the main table
        (10, {"total_timesteps": 1_000_000, "env_id": BALANCED}),
        (5, {"total_timesteps": 3_000_000}),
        (5, {"total_timesteps": 3_000_000, "env_id": BALANCED}),
    )
    return [
        trained("budgets", "ppo_group", seed, **change)
        for number, change in changes
        for seed in seeds_of(number, seeds)
    ]


def mechanisms(seeds) -> list[Job]:
    """Studies that need no training; the warming of selected sites reads the curriculum's runs."""
    return [Job("mechanisms", script) for script in ("mechanism_pairs", "site_warming")]


def difficulty(seeds) -> list[Job]:
    """Studies of how hard thaw is to learn, which read no run."""
    return [Job("difficulty", script) for script in ("signal_to_noise", "gradient_noise")]


class Experiment(NamedTuple):
    """Jobs, made of the chosen training seeds (None: all), and what they are for."""

    jobs: Callable[[list[int] | None], list[Job]]
    what: str


EXPERIMENTS = {
    "main": Experiment(
        main_table,
        "main table, on `boreal-generalist-v0`: fixed strategies and plans, the paper's methods, group PPO, 10 seeds",
    ),
    "balanced": Experiment(balanced, "the same on `boreal-balanced-v0`"),
    "group": Experiment(group, "group PPO with one choice changed, such as the size of groups"),
    "outside": Experiment(outside, "algorithms of other libraries, on both tasks"),
    "planners": Experiment(planners, "NSGA-II and MOEA/D over a small policy, on both tasks"),
    "bandit": Experiment(bandit, "a constant plan for each site, chosen by a regression, on both tasks"),
    "worlds": Experiment(other_worlds, "group PPO with three and four objectives, and in a climate that warms"),
    "fixed": Experiment(fixed_weights, "learning asymmetry: EUPG with a fixed weight, one run a weight and seed"),
    "site": Experiment(single_sites, "the same on single sites, one run a weight and site"),
    "thaw": Experiment(thaw_formulations, "the thaw reward's formulations: gated PPO"),
    "controls": Experiment(controls, "what of the curriculum it is that helps"),
    "variants": Experiment(variants, "gated PPO and EUPG with one choice changed"),
    "mechanisms": Experiment(mechanisms, "physical conflicts, counterfactual pairs, warming of selected sites"),
    "difficulty": Experiment(difficulty, "why thaw is hard to learn: noise of actions and gradients"),
    "budgets": Experiment(budgets, "group PPO with 100,000, 1,000,000 and 3,000,000 steps"),
}


def jobs(only=tuple(EXPERIMENTS), seeds: list[int] | None = None) -> list[Job]:
    """All jobs of the chosen experiments and seeds, in order."""
    return [job for name in EXPERIMENTS if name in only for job in EXPERIMENTS[name].jobs(seeds)]


# ------------------------------------------------------------------------------------------------- in small

QUICK_STEPS = 1600  # an episode of each of 32 stands
QUICK_STEPS_ALONE = 400  # of scripts that step one stand
QUICK_POPULATION = {"population": 8, "episodes_each": 2}  # of NSGA-II, whose generation is more than those steps
QUICK_ROUND = {"total_timesteps": 4200}  # of plan regression, which plays 21 plans on four sites at least
QUICK_EVALUATION = {"eval_episodes": 2, "eval_weights": (0.0, 0.5, 1.0)}


def quick_jobs(only=tuple(EXPERIMENTS)) -> list[Job]:
    """Every script of every experiment, in seconds: one seed, the first of its settings, the outer weights."""
    small, seen = [], set()
    for number, job in enumerate(jobs(seeds=[1])):  # numbered the same whatever is asked for
        if job.experiment not in only:
            continue
        flags = dict(job.flags)
        kind = job.experiment, job.script, flags.get("preference")
        if kind in seen or flags.get("preference", 0.0) not in (0.0, 1.0):
            continue
        seen.add(kind)
        if job.is_study:
            small.append(Job(job.experiment, job.script, {"quick": True}))
            continue
        if job.steps:
            alone = job.script.startswith("eupg") and "num_envs" not in flags
            steps = QUICK_STEPS_ALONE if alone else QUICK_STEPS
            flags["total_timesteps"] = steps * job.steps // DEFAULT_STEPS[job.mode]
        flags |= QUICK_EVALUATION | {"moea": QUICK_POPULATION, "plan_regression": QUICK_ROUND}.get(job.script, {})
        if names := REGISTERED[job.env_id].get("objectives"):  # more than two: each alone
            flags["eval_weights"] = tuple(float(one == other) for one in names for other in names)
        if "preference" in flags:
            del flags["eval_weights"]  # an agent of one weight is evaluated at it
        flags["run_dir"] = paths.runs(quick=True) / f"{number:02d}-{job.script}"
        small.append(Job(job.experiment, job.script, flags))
    return small
