"""What every training script and heuristic shares, whatever its algorithm: arguments, run folder, evaluation.

A script calls `prepare` (arguments) and `Run` (folder), logs rows and shows `Progress` while it trains, and
ends with `evaluate` and `run.finish`.
"""

import contextlib
import csv
import importlib.metadata
import io
import json
import os
import platform
import subprocess
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd
import tyro

from analysis.evaluation import (  # noqa: F401 (the scripts' one import)
    EVAL_WEIGHTS,
    FIRST_EVALUATION_SEED,
    MODES,
    POLICIES,
    action_masks,
    evaluate,
    final_info,
)
from analysis.metrics import scalarize  # noqa: F401
from analysis.progress import Progress  # noqa: F401
from analysis.summary import draw_summary, print_table

MAX_ENVS = 1000
EPISODE_INFO = ("final_density", "mean_density", "final_conifer_fraction", "mean_conifer_fraction")
EPISODE_COLUMNS = ("global_step", "episode", "env", "site_seed", "preference", "carbon_return", "thaw_return",
                   "scalarized_return", *EPISODE_INFO)
TIMING_COLUMNS = ("phase", "global_step", "seconds", "elapsed_seconds")
RUN_FILES = ("config.json", "episodes.csv", "updates.csv", "timing.csv", "checkpoint.pt",
             "evaluation_years.csv", "summary.png", "evaluation.csv")
FLOAT_FORMAT = "%.9g"

# ---------------------------------------------------------------------------------------------- arguments

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
    "threshold": (0, 1),
}


def fail(message: str):
    """End the script with one line on stderr and a non-zero exit."""
    sys.exit(f"error: {message}")


def parse(arguments: type):
    """The command line as an instance of `arguments`; a bad flag or value ends the script with one line."""
    errors = io.StringIO()
    try:
        with contextlib.redirect_stderr(errors):
            return tyro.cli(arguments)
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
    if args.mode != "site-specific" and args.site_seed is not None:
        fail("--site-seed is for --mode site-specific: in generalist mode every episode draws its site")
    env_kwargs = {"thaw_formulation": args.thaw_formulation} if boreal else {}
    if args.site_seed is not None:
        env_kwargs["site_seed"] = args.site_seed

    if hasattr(args, "rollout_steps") and args.rollout_steps % args.num_envs:
        fail(f"--rollout-steps {args.rollout_steps}, a sum over all environments, must be a multiple of "
             f"--num-envs {args.num_envs}")
    if hasattr(args, "total_timesteps") and args.total_timesteps < args.num_envs:
        fail(f"--total-timesteps {args.total_timesteps} must be at least --num-envs {args.num_envs}")
    check_environment(args, env_kwargs)
    return env_kwargs


def check_environment(args, env_kwargs: dict) -> None:
    """Exit with one line unless the environment exists and is of the kind that the scripts can handle."""
    allowed = f"allowed: {', '.join(MODES)}, or module:id of an environment of yours"
    if args.env_id.count(":") > 1 or not args.env_id:
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
    if args.env_id not in MODES and env.reset(seed=0, options={"preference": 0.25})[0][0] != 0.25:
        fail(f"--env-id {args.env_id}: reset(options={{'preference': w}}) must give w as observation 0")
    if getattr(args, "vectorization", "async") == "lockstep" and env.spec.vector_entry_point is None:
        fail(f"--vectorization lockstep: {args.env_id} has no vector entry point; async has no need of one")
    env.close()


def environment_state(envs: gym.vector.VectorEnv, env_id: str):
    """State of every environment, generators included; None for a user's, which need not offer it."""
    if env_id not in MODES:
        return None
    return envs.get_state() if hasattr(envs, "get_state") else envs.call("get_state")


# --------------------------------------------------------------------------------------------- run folder


