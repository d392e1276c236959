"""Trains a script under every combination of settings and seeds, on this machine or on a Ray cluster; one table of all.

    python analysis/sweep.py cleanrl_style/ppo_group.py --seeds 1-10 --grid learning_rate=1e-4,3e-4
    python analysis/sweep.py ... --address auto          on the Ray cluster that this machine belongs to
    python analysis/sweep.py ... --part 3/10             every tenth run from the third on (analysis/slurm_array.sh)

One process a core. A finished run is not started again; one that is killed, with its worker, node or this command, goes
on from its checkpoint. When all are finished, a row a run is in `--output`, and a row a setting is printed.
"""

import dataclasses
import itertools
import json
import os
import re
import signal
import socket
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cleanrl_style.flags import LIMITS, require

require("tyro")

import numpy as np
import pandas as pd
import tyro

from analysis import archive, commands, paths, runs
from analysis.tables.common import over_seeds, readable
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts
from cleanrl_style.protocol.agents import load_script
from cleanrl_style.protocol.arguments import FREE_ARGUMENTS
from cleanrl_style.protocol.run_folder import differences
from sim.block import LANES, lanes_for
from sim.executor import HERE, RAY_HERE, NoCluster, check_address, default_address

VALIDATED = "validation_gain"
OURS = ("seed", "run_dir", "overwrite")  # arguments of a script that are no setting


@dataclass
class Args:
    """Trains a script under every combination of settings and seeds, and makes one table of all runs."""

    script: Annotated[Path, tyro.conf.Positional]
    """script to train: one of cleanrl_style/, or a copy of one"""
    seeds: str = "1-5"
    """training seeds, such as 1-10 or 1,3,7-9"""
    grid: tuple[str, ...] = ()
    """settings, flag=value or flag=value,value; of a flag that takes several numbers "flag=1 0.5,1 1" """
    address: str = dataclasses.field(default_factory=default_address)
    """where: "local", Ray on this machine; "auto" or host:port, a Ray cluster that is there; "none", without Ray"""
    workers: int | None = None
    """runs at a time on this machine (None: one a core)"""
    part: str = "1/1"
    """k/n: every nth run from the kth on, for job arrays"""
    runs_dir: Path = paths.runs()
    """folder of the runs; of a cluster, one that all its nodes see"""
    output: Path = paths.runs() / "sweep.csv"
    """table of the runs"""
    list: bool = False
    """print the commands and stop"""


@dataclass(frozen=True)
class Run:
    """A run of the sweep: its settings as they were given, its seed, its folder and what makes it."""

    settings: dict[str, str]
    seed: int
    folder: Path
    command: commands.Command
    lanes: set[int]  # of the kernels that it needs on a core
    config: dict  # its script and arguments, as in config.json

    @property
    def finished(self) -> bool:
        """Whether it need not be run; exits where its folder holds a run of other arguments."""
        if not runs.is_finished(self.folder):
            return False
        try:
            config = json.loads((self.folder / "config.json").read_text(encoding="utf-8"))
            there = {"script": config["script"], **config["arguments"]}
        except (OSError, ValueError, KeyError, TypeError) as error:
            protocol.fail(f"{self.folder}: config.json is damaged ({error!r})")
        here = json.loads(json.dumps(self.config, default=str))
        known = {name: there[name] for name in here if name in there}  # a script may have got more flags since
        if changed := differences(known, {name: here[name] for name in known}):
            protocol.fail(
                f"{self.folder} holds a run with other arguments: {changed} (--runs-dir names another folder)"
            )
        return True


def numbers(text: str) -> list[int]:
    """1-3,7 as 1, 2, 3, 7."""
    found = []
    for part in text.split(","):
        match = re.fullmatch(r"([0-9]+)(?:-([0-9]+))?", part)
        if match is None:
            protocol.fail(f"--seeds {text}: numbers and ranges are allowed, such as 1-10 or 1,3,7-9")
        low, high = int(match[1]), int(match[2] or match[1])
        if low > high:
            protocol.fail(f"--seeds {text}: {part} is allowed as {high}-{low}")
        if high > LIMITS["seed"][1]:
            protocol.fail(f"--seeds {text}: at most {LIMITS['seed'][1]} is allowed")
        found += range(low, high + 1)
    if not found or len(set(found)) < len(found):
        protocol.fail(f"--seeds {text}: at least one, and each once, is allowed")
    return found


