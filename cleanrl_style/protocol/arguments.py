"""The arguments that the training scripts and heuristics share: how they are read, filled in and checked."""

import contextlib
import importlib.util
import io
import sys

import gymnasium as gym
import tyro

import boreal_env
from cleanrl_style.protocol.evaluation import FIRST_EVALUATION_SEED, MODES, as_mask

MAX_ENVS = 1000
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


def resolve(args) -> None:
    """Fill in, in place, the arguments whose default depends on another one."""
    if args.env_id is None:
        args.env_id = "boreal-site-specific-v0" if args.mode == "site-specific" else "boreal-generalist-v0"
    args.env_id = args.env_id.removeprefix("boreal_env:")
    if args.env_id not in MODES and args.env_id + "-v0" in MODES:
        fail(f"--env-id {args.env_id}: give the version, {args.env_id}-v0")
    if args.mode is None:
        args.mode = MODES.get(args.env_id, "generalist")
    if getattr(args, "total_timesteps", 0) is None:
        args.total_timesteps = 100_000 if args.mode == "site-specific" else 300_000
    if getattr(args, "num_envs", 0) is None:
        args.num_envs = 32 if args.vectorization == "lockstep" else 8
    if hasattr(args, "preference"):
        args.eval_weights = (args.preference,)


def not_default(args) -> dict:
    """The arguments that make this another experiment than the script's default of the same environment."""
    given = {name: getattr(args, name) for name in ("env_id", "mode", "vectorization") if hasattr(args, name)}
    default = type(args)(**given)
    resolve(default)
    alike = {"seed", *FREE_ARGUMENTS} | ({"eval_weights"} if hasattr(args, "preference") else set())
    changed = {
        name: value for name, value in vars(args).items() if name not in alike and value != getattr(default, name)
    }
    if given.get("vectorization", "async") != "async":
        changed["vectorization"] = args.vectorization
    return changed


def prepare(args) -> dict:
    """Resolve and check all arguments, before anything is created; returns the environment's arguments.

    Exits with one line that names the bad value and what is allowed.
    """
    resolve(args)
    for name, (low, high) in LIMITS.items():
        given = getattr(args, name, None)
        for value in given if isinstance(given, tuple) else (given,):
            if value is not None and not low <= value <= high:
                fail(f"--{name.replace('_', '-')} must lie in [{low}, {high}], not {value}")
    if not args.eval_weights or len(set(args.eval_weights)) < len(args.eval_weights):
        fail("--eval-weights must name at least one weight, and none twice")

    boreal = args.env_id in MODES
    if boreal and args.mode != MODES[args.env_id]:
        fail(f"--mode {args.mode} contradicts --env-id {args.env_id}, which is {MODES[args.env_id]}")
    if not boreal and (args.mode != "generalist" or args.thaw_formulation != "asymmetric"):
        fail(f"--mode and --thaw-formulation are for {', '.join(MODES)}, not for --env-id {args.env_id}")
    if not boreal and args.site_seed is not None:
        fail(f"--site-seed is for {', '.join(MODES)}, not for --env-id {args.env_id}")
    env_kwargs = {"thaw_formulation": args.thaw_formulation} if boreal else {}
    if args.site_seed is not None:
        env_kwargs["site_seed"] = args.site_seed
    if getattr(args, "hide_site", False):
        if not boreal or args.mode == "site-specific":
            generalist = " and ".join(name for name, mode in MODES.items() if mode == "generalist")
            fail(f"--hide-site is for {generalist}: --env-id {args.env_id} observes no site parameters")
        env_kwargs["observation_groups"] = tuple(group for group in boreal_env.OBSERVATION_GROUPS if group != "site")
    if boreal and hasattr(args, "preference"):
        env_kwargs["fixed_preference"] = args.preference
    if not boreal and hasattr(args, "preference") and args.vectorization == "lockstep":
        fail(f"--vectorization lockstep: only {', '.join(MODES)} can keep a --preference so; async has no need of it")

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
    check_environment(args, env_kwargs)
    return env_kwargs


def check_environment(args, env_kwargs: dict) -> None:
    """Exit with one line unless the environment exists and is of the kind that the scripts can handle."""
    allowed = f"allowed: {', '.join(MODES)}, or module:id of an environment of yours"
    if args.env_id.count(":") > 1 or not all(args.env_id.split(":")):
        fail(f"--env-id {args.env_id!r}; {allowed}")
    try:
        env = gym.make(args.env_id, disable_env_checker=True, **env_kwargs)
    except (gym.error.Error, ModuleNotFoundError) as error:
        fail(f"--env-id {args.env_id}: {str(error).splitlines()[0]}; {allowed}")
    space, actions = env.observation_space, env.action_space
    if not isinstance(space, gym.spaces.Box) or len(space.shape) != 1:
        fail(f"--env-id {args.env_id}: observations must be a Box of one dimension, not {space}")
    if not isinstance(actions, gym.spaces.Discrete) or actions.n != 25:
        fail(f"--env-id {args.env_id}: actions must be Discrete(25), not {actions}")
    if getattr(env.unwrapped, "reward_dim", None) != 2 or not hasattr(env.unwrapped, "action_masks"):
        fail(f"--env-id {args.env_id}: the environment needs reward_dim 2 and action_masks()")
    if args.env_id not in MODES:
        if env.reset(seed=0, options={"preference": 0.25})[0][0] != 0.25:
            fail(f"--env-id {args.env_id}: reset(options={{'preference': w}}) must give w as observation 0")
        try:
            as_mask(env.unwrapped.action_masks(), args.env_id)
        except ValueError as error:
            fail(str(error))
    if getattr(args, "vectorization", "async") == "lockstep" and env.spec.vector_entry_point is None:
        fail(f"--vectorization lockstep: {args.env_id} has no vector entry point; async has no need of one")
    env.close()
