"""Finds the best known plans of the first test sites, which ship with the code: fronts, and what is best there.

    python analysis/best_plans.py            # an hour of processor time; a stopped search goes on with the next site

A plan is an action for each ten years, carried out where it can be in full. It is sought for one published episode: its
site, first stand, weather and dice, which no policy knows beforehand. So a policy is not expected to reach what is
found, and plans that look at the stand may pass it. The search begins with the constant plans. Then, at every weight of
the evaluation, the best plan so far is changed in a block or two, or takes a stretch of another weight's best.

How far it has converged is part of the result: what the second half of the budget still gains at the weights. Leaves
results/studies/best_plans/<environment>.csv, by which `analysis/generalisation.py` and the table `best_known` judge
runs, and ships the plans of the fronts as sim/task/best_plans/<environment>.csv.gz, which
`env.unwrapped.pareto_front(gamma)` plays.
"""

import contextlib
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import experiments, metrics, paths, stored
from cleanrl_style import protocol
from cleanrl_style.protocol import arguments, fronts, reference, sites
from cleanrl_style.protocol.evaluation import lanes_of
from sim.task.fronts import FOLDER, play_plans

BLOCKS = 5
ACTIONS = tuple(int(plan) for plan in reference.PLANS)  # all but those that do nothing, too
EACH = 6  # new plans of a weight in a generation: of five weights nearly two full blocks of 16 stands


@dataclass
class Args:
    """Finds the best known plans of test sites."""

    env_id: tuple[str, ...] = (experiments.GENERALIST, experiments.BALANCED)
    """environments, each with sites that are drawn"""
    sites: int = 50
    """the first of the test sites, of which every beginning is balanced"""
    budget: int = 600
    """episodes of a site's search"""
    seed: int = 1
    """of the search"""
    folder: Path | None = None
    """folder of the plans as they ship (None: sim/task/best_plans; of another search or folder, beside the tables)"""
    output_dir: Path | None = None
    """folder of the tables (None: results/studies/best_plans)"""


# ------------------------------------------------------------------------------------------------------ the search


def unchanging(action: str) -> str:
    """The plan that does the same in every block, as the tables write it."""
    return " ".join([action] * BLOCKS)


def first_plans() -> list[tuple]:
    """The constant plans, and a forester's: plant first, then let grow; one kind of tree first, then another."""
    constant = [(action,) * BLOCKS for action in ACTIONS]
    planted = [(action,) * n + (ACTIONS[0],) * (BLOCKS - n) for n in (1, 2, 3) for action in (20, 22, 24)]
    return [*constant, *planted, (20, 20, 24, 24, 24), (24, 24, 20, 20, 20)]


def changed(plan: tuple, others: list[tuple], generator: np.random.Generator) -> tuple:
    """A plan after a change or two: another action in a block, a neighbouring block's, a stretch of another plan's."""
    new = list(plan)
    for kind in generator.random(generator.integers(1, 3)):
        if kind < 0.65:
            new[generator.integers(BLOCKS)] = int(generator.choice(ACTIONS))
        elif kind < 0.8:
            first = int(generator.integers(BLOCKS - 1))
            to, of = generator.permutation([first, first + 1])
            new[to] = new[of]
        else:
            first, last = np.sort(generator.integers(0, BLOCKS + 1, 2))
            new[first:last] = others[generator.integers(len(others))][first:last]
    return tuple(new)


def search(returns_of, weights: np.ndarray, budget: int, seed: int) -> dict[tuple, np.ndarray]:
    """Plan -> returns (m,) of all plans tried, in order; `budget` of them.

    returns_of : function of plans (n, blocks) that gives returns (n, m); weights : (k, m).
    """
    generator, tried = np.random.default_rng(seed), {}
    new = first_plans()[:budget]
    while new:
        tried |= dict(zip(new, returns_of(np.array(new)), strict=True))
        plans, returns = list(tried), np.array(list(tried.values()))
        best = [plans[k] for k in (weights @ returns.T).argmax(axis=1)]
        new = []
        for k, plan in enumerate(best):
            for _ in range(20 * EACH):  # a plan whose neighbours are all known gives fewer
                if len(new) == min(EACH * (k + 1), budget - len(tried)):
                    break
                candidate = changed(plan, best, generator)
                if candidate not in tried and candidate not in new:
                    new.append(candidate)
    return tried