def arguments_of(script: Path) -> type:
    """The class `Args` of a script."""
    if not script.is_file() or script.suffix != ".py":
        protocol.fail(f"{script}: no script there, a file that ends in .py")
    try:
        module = load_script(script.stem, script)
    except ValueError as error:
        protocol.fail(str(error))
    if not hasattr(module, "Args"):
        protocol.fail(f"{script}: no class Args, which the arguments of a training script are")
    return module.Args


def settings_of(grid: tuple[str, ...], fields: dict[str, dataclasses.Field]) -> list[dict[str, str]]:
    """Every combination of the grid's settings, the last varying first."""
    axes = {}
    for axis in grid:
        name, equals, values = axis.partition("=")
        name = name.removeprefix("--").replace("-", "_")
        if name not in fields or name in OURS:
            allowed = ", ".join(field for field in fields if field not in OURS)
            protocol.fail(f"--grid {axis}: unknown flag {name!r}; allowed: {allowed}")
        if not equals or not all(values.split(",")) or name in axes:
            protocol.fail(f"--grid {axis}: each flag once, as flag=value or flag=value,value, is allowed")
        axes[name] = values.split(",")
    return [dict(zip(axes, chosen, strict=True)) for chosen in itertools.product(*axes.values())]


def words_of(settings: dict[str, str], fields: dict[str, dataclasses.Field]) -> list[str]:
    """Settings as on the command line."""
    words = []
    for name, value in settings.items():
        flag = name.replace("_", "-")
        if hidden := next((word for word in value.split() if word.startswith("--")), None):
            protocol.fail(f"--grid {name}={value}: values are allowed, no other flag such as {hidden}")
        if fields[name].type is bool and value.lower() in ("true", "false"):
            words.append(f"--{flag}" if value.lower() == "true" else f"--no-{flag}")
        else:
            words += [f"--{flag}", *value.split()]
    return words


def all_runs(args: Args) -> list[Run]:
    """The sweep's runs, a seed of all settings before the next; a bad setting ends the script with one line."""
    arguments = arguments_of(args.script)
    fields = {field.name: field for field in dataclasses.fields(arguments)}
    found = []
    for seed, settings in itertools.product(numbers(args.seeds), settings_of(args.grid, fields)):
        words = ["--seed", str(seed), *words_of(settings, fields)]
        given, sys.argv = sys.argv, [str(args.script), *words]
        try:
            one = protocol.parse(arguments)
        finally:
            sys.argv = given
        task = protocol.make_task(one)
        config = {"script": args.script.stem, "arguments": vars(one), "not_default": protocol.not_default(one)}
        folder = archive.folder_of(config, args.runs_dir.resolve())
        log = args.runs_dir / "logs" / f"{'-'.join(folder.relative_to(args.runs_dir.resolve()).parts)}.log"
        command = commands.Command(
            (str(args.script.resolve()), *words, "--run-dir", str(folder)), log, getattr(one, "total_timesteps", 0)
        )
        lanes = {lanes_for(getattr(one, "num_envs", 1), 1), LANES} if task.boreal else set()
        found.append(Run(settings, seed, folder, command, lanes, {"script": args.script.stem, **arguments_there(one)}))
    if len({run.folder for run in found}) < len(found):
        protocol.fail("--grid: two of its combinations are the same run")
    return found


def arguments_there(args) -> dict:
    """A script's arguments as its run's config.json has them."""
    return {name: value for name, value in vars(args).items() if name not in FREE_ARGUMENTS}


