"""The arguments that the training scripts and heuristics share: how they are filled in and checked."""

import contextlib
import dataclasses
import importlib.util

import gymnasium as gym
import numpy as np

import boreal_env
from cleanrl_style.flags import (
    check_environment,
    check_limits,
    check_mode,
    check_scales,
    check_weights_given,
    fail,
    fill_in_envs,
    no_environment,
)
from cleanrl_style.protocol.fronts import evaluation_weights, return_columns
from cleanrl_style.protocol.reference import constant, reference_returns
from cleanrl_style.protocol.sites import evaluation_seeds, published_seeds
from cleanrl_style.protocol.task import Task
from cleanrl_style.protocol.utility import SCALARIZATIONS, Chebyshev

ONE_SITE_EPISODES = 32  # that an ideal point is taken from, where a task has one site under many weathers
DEFAULT_STEPS = {"generalist": 300_000, "site-specific": 100_000}  # of a training, by the environment's mode
# Arguments that change nothing in what a run computes.
FREE_ARGUMENTS = ("run_dir", "overwrite", "track", "wandb_project_name")


def make_task(args, *, preference=None, hide_site: bool = False) -> Task:
    """The environment that the arguments name. Fills them in and checks them, in place, before a file is written.

    preference : of every training episode, a number or weights; None has the environment draw one for each.
    hide_site : whether its site parameters are left out of the observation.
    Exits with one line that names the bad value and what is allowed.
    """
    check_limits(args)
    args.env_id = name_environment(args)
    registered = ask(args.env_id)  # as it is without the flags
    if hasattr(args, "preference"):  # a script with one preference is evaluated at it
        if registered.num_objectives == 2 and np.size(args.preference) == 2:  # the same as the first weight alone
            with refusing("--preference"):
                args.preference = float(registered.check_weights(args.preference)[0])
        args.eval_weights = (args.preference,)
    fill_in(args, registered)

    check_mode(args, registered.mode)
    given = {"thaw_formulation": args.thaw_formulation, "site_seed": args.site_seed}
    env_kwargs = {name: value for name, value in given.items() if value != getattr(registered, name, None)}
    for name in env_kwargs if not registered.boreal else ():
        fail(f"--{name.replace('_', '-')} is for boreal environments, not for --env-id {args.env_id}")
    if hide_site:
        if not registered.boreal or not registered.site_entries:
            fail(f"--hide-site: --env-id {args.env_id} observes no site parameters")
        env_kwargs["observation_groups"] = groups_without_site(args.env_id)
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
    if not weights or len({tuple(np.round(weight, 6)) for weight in weights}) < len(weights):  # as tables are read
        given = " ".join(str(weight) for weight in args.eval_weights)
        fail(f"--eval-weights {given}: at least one weight, and none twice to six digits, is allowed")
    if len(set(tracked := getattr(args, "track", ()))) < len(tracked):
        fail(f"--track {' '.join(tracked)}: each once is allowed")
    for package in tracked:
        if importlib.util.find_spec(package) is None:
            fail(f"--track {package}: the package is not installed (pip install {package})")
    scalarization = getattr(args, "scalarization", "linear")
    if scalarization not in SCALARIZATIONS:
        allowed = f"allowed are {', '.join(SCALARIZATIONS)} (cleanrl_style/protocol/utility.py)"
        fail(f"--scalarization {scalarization}: {allowed}")
    if scalarization != "linear" and any(scale != 1.0 for scale in getattr(args, "reward_scales", ())):
        fail(f"--reward-scales: --scalarization {scalarization} is of rewards as they are: 1 each is allowed")
    if SCALARIZATIONS[scalarization] is Chebyshev:
        return dataclasses.replace(task, utility=Chebyshev(ideal_point(task, args.ideal_point)))
    if getattr(args, "ideal_point", None) is not None:
        fail("--ideal-point is for --scalarization chebyshev")
    return dataclasses.replace(task, utility=SCALARIZATIONS[scalarization]())