def study(task: protocol.Task, seed: int, budget: int, search_seed: int, played=None) -> pd.DataFrame:
    """The plans of a site that no other dominates, of the whole search or of its first half, and the constant ones.

    Columns: seed, plan, found (its number in the search, from 1), returns, and whether it is of the front, of the front
    of the first half, and constant.
    """

    def returns_of(plans):
        with contextlib.closing(task.make_lockstep(len(plans))) as envs:
            returns = play_plans(envs, seed, plans, task.years).sum(axis=1)
        if played:
            played(len(plans))
        return returns

    weights = weights_of(task)
    tried = search(returns_of, weights, budget, search_seed)
    columns = fronts.return_columns(task.objectives)
    table = pd.DataFrame(list(tried.values()), columns=columns)
    table.insert(0, "plan", [" ".join(map(str, plan)) for plan in tried])
    table.insert(0, "seed", seed)
    table.insert(2, "found", np.arange(1, len(table) + 1))
    half = table[table.found <= budget // 2]
    for name, of in (("front", table), ("half", half)):
        table[name] = table.index.isin(of.index[fronts.is_nondominated(of[columns].to_numpy())])
    table["constant"] = [len(set(plan)) == 1 for plan in tried]
    return table[table.front | table.half | table.constant]


def weights_of(task: protocol.Task) -> np.ndarray:
    """The weights of the task's evaluation, (k, m)."""
    return np.array([task.check_weights(value) for value in fronts.evaluation_weights(task.num_objectives)])


# ------------------------------------------------------------------------------------------------------- all sites


def summary(table: pd.DataFrame, weights: np.ndarray) -> pd.DataFrame:
    """Gains over doing nothing, means over sites, a row a weight: of the constant plan that is best on each site, of
    the best plan of half the search and of the whole; and what the second half added [%]."""
    columns = metrics.return_columns(metrics.objectives_of(table.columns))
    gains = []
    for _, rows in table.groupby("seed"):
        nothing = rows[rows.plan == unchanging(reference.NOTHING)][columns].to_numpy()
        parts = (rows[rows[name]][columns].to_numpy() - nothing for name in ("constant", "half", "front"))
        gains.append([(weights @ part.T).max(axis=1) for part in parts])
    constant, half, whole = np.mean(gains, axis=0)
    rows = pd.DataFrame({"constant": constant, "half": half, "whole": whole}, index=map(tuple, weights))
    rows.loc["mean"] = rows.mean()
    return rows.assign(added_percent=100 * (rows.whole / rows.half - 1))


def ship(table: pd.DataFrame, folder: Path, env_id: str) -> Path:
    """Write the plans of the fronts, which `pareto_front` plays; the same plans give the same bytes."""
    path = folder / f"{env_id}.csv.gz"
    reference.pack(path, table[table.front][["seed", "plan"]].to_csv(index=False, lineterminator="\n"))
    return path


def main(args: Args) -> None:
    """Search every site that is not finished, and ship the plans of an environment whose sites all are."""
    if args.budget < 2 * len(ACTIONS):
        sys.exit(f"error: --budget {args.budget}: {2 * len(ACTIONS)} or more are allowed")
    tasks = [arguments.ask(env_id) for env_id in args.env_id]
    for task in tasks:
        if not task.boreal or not task.draws_sites:
            sys.exit(f"error: --env-id {task.env_id}: an environment of ours that draws sites is allowed")
    try:
        seeds = sites.evaluation_seeds(tasks[0], args.sites)
    except ValueError as error:
        sys.exit(f"error: --sites: {error}")
    folder = args.output_dir or paths.studies() / "best_plans"
    same_search = (args.budget, args.seed) == (Args.budget, Args.seed)
    ships = same_search and args.sites == Args.sites and args.output_dir is None
    plans_folder = args.folder or (Path("sim", "task", FOLDER) if ships else folder)
    paths.make_writable("--output-dir", folder)
    paths.make_writable("--folder", plans_folder)
    for task in tasks:
        path = folder / f"{task.env_id}{'' if same_search else f'-{args.budget}-{args.seed}'}.csv"
        settings = {"budget": args.budget, "seed": args.seed}
        tables = [stored.read(path, text=("plan",))] if stored.is_finished(path, settings) else []
        there = {seed for table in tables for seed in table.seed}
        todo = [seed for seed in seeds if seed not in there]
        print(f"{task.env_id}: {len(seeds) - len(todo)} of {len(seeds)} sites are in {path}", flush=True)
        protocol.compile_physics(lanes_of(task, len(first_plans())))
        progress = protocol.Progress("best plans", args.budget * len(todo), "episodes")
        for k, seed in enumerate(todo):
            tables.append(study(task, seed, args.budget, args.seed, progress.add))
            stored.write(path, pd.concat(tables), settings)
            progress.done = (k + 1) * args.budget
        table = pd.concat(tables, ignore_index=True)
        table = table[table.seed.isin(seeds)]
        print(summary(table, weights_of(task)).to_string(float_format="%.2f"))
        print(f"wrote {ship(table, plans_folder, task.env_id)}", flush=True)


if __name__ == "__main__":
    main(protocol.parse(Args))