def part_of(found: list[Run], part: str) -> list[Run]:
    """Every nth run from the kth on, for "k/n"."""
    match = re.fullmatch(r"([0-9]+)/([0-9]+)", part)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        protocol.fail(f"--part {part}: k/n with k from 1 to n is allowed")
    return found[int(match[1]) - 1 :: int(match[2])]


def numbers_of(run: Run) -> dict[str, float]:
    """What it gained on validation sites at its end (NaN of a training too short to have been played there), and mean
    returns over the evaluation's weights and episodes, the scalarised one first."""
    try:
        read = runs.read_run(run.folder)
    except ValueError as error:
        protocol.fail(f"{run.folder}: {error}; without the folder it is run again")
    columns = ["scalarized_return", *fronts.return_columns(fronts.objectives_of(read.evaluation.columns))]
    course = read.tables.get("validation")
    last = np.nan if course is None else course[course.global_step == course.global_step.max()].scalarized_gain.mean()
    return {VALIDATED: last, **read.evaluation[columns].mean()}


def table_of(found: list[Run]) -> pd.DataFrame:
    """A row a run: settings, seed, gain on validation sites, returns."""
    return pd.DataFrame([{**run.settings, "seed": run.seed, **numbers_of(run)} for run in found])


def summary(table: pd.DataFrame, settings: list[str]) -> pd.DataFrame:
    """A row a setting as text: interquartile means over its seeds, with 95 % intervals.

    The best on validation sites first: results are of the test sites, and nothing is chosen on them. In the grid's
    order if trainings were too short for validation.
    """
    validated = table[VALIDATED].notna().all()
    values = [name for name in table if name not in (*settings, "seed", *([] if validated else [VALIDATED]))]
    rows = []
    for key, group in table.groupby(settings, sort=False) if settings else [((), table)]:
        rows.append({**dict(zip(settings, key, strict=True)), "seeds": len(group), **over_seeds(group[values])})
    best = pd.DataFrame(rows)
    if validated:
        best = best.sort_values(VALIDATED, ascending=False, kind="stable")
    best["seeds"] = best.seeds.astype(str)
    return readable(best, {name: name for name in (*settings, "seeds", *values)})


def main(args: Args) -> None:
    """Run what is not finished, and make the table when all is."""
    found = all_runs(args)
    mine = part_of(found, args.part)
    paths.make_file_writable("--output", args.output)
    paths.make_writable("--runs-dir", args.runs_dir)
    try:
        check_address(args.address)
    except NoCluster as error:
        protocol.fail(f"--{error}")
    if args.list:
        print("\n".join(str(run.command) for run in mine))
        return
    waiting = [run for run in mine if not run.finished]
    where = {HERE: "processes of this machine", RAY_HERE: "Ray on this machine"}.get(
        args.address, f"the Ray cluster at {args.address}"
    )
    print(f"{len(mine)} runs, {len(mine) - len(waiting)} of them finished; the others by {where}", flush=True)
    if waiting:
        if lanes := set().union(*(run.lanes for run in waiting)):
            protocol.compile_physics(sorted(lanes))
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            words = [run.command for run in waiting]
            failed = commands.run_all(words, len(mine), address=args.address, workers=args.workers)
        except KeyboardInterrupt:
            sys.exit("\nstopped; the same command goes on from here")
        except NoCluster as error:
            protocol.fail(f"--{error}")
        if failed:
            sys.exit("failed, try the same command again:\n" + "\n".join(f"  {one}" for one in failed))
    unfinished = sum(not run.finished for run in found)
    if unfinished:
        print(f"{unfinished} runs of other parts are not finished; the table comes when they are")
        return
    table = table_of(found)
    apart = args.output.with_name(f"{socket.gethostname()}-{os.getpid()}-{args.output.name}")  # the parts end together
    with protocol.replacing(apart) as file:
        table.to_csv(file, index=False, float_format=protocol.FLOAT_FORMAT, lineterminator="\n")
    os.replace(apart, args.output)
    print(summary(table, list(found[0].settings)).to_string(index=False))
    print(f"wrote {args.output}")


if __name__ == "__main__":
    main(protocol.parse(Args))