def ideal_point(task: Task, given=None) -> tuple[float, ...]:
    """The point that Chebyshev's utility measures from, a return for each objective.

    In each objective it is the return of the constant plan which is best in it, mean of the task's validation episodes
    (on one site, of ONE_SITE_EPISODES weathers): fixed by the task, whatever is learned. given : by the user instead.
    """
    names = ", ".join(task.objectives)
    if given is None and not task.boreal:
        fail(f"--ideal-point: a return for each of {names} is needed, as --env-id {task.env_id} has no constant plans")
    if given is None:
        weathers = 1 if task.mode == "site-specific" else ONE_SITE_EPISODES
        episodes = len(published_seeds("validation")) if task.draws_sites else weathers
        plans = reference_returns(task, evaluation_seeds(task, episodes, "validation"))
        given = constant(plans).groupby("plan")[return_columns(task.objectives)].mean().max().round(2)
        shown = (f"{name} {value:g}" for name, value in zip(task.objectives, given, strict=True))
        print(f"Chebyshev's ideal point: {', '.join(shown)}")
    if len(given) != task.num_objectives or not np.isfinite(given).all():
        fail(f"--ideal-point: {task.num_objectives} finite numbers, of {names}, are allowed, not {list(given)}")
    return tuple(float(value) for value in given)


def groups_without_site(env_id: str) -> tuple[str, ...]:
    """What is observed of a boreal environment, which is registered, but its site parameters."""
    groups = gym.spec(env_id.split(":")[-1]).kwargs.get("observation_groups") or boreal_env.OBSERVATION_GROUPS
    return tuple(group for group in groups if group != "site")


def name_environment(args) -> str:
    """The environment's id: that of --env-id, or of the mode."""
    if args.env_id is None:
        return "boreal-site-specific-v0" if args.mode == "site-specific" else "boreal-generalist-v0"
    env_id = args.env_id.removeprefix("boreal_env:")
    check_environment(env_id)
    return env_id


def ask(env_id: str, flag: str = "--env-id", **env_kwargs) -> Task:
    """The environment's answers; exits with one line if there is none, or one that the scripts cannot handle."""
    if env_id.count(":") > 1 or not all(env_id.split(":")):
        fail(f"{flag} {no_environment(ValueError(repr(env_id)))}")
    module = env_id.rpartition(":")[0]
    if module.endswith(".py") or module and not all(map(str.isidentifier, module.split("."))):
        fail(f"{flag} {env_id}: a module is allowed, such as pond:pond-v0, with PYTHONPATH=. where pond.py lies")
    try:
        return Task.of(env_id, **env_kwargs)
    except (gym.error.Error, ImportError) as error:
        fail(f"{flag} {env_id}: {no_environment(error)}")
    except SyntaxError as error:
        fail(f"{flag} {env_id}: {error.filename}, line {error.lineno}: {error.msg}")
    except ValueError as error:
        fail(f"{flag} {env_id}: {error}")


def fill_in(args, registered: Task) -> None:
    """Set, in place, the arguments that were left to others; registered : the environment without the flags."""
    if args.mode is None:
        args.mode = registered.mode
    if args.thaw_formulation is None:
        args.thaw_formulation = registered.thaw_formulation
    if getattr(args, "total_timesteps", 0) is None:
        args.total_timesteps = DEFAULT_STEPS[args.mode]
    fill_in_envs(args)
    number = registered.num_objectives
    if getattr(args, "reward_scales", ()) is None:
        args.reward_scales = (1.0,) * number
    check_scales(args, registered.objectives)
    if getattr(args, "eval_weights", ()) is None:
        args.eval_weights = evaluation_weights(number)
    elif number != 2 and hasattr(args, "eval_weights") and np.ndim(args.eval_weights) == 1:
        check_weights_given(args, number)
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
