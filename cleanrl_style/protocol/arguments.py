"""The arguments that the training scripts and heuristics share: how they are read, filled in and checked."""

import contextlib
import dataclasses
import importlib.util
import io
import sys

import gymnasium as gym
import numpy as np
import tyro

import boreal_env
from cleanrl_style.protocol.fronts import evaluation_weights
from cleanrl_style.protocol.sites import FIRST_EVALUATION_SEED, evaluation_seeds
from cleanrl_style.protocol.task import Task

#: Environments that a training may have, at most.
MAX_ENVS = 1000
DEFAULT_STEPS = {"generalist": 300_000, "site-specific": 100_000}  # of a training, by the environment's mode
# Arguments that change nothing in what a run computes.
FREE_ARGUMENTS = ("run_dir", "overwrite", "track", "wandb_project_name")

# Closed interval of each argument that has one.
LIMITS = {
    "seed": (0, FIRST_EVALUATION_SEED // MAX_ENVS - 1),
    "site_seed": (0, 2**63 - 1),
    "total_timesteps": (1, 10**12),
    "num_envs": (1, MAX_ENVS),
    "eval_episodes": (1, 10**6),
    "eval_weights": (0, 1),
    "learning_rate": (0, 1),
    "gamma": (0, 1),
    "gae_lambda": (0, 1),
    "rollout_steps": (1, 10**9),
    "minibatch_size": (2, 10**9),
    "update_epochs": (1, 10**6),
    "clip_coef": (0, 10),
    "ent_coef": (0, 10),
    "vf_coef": (0, 10),
    "max_grad_norm": (0, 10**6),
    "reward_scales": (0, 10**6),
    "threshold": (0, 1),
    "preference": (0, 1),
}


def fail(message: str):
    """End the script with one line on stderr and a non-zero exit."""
    sys.exit(f"error: {message}")


def describe(arguments: type) -> str:
    """What `--help` says of a script: of one that trains how to try it, and what becomes of it."""
    if not hasattr(arguments, "total_timesteps"):
        return arguments.__doc__
    return f"""{arguments.__doc__}

    python {sys.argv[0]} --vectorization lockstep --total-timesteps 3200

is a trial. Without the last flag it trains for 300,000 steps. A stopped run goes on with the same command, to the same
bytes. The folder gets config.json, episodes.csv, updates.csv, evaluation.csv and summary.png, which docs/algorithms
explains; python analysis/make_tables.py sets it beside other runs."""


def parse(arguments: type):
    """The command line as an instance of `arguments`; a bad flag or value ends the script with one line."""
    errors = io.StringIO()
    try:
        with contextlib.redirect_stderr(errors):
            return tyro.cli(arguments, description=describe(arguments))
    except SystemExit as end:
        if not end.code:
            raise
    # tyro draws a box: its message, a rule, then help on the flag
    lines = [line.strip("│ ") for line in errors.getvalue().splitlines() if line.startswith("│")]
    rules = [i for i, line in enumerate(lines) if line.startswith("─")]
    fail(" ".join(lines[: rules[0] if rules else None]) or errors.getvalue().strip())


def make_task(args, *, preference=None, hide_site: bool = False, **env_kwargs) -> Task:
    """The environment that the arguments name. Fills them in and checks them, in place, before a file is written.

    preference : of every training episode, a number or weights; None has the environment draw one for each.
    hide_site : whether its site parameters are left out of the observation. env_kwargs : more of its arguments.
    Exits with one line that names the bad value and what is allowed.
    """
    for name, (low, high) in LIMITS.items():
        given = getattr(args, name, None)
        for value in [] if given is None else np.ravel(given).tolist():
            if not low <= value <= high:
                fail(f"--{name.replace('_', '-')} must lie in [{low}, {high}], not {value}")
    args.env_id = name_environment(args)
    registered = ask(args.env_id)  # as it is without the flags
    fill_in(args, registered)

    if args.mode != registered.mode:
        fail(f"--mode {args.mode} contradicts --env-id {args.env_id}, which is {registered.mode}")
    given = {"thaw_formulation": args.thaw_formulation, "site_seed": args.site_seed}
    flags = {name: value for name, value in given.items() if value != getattr(registered, name, None)}
    for name in flags if not registered.boreal else ():
        fail(f"--{name.replace('_', '-')} is for boreal environments, not for --env-id {args.env_id}")
    env_kwargs |= flags
    if hide_site:
        env_kwargs["observation_groups"] = tuple(group for group in boreal_env.OBSERVATION_GROUPS if group != "site")
        if not registered.boreal or not registered.site_entries:
            fail(f"--hide-site: --env-id {args.env_id} observes no site parameters")
    task = ask(args.env_id, **env_kwargs)
    if preference is None and hasattr(args, "total_timesteps") and not task.observes_preference:
        fail(f"--env-id {args.env_id}: its observation lacks the preference; observation_groups must have that group")
    if preference is not None:
        with refusing("--preference"):
            task = task.with_preference(preference)
    lockstep = getattr(args, "vectorization", "async") == "lockstep"
    if lockstep and not task.has_lockstep:
        fail(f"--vectorization lockstep: {args.env_id} has no vector entry point; async has no need of one")
    if lockstep and preference is not None and not task.boreal:
        fail(f"--vectorization lockstep: --env-id {args.env_id} cannot keep a --preference so; async has no need of it")

    with refusing("--eval-weights"):
        weights = [tuple(task.check_weights(value)) for value in args.eval_weights]
    with refusing("--eval-episodes"):
        evaluation_seeds(task, args.eval_episodes)
    if not weights or len(set(weights)) < len(weights):
        fail("--eval-weights must name at least one weight, and none twice")
    if hasattr(args, "rollout_steps") and args.rollout_steps % args.num_envs:
        fail(
            f"--rollout-steps {args.rollout_steps}, a sum over all environments, must be a multiple of "
            f"--num-envs {args.num_envs}"
        )
    if hasattr(args, "total_timesteps") and args.total_timesteps < args.num_envs:
        fail(f"--total-timesteps {args.total_timesteps} must be at least --num-envs {args.num_envs}")
    for package in getattr(args, "track", ()):
        if importlib.util.find_spec(package) is None:
            fail(f"--track {package}: the package is not installed (pip install {package})")
    return task


def name_environment(args) -> str:
    """The environment's id: that of --env-id, or of the mode."""
    if args.env_id is None:
        return "boreal-site-specific-v0" if args.mode == "site-specific" else "boreal-generalist-v0"
    env_id = args.env_id.removeprefix("boreal_env:")
    if env_id not in gym.registry and f"{env_id}-v0" in gym.registry:
        fail(f"--env-id {env_id}: give the version, {env_id}-v0")
    return env_id


def ask(env_id: str, **env_kwargs) -> Task:
    """The environment's answers; exits with one line if there is none, or one that the scripts cannot handle."""
    ours = ", ".join(name for name in gym.registry if name.startswith("boreal-"))
    allowed = f"allowed: {ours}, or module:id of an environment of yours"
    if env_id.count(":") > 1 or not all(env_id.split(":")):
        fail(f"--env-id {env_id!r}; {allowed}")
    try:
        return Task.of(env_id, **env_kwargs)
    except (gym.error.Error, ModuleNotFoundError) as error:
        fail(f"--env-id {env_id}: {str(error).splitlines()[0]}; {allowed}")
    except ValueError as error:
        fail(f"--env-id {env_id}: {error}")


def fill_in(args, registered: Task) -> None:
    """Set, in place, the arguments that were left to others; registered : the environment without the flags."""
    if args.mode is None:
        args.mode = registered.mode
    if args.thaw_formulation is None:
        args.thaw_formulation = registered.thaw_formulation
    if getattr(args, "total_timesteps", 0) is None:
        args.total_timesteps = DEFAULT_STEPS[args.mode]
    if getattr(args, "num_envs", 0) is None:
        args.num_envs = 32 if args.vectorization == "lockstep" else 8
    number = registered.num_objectives
    if getattr(args, "reward_scales", ()) is None:
        args.reward_scales = (1.0,) * number
    if getattr(args, "eval_weights", ()) is None:
        args.eval_weights = evaluation_weights(number)
    elif number != 2 and hasattr(args, "eval_weights") and np.ndim(args.eval_weights) == 1:
        if len(args.eval_weights) % number:
            fail(f"--eval-weights: {number} numbers a weight, not {len(args.eval_weights)} in all")
        args.eval_weights = tuple(map(tuple, np.reshape(args.eval_weights, (-1, number)).tolist()))


def not_default(args) -> dict:
    """The arguments that make this another experiment than the script's default of the same environment."""
    given = {name: getattr(args, name) for name in ("env_id", "mode", "vectorization") if hasattr(args, name)}
    default = type(args)(**given)
    fill_in(default, ask(args.env_id))
    names = [field.name for field in dataclasses.fields(args) if field.name not in ("seed", *FREE_ARGUMENTS)]
    changed = {name: getattr(args, name) for name in names if getattr(args, name) != getattr(default, name)}
    if given.get("vectorization", "async") != "async":
        changed["vectorization"] = args.vectorization
    return changed


@contextlib.contextmanager
def refusing(flag: str):
    """A ValueError in the block ends the script, under the flag's name."""
    try:
        yield
    except ValueError as error:
        fail(f"{flag}: {str(error).removeprefix('preference: ')}")