@contextlib.contextmanager
def replacing(path: Path):
    """A binary file that takes the place of `path` when the block ends: nobody ever sees half of it."""
    temporary = path.with_name(path.name + ".tmp")
    try:
        with open(temporary, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


class Table:
    """A CSV file that grows by rows, each handed to the system at once: it outlives a killed process."""

    def __init__(self, path: Path, columns):
        self.file = open(path, "w", buffering=1, newline="", encoding="utf-8")
        self.writer = csv.DictWriter(self.file, columns, lineterminator="\n")
        self.writer.writeheader()

    def write(self, row: dict) -> None:
        """Append a row; columns that it lacks stay empty, one that the table lacks raises ValueError."""
        self.writer.writerow({
            name: FLOAT_FORMAT % value if isinstance(value, (float, np.floating)) else value
            for name, value in row.items()
        })


class Run:
    """A run's folder: its configuration, its tables (given as name=columns) and its results.

    A run is finished when `evaluation.csv` exists: it is written last. Exits with one line if the folder is
    another run's, cannot be written, or holds this run finished (exit 0) or unfinished.
    """

    def __init__(self, args, script: str, **tables):
        self.args, self.script = args, script
        self.start = time.perf_counter()
        changed = not_default(args)
        name = "-".join([args.env_id.split(":")[-1].replace("/", "-"), *map(describe, changed.items())])
        self.folder = Path(args.run_dir or Path("runs", script, name, f"seed{args.seed}"))
        self.config = {
            "script": script,
            "arguments": {k: value for k, value in vars(args).items() if k not in ("run_dir", "overwrite")},
            "not_default": changed,
            "versions": versions(),
            "commit": commit(),
        }
        try:
            self._claim_folder()
            self.tables = {name: Table(self.folder / f"{name}.csv", columns)
                           for name, columns in {**tables, "timing": TIMING_COLUMNS}.items()}
        except OSError as error:
            fail(f"--run-dir {self.folder}: cannot write there ({error.strerror})")
        print(f"{script}: {args.env_id}, seed {args.seed}, into {self.folder}", flush=True)

    def _claim_folder(self) -> None:
        config_file = self.folder / "config.json"
        # a file that a killed process left half-written does not make the folder another's
        if self.folder.is_dir() and any(not path.name.endswith(".tmp") for path in self.folder.iterdir()):
            if not config_file.exists():
                fail(f"--run-dir {self.folder}: neither empty nor a run's folder (it has no config.json)")
            if not self.args.overwrite:
                self._refuse_or_exit(config_file)
            for name in RUN_FILES:
                (self.folder / name).unlink(missing_ok=True)
        self.folder.mkdir(parents=True, exist_ok=True)
        with replacing(config_file) as file:
            file.write(json.dumps(self.config, indent=2).encode() + b"\n")

    def _refuse_or_exit(self, config_file: Path) -> None:
        try:
            there = json.loads(config_file.read_text(encoding="utf-8"))
            there = {"script": there["script"], **there["arguments"]}
        except (ValueError, KeyError, TypeError) as error:
            fail(f"{config_file} is damaged ({error!r}); --overwrite starts over")
        here = json.loads(json.dumps({"script": self.script, **self.config["arguments"]}))
        differences = [f"{name} {there.get(name)} there, {here.get(name)} now"
                       for name in {**there, **here} if there.get(name) != here.get(name)]
        if differences:
            fail(f"{self.folder} holds a run with other arguments: {'; '.join(differences)} "
                 "(--run-dir names another folder, --overwrite starts over)")
        if (self.folder / "evaluation.csv").exists():
            print(f"{self.folder}: this run is finished (--overwrite starts over)")
            sys.exit(0)
        fail(f"{self.folder} holds an unfinished run of this command; --overwrite starts over")

    def log(self, table: str, row: dict) -> None:
        """Append a row to one of the run's tables."""
        self.tables[table].write(row)

    def time(self, phase: str, global_step: int, seconds: float) -> None:
        """Append to timing.csv, the only file that depends on the clock."""
        self.log("timing", {"phase": phase, "global_step": global_step, "seconds": seconds,
                            "elapsed_seconds": time.perf_counter() - self.start})

    def table_sizes(self) -> dict[str, int]:
        """Bytes written to each table so far, for a checkpoint."""
        return {name: table.file.tell() for name, table in self.tables.items() if name != "timing"}

    def finish(self, evaluation: pd.DataFrame, years: pd.DataFrame | None) -> None:
        """Write the evaluation and the picture, print the table, and so declare the run finished."""
        if years is not None:
            with replacing(self.folder / "evaluation_years.csv") as file:
                years.to_csv(file, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
        with replacing(self.folder / "summary.png") as file:
            title = f"{self.script}, {self.args.env_id}, seed {self.args.seed}"
            draw_summary(file, title, evaluation, years, self.folder / "episodes.csv")
        with replacing(self.folder / "evaluation.csv") as file:
            evaluation.to_csv(file, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
        for table in self.tables.values():
            table.file.close()
        print_table(evaluation)
        print(f"{self.folder}: finished in {time.perf_counter() - self.start:.0f} s")


def describe(item) -> str:
    """name=value of an argument, for the name of a folder."""
    name, value = item
    return f"{name}={','.join(f'{v:g}' for v in value) if isinstance(value, tuple) else value}"


def not_default(args) -> dict:
    """The arguments that make this another experiment than the script's default of the same environment."""
    given = {name: getattr(args, name) for name in ("env_id", "mode", "vectorization") if hasattr(args, name)}
    default = type(args)(**given)
    resolve(default)
    changed = {name: value for name, value in vars(args).items()
               if name not in ("seed", "run_dir", "overwrite") and value != getattr(default, name)}
    if given.get("vectorization", "async") != "async":
        changed["vectorization"] = args.vectorization
    return changed


def versions() -> dict:
    """Versions of Python and of the packages that the numbers depend on."""
    packages = ("numpy", "numba", "gymnasium", "mo-gymnasium", "torch", "pandas", "matplotlib", "moocore")
    found = {name: importlib.metadata.version(name) for name in packages}
    return {"python": platform.python_version(), **found}


def commit() -> str | None:
    """The git commit of this checkout; None outside a checkout."""
    root = Path(__file__).parents[1]
    if not (root / ".git").exists():
        return None
    try:
        head = subprocess.run(["git", "-C", root, "rev-parse", "HEAD"], capture_output=True, text=True)
    except FileNotFoundError:
        return None
    return head.stdout.strip() if head.returncode == 0 else None
