"""What one can do without looking: returns of constant plans and fixed strategies on an evaluation's episodes.

A constant plan takes one action every year, wherever it can be carried out. The returns on the published sites ship
with the code (analysis/reference_returns.py), under a fingerprint of the physics that they are of. Those of other
episodes, of another environment or another physics are measured when they are first asked for.
"""

import contextlib
import gzip
import hashlib
import io
import json
import os
import zlib
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd

import boreal_env
from cleanrl_style.protocol.compilation import compile_physics
from cleanrl_style.protocol.evaluation import chunks, lanes_of, make_envs, play
from cleanrl_style.protocol.files import replacing
from cleanrl_style.protocol.fronts import return_columns
from cleanrl_style.protocol.progress import Progress
from cleanrl_style.protocol.provenance import physics_hash
from cleanrl_style.protocol.task import Task
from sim.jit import cache_folder
from sim.management import CONIFER_MIXES, DENSITY_CHANGES

NOTHING = str(boreal_env.NO_CHANGE)
PLUS_100 = "22"  # the paper's: half conifers
# All actions but 10, 11, 13 and 14, which do nothing as 12 does.
PLANS = (NOTHING, *(str(action) for action in range(25) if not 10 <= action < 15))
FOLDER = "reference"
FLOAT_FORMAT = "%.6g"


def constant(plans: pd.DataFrame) -> pd.DataFrame:
    """Rows of the constant plans alone."""
    return plans[plans.plan.str.isdigit()]


def title(plan: str) -> str:
    """A constant plan in words."""
    change, mix = DENSITY_CHANGES[int(plan) // 5], CONIFER_MIXES[int(plan) % 5]
    if not change:
        return "nothing"
    return f"{'plant' if change > 0 else 'cut'} {abs(change):.0f} a year, {100 * mix:.0f} % conifers"


def fingerprint(task: Task) -> str:
    """Hash of all that a plan's returns depend on: environment, its arguments, source and tables of the simulator."""
    arguments = {name: value for name, value in task.env_kwargs.items() if name != "observation_groups"}
    of_all = (physics_hash(), task.env_id, sorted(arguments.items()))
    return hashlib.sha256(repr(of_all).encode()).hexdigest()[:16]


# -------------------------------------------------------------------------------------------------- stored returns


def write(path: Path, table: pd.DataFrame, physics: str) -> None:
    """Write returns with the fingerprint of their physics."""
    pack(path, f"# {json.dumps({'physics': physics})}\n" + as_text(table))


def pack(path: Path, text: str) -> None:
    """Write a compressed text; the same text gives the same bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as file, gzip.GzipFile("", "wb", 9, file, mtime=0) as packed:
        packed.write(text.encode())


def read(path) -> tuple[pd.DataFrame, str]:
    """Stored returns, and the fingerprint of their physics."""
    head, _, body = gzip.decompress(path.read_bytes()).decode().partition("\n")
    return parse(body), json.loads(head.removeprefix("# "))["physics"]


def as_text(table: pd.DataFrame) -> str:
    """Returns as CSV, with as many digits as are kept."""
    return table.to_csv(index=False, float_format=FLOAT_FORMAT, lineterminator="\n")


def parse(text: str) -> pd.DataFrame:
    """Returns of their CSV."""
    return pd.read_csv(io.StringIO(text), dtype={"plan": str})


def shipped(env_id: str):
    """The file of an environment's returns on the published sites; it need not exist."""
    return files("cleanrl_style.protocol") / FOLDER / f"{env_id}.csv.gz"


# -------------------------------------------------------------------------------------------- asked for, measured


def reference_returns(task: Task, seeds: list[int]) -> pd.DataFrame | None:
    """Returns of every plan on the episodes with these seeds: plan, seed, a return for each objective.

    plan : the action of a constant plan, or a fixed strategy's name, which the tables that ship have besides.
    None where the environment is not ours: what doing nothing is there is not known.
    """
    if not task.boreal:
        return None
    if task.mode == "site-specific":  # all episodes are one
        table = known_or_measured(task, seeds[:1])
        return pd.concat([table.assign(seed=seed) for seed in seeds], ignore_index=True)
    return known_or_measured(task, seeds)


def known_or_measured(task: Task, seeds: list[int]) -> pd.DataFrame:
    """The returns that ship or that this machine has measured; else they are measured, and said to be."""
    if task.env_id not in boreal_env.REGISTERED or not all(map(is_plain, task.env_kwargs.values())):
        # its source may lie anywhere; the fingerprint does not tell two tables or functions apart
        print(f"constant plans in {task.env_id}, for the score (kept for those of the project alone)")
        return measure(task, seeds)
    physics, file = fingerprint(task), shipped(task.env_id)
    if file.is_file() and not set(task.env_kwargs) - {"observation_groups"}:
        table, its_physics = read(file)
        if its_physics == physics and set(seeds) <= set(table.seed):
            return table[table.seed.isin(seeds)].reset_index(drop=True)
        if its_physics != physics:
            print("the constant plans' returns that ship are of another physics than this")
    name = hashlib.sha256(repr((physics, seeds)).encode()).hexdigest()[:16]
    path = cache_folder().parent / FOLDER / f"{task.env_id}-{name}.csv.gz"
    with contextlib.suppress(OSError, EOFError, ValueError, zlib.error):  # not there, or damaged
        return read(path)[0]
    print(f"constant plans on these {len(seeds)} episodes, which gains are set beside: played once, then kept")
    table = measure(task, seeds)
    try:
        # another process may measure the same meanwhile
        apart = path.with_name(f"{os.getpid()}-{path.name}")
        write(apart, table, physics)
        os.replace(apart, path)
    except OSError as error:
        print(f"not kept: {path} ({error.strerror})")
    return table


def is_plain(value) -> bool:
    """Whether an argument is what its `repr` says: numbers and names, no table, no function and no file."""
    if isinstance(value, dict):
        return all(map(is_plain, value.values()))
    if isinstance(value, (tuple, list)):
        return all(map(is_plain, value))
    if isinstance(value, str):
        return not os.path.isfile(value)
    return value is None or isinstance(value, (bool, int, float))


def measure(task: Task, seeds: list[int]) -> pd.DataFrame:
    """Play every constant plan on the episodes with these seeds."""
    jobs = [(plan, seed) for seed in seeds for plan in PLANS]
    compile_physics(lanes_of(task, len(jobs)))
    progress, returns = Progress("constant plans", len(jobs), "episodes"), []
    for numbers in chunks(len(jobs)):
        chunk = [jobs[number] for number in numbers]
        actions = np.array([int(plan) for plan, _ in chunk])
        weights = np.full((len(chunk), task.num_objectives), 1 / task.num_objectives)

        def policy(observations, masks, accrued_returns, actions=actions):
            return np.eye(25)[boreal_env.where_valid(actions, masks)]

        with contextlib.closing(make_envs(task, len(chunk))) as envs:
            greedy = np.ones(len(chunk), dtype=bool)
            returns.append(play(task, envs, policy, weights, [seed for _, seed in chunk], greedy)[0])
        progress.show(numbers.stop)
    table = pd.DataFrame(jobs, columns=["plan", "seed"])
    table[return_columns(task.objectives)] = np.concatenate(returns)
    return parse(as_text(table))  # the same digits, stored or not
