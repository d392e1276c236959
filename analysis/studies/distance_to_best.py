"""How near each method comes to the best known plans of the twelve sites of analysis/studies/fronts.py, site by site.

    python analysis/studies/distance_to_best.py [--runs-dir runs]

Trained agents (finished runs with their policy.pt) and fixed strategies play the sites, weathers and first stands on
which the plans of results/fronts are reported; what counts are gains over zero change on the same site and weather.
The plans were sought for their site alone but know no weather and do not look at the stand; an agent of all sites has
to know the site from its observation. Leaves results/studies/distance_to_best.csv, to which each call adds the runs
that it does not have: most agents are in no archive, the table is.
"""

import hashlib
import importlib
import json
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import experiments, methods, metrics, paths, runs, stored
from analysis.studies import fronts, open_loop
from analysis.studies.open_loop import GAINS, RETURNS, with_gains
from cleanrl_style import protocol
from cleanrl_style.protocol import evaluation

FRONTS_DIR = paths.results() / "fronts"
WEIGHTS = experiments.WEIGHTS
BEST_OF_SITE, BEST_OF_ALL = "best constant plan of the site", "best constant plan of all sites"
FIXED = "sampled"  # policy of what has but one
WITHOUT_SITE = tuple(group for group in boreal_env.OBSERVATION_GROUPS if group != "site")

#: What tells agents apart; `trained_on` is the seed of the one site that an agent was trained on, `trained_for` the
#: one carbon weight, both empty for an agent of all. `run` is a hash of its config.json.
AGENT = ["method", "environment", "setting", "seed", "trained_on", "trained_for"]
KEY = [*AGENT, "run", "site", "policy", "weight"]
PLAYED = [*GAINS, "scalarized_gain", "scalarized_gain_error"]
JUDGED = ["best_scalarized_gain", "best_scalarized_gain_error", "share", "hypervolume_share"]
TEXT = ("setting", "trained_on", "trained_for", "run", "environment", "seed")


@dataclass
class Args:
    """Compares agents and fixed strategies with the best known plans of each site."""

    runs_dir: Path | None = None
    """folder that holds runs with agents, at any depth (None: runs, or runs/quick)"""
    overwrite: bool = False
    """evaluate the runs found again, though the table has them; start over if the physics is another"""
    quick: bool = False
    """one site, 2 weathers, 3 weights, one agent of a kind; into results/quick/studies"""


# ------------------------------------------------------------------------------------- the best known plans


def quick_plans(site_seed: int) -> dict[int, pd.DataFrame]:
    """The same as `read_plans` for one site, from a search that only shows that everything works."""
    return {site_seed: with_gains(fronts.study(site_seed, fronts.QUICK, 1, fronts.YEARS))}


def read_plans(folder: Path, physics: str) -> dict[int, pd.DataFrame]:
    """Site's seed -> its plans' gains, a row a plan and weather: kind, actions, weather, RETURNS, GAINS.

    Exits if the tables are not there or not of this physics.
    """
    plans = {}
    for path in sorted(folder.glob("*-all-on.csv")):
        made_by = stored.settings_of(path)
        site = made_by["case"][0]
        if made_by["physics"] != physics:
            sys.exit(f"error: {path} is of another physics; `python analysis/studies/fronts.py` makes it anew")
        plans[site] = with_gains(stored.read(path, text=("actions",)))
    if not plans:
        sys.exit(f"error: no fronts in {folder}; `python analysis/studies/fronts.py` makes them")
    return plans


def gains_of(plans: pd.DataFrame) -> np.ndarray:
    """Gains of a site's plans, found and constant, (plans, weathers, 2)."""
    ordered = plans.sort_values(["kind", "actions", "weather"])[GAINS].to_numpy()
    return ordered.reshape(-1, plans.weather.nunique(), 2)


def best_at(gains: np.ndarray, weight: float) -> dict:
    """The best mean scalarised gain of plans (plans, weathers, 2), and its standard error over the weathers."""
    scalarized = protocol.scalarize(gains, metrics.pair(weight))
    best = scalarized[scalarized.mean(axis=1).argmax()]
    return {"best_scalarized_gain": best.mean(), "best_scalarized_gain_error": best.std(ddof=1) / np.sqrt(len(best))}


def hypervolume_share(points: np.ndarray, plans: np.ndarray) -> float:
    """Hypervolume of mean gains (n, 2) in that of a site's plans (plans, 2).

    Counted from zero change, or from the worst gain of the plans' front where that is less.
    """
    reference = np.minimum(metrics.nondominated(plans).min(axis=0), 0.0)
    return metrics.hypervolume(points, reference) / metrics.hypervolume(plans, reference)


def constant_plans(plans: dict[int, pd.DataFrame], weights) -> pd.DataFrame:
    """At each weight the constant plan that is best on a site, and the one that is best on average over the sites."""
    means = pd.concat(
        {site: table[table.kind == "constant"].groupby("actions")[GAINS].mean() for site, table in plans.items()},
        names=["site"],
    )
    rows = []
    for weight in weights:
        scalarized = pd.Series(protocol.scalarize(means[GAINS].to_numpy(), metrics.pair(weight)), means.index)
        scalarized = scalarized.unstack("actions")
        for method, chosen in (
            (BEST_OF_SITE, scalarized.idxmax(axis=1)),
            (BEST_OF_ALL, dict.fromkeys(plans, scalarized.mean().idxmax())),
        ):
            for site, table in plans.items():
                plan = table[(table.kind == "constant") & (table.actions == chosen[site])]
                gains = plan.sort_values("weather")[GAINS].to_numpy()
                where = {"method": method, "site": site, "policy": FIXED, "weight": weight}
                rows.append(where | means_of(gains, weight))
    return pd.DataFrame(rows)


# ------------------------------------------------------------------------------------------ playing the sites


class OnSites(boreal_env.BorealVectorEnv):
    """The vector environment on given sites and weathers, which begin as the episodes of `open_loop.play` do."""

    def __init__(self, cases: list[tuple[int, int]], **kwargs):
        """cases : for each stand the site's seed and the number of the weather."""
        super().__init__(len(cases), **kwargs)
        self.sites = [sim.sample_site(site) for site, _ in cases]
        self.seeds = [open_loop.seeds(*case) for case in cases]

    def reset(self, *, seed=None, options=None):
        """Start the episodes; seed : for what the environment draws, which is then replaced."""
        super().reset(seed=seed, options={**options, "site": self.sites})
        everyone = np.arange(self.num_envs)
        self._episodes.stands.start(everyone, self.sites, self.seeds)
        self._episodes.observe_start(everyone)
        return self._episodes.observations(), {}


def play(policy, kwargs: dict, sites: list[int], weathers: list[int], weights, greedy: bool, played) -> np.ndarray:
    """Returns of a policy (see `evaluation.evaluate`), (weights, sites, weathers, 2).

    kwargs : of the environment; played : called with the number of episodes just played.
    """
    task = protocol.Task.of(experiments.GENERALIST, **kwargs)
    cases = [(weight, site, weather) for weight in weights for site in sites for weather in weathers]
    returns = []
    for first in range(0, len(cases), evaluation.CHUNK):
        preferences, *where = zip(*cases[first : first + evaluation.CHUNK], strict=True)
        envs = OnSites(list(zip(*where, strict=True)), **kwargs)
        # the policy's dice: the same for every weight and method, another stream for each site and weather
        seeds = [1000 * (site - open_loop.FIRST_SITE_SEED) + weather for site, weather in zip(*where, strict=True)]
        weights_of_each = metrics.pair(np.array(preferences, dtype=float))
        returns.append(evaluation.play(task, envs, policy, weights_of_each, seeds, greedy)[0])
        played(len(seeds))
    return np.concatenate(returns).reshape(len(weights), len(sites), len(weathers), 2)


def means_of(gains: np.ndarray, weight: float) -> dict:
    """Mean gains over the weathers, gains (weathers, 2), and the standard error of the scalarised one."""
    scalarized = protocol.scalarize(gains, metrics.pair(weight))
    error = scalarized.std(ddof=1) / np.sqrt(len(scalarized))
    # rounded so that a table that is read and written again keeps its digits
    return dict(zip(PLAYED, np.round([*gains.mean(axis=0), scalarized.mean(), error], 6), strict=True))


def judge(policy, kwargs: dict, plans: dict[int, pd.DataFrame], weights, learnt: bool, played) -> pd.DataFrame:
    """Mean gains of a policy, a row a site, kind of policy and weight.

    One that is not learnt does not look at the preference and has one kind: it plays once for all weights.
    """
    sites = list(plans)
    weathers = sorted(set(plans[sites[0]].weather))
    rows = []
    for kind in protocol.POLICIES if learnt else (FIXED,):
        returns = play(policy, kwargs, sites, weathers, weights if learnt else (0.0,), kind == "greedy", played)
        returns = np.broadcast_to(returns, (len(weights), *returns.shape[1:]))
        for k, site in enumerate(sites):
            first = plans[site].drop_duplicates("weather").set_index("weather").loc[weathers]
            zero = first[RETURNS].to_numpy() - first[GAINS].to_numpy()
            rows += [
                {"site": site, "policy": kind, "weight": weight, **means_of(returns[j, k] - zero, weight)}
                for j, weight in enumerate(weights)
            ]
    return pd.DataFrame(rows)


def strategy(name: str):
    """A fixed strategy as a policy of the evaluation."""
    module = importlib.import_module(f"baselines_heuristic.{name}")

    def probabilities(observations, masks, accrued_returns):
        chosen = module.policy(observations, masks)
        return np.eye(sim.management.NUM_ACTIONS)[chosen] if chosen.ndim == 1 else chosen

    return probabilities


def agent_policy(folder: Path, config: dict):
    """A run's agent as a policy of the evaluation, and arguments of the environment that give what it observes."""
    kwargs = {"observation_groups": WITHOUT_SITE} if config["arguments"].get("hide_site", False) else {}
    return protocol.load_policy(folder), kwargs


# ------------------------------------------------------------------------------------------------- the table


def name_of(config: dict) -> dict:
    """The columns AGENT and run of a run's config.json."""
    arguments = config["arguments"]
    text = json.dumps(config, sort_keys=True)
    names = (
        config["script"],
        arguments["env_id"],
        runs.setting(config["not_default"], arguments["mode"]),
        arguments["seed"],
        arguments["site_seed"],
        arguments.get("preference"),
    )
    as_text = ["" if value is None else str(value) for value in names]
    return dict(zip(AGENT, as_text, strict=True)) | {"run": hashlib.sha256(text.encode()).hexdigest()[:12]}


@cache
def is_of_many_sites(env_id: str) -> bool:
    """Whether an environment is ours, generalist, and pays carbon and thaw."""
    try:
        task = protocol.Task.of(env_id)
    except (gym.error.Error, ModuleNotFoundError, ValueError):
        return False
    return task.boreal and task.mode == "generalist" and list(task.objectives) == list(open_loop.OBJECTIVES)


def agents(folder: Path, sites) -> list[tuple[Path, dict]]:
    """Finished runs with an agent below a folder, of scripts that are here.

    Agents of one site count if it is one of the sites; those of the site-specific mode do not: they know one weather
    and no temperature noise.
    """
    found = []
    for path in runs.run_folders(folder):
        if not (path / "policy.pt").exists() or not runs.is_finished(path):
            continue
        try:
            config = runs.read_config(path)
        except ValueError as error:
            print(f"left out: {path}: {error}", file=sys.stderr)
            continue
        arguments = config["arguments"]
        here = (experiments.ROOT / "cleanrl_style" / f"{config['script']}.py").exists()
        if here and arguments["site_seed"] in (None, *sites) and is_of_many_sites(arguments["env_id"]):
            found.append((path, config))
    return found


def without(table: pd.DataFrame, name: dict) -> pd.DataFrame:
    """The table without the rows of an agent, whichever run they are of."""
    return table[~(table[AGENT] == [name[column] for column in AGENT]).all(axis=1)]


def has(table: pd.DataFrame, name: dict) -> bool:
    """Whether the table has the rows of an agent's very run."""
    return bool((table[[*AGENT, "run"]] == [name[column] for column in (*AGENT, "run")]).all(axis=1).any())


def is_known(best):
    """Whether a best gain, or each of a column, is above twice its standard error."""
    return best.best_scalarized_gain > 2 * best.best_scalarized_gain_error


def complete(table: pd.DataFrame, plans: dict[int, pd.DataFrame]) -> pd.DataFrame:
    """The table in order, with JUDGED: each gain against the best known plans of its site.

    share : of the best scalarised gain; NaN where that is not above twice its standard error, as where thaw is clipped
    whatever is done. hypervolume_share : of all weights' gains together; NaN for an agent of one weight, and on a site
    where either objective alone has no share.
    """
    gains = {site: gains_of(one) for site, one in plans.items()}
    table = table[[*KEY, *PLAYED]].astype({"site": int, "weight": float, **dict.fromkeys(PLAYED, float)})
    table = table.sort_values(KEY, kind="stable", ignore_index=True)
    best = [best_at(gains[row.site], row.weight) for row in table.itertuples()]
    table = pd.concat([table, pd.DataFrame(best)], axis=1)
    table["share"] = (table.scalarized_gain / table.best_scalarized_gain).where(is_known(table))
    table["hypervolume_share"] = np.nan
    for (*_, site, _), rows in table.groupby([*AGENT, "run", "site", "policy"], sort=False):
        ends_known = all(is_known(SimpleNamespace(**best_at(gains[site], weight))) for weight in (0.0, 1.0))
        if rows.trained_for.iloc[0] == "" and ends_known:
            share = hypervolume_share(rows[GAINS].to_numpy(), gains[site].mean(axis=1))
            table.loc[rows.index, "hypervolume_share"] = share
    return table[[*KEY, *PLAYED, *JUDGED]]


def main(args: Args) -> None:
    """Evaluate what the table lacks, and write it after each agent."""
    physics = open_loop.fingerprint()
    plans = quick_plans(experiments.FRONT_SITES[0]) if args.quick else read_plans(FRONTS_DIR, physics)
    weights = experiments.QUICK_EVALUATION["eval_weights"] if args.quick else WEIGHTS
    weathers = sorted(set(next(iter(plans.values())).weather))
    settings = {"sites": list(plans), "weathers": weathers, "weights": weights, "physics": physics}
    path = paths.studies(args.quick) / "distance_to_best.csv"
    table = pd.DataFrame(columns=[*KEY, *PLAYED])
    if stored.is_finished(path, settings):
        table = stored.read(path, text=TEXT)
    elif path.exists() and not args.overwrite:
        sys.exit(f"error: {path} is of other sites, weathers or another physics; --overwrite starts over")

    constant = constant_plans(plans, weights).assign(run="")
    table = table[~table.method.isin((BEST_OF_SITE, BEST_OF_ALL))]
    table = pd.concat([table, constant.assign(**dict.fromkeys(AGENT[1:], ""))], ignore_index=True)
    todo = [
        (dict.fromkeys([*AGENT, "run"], "") | {"method": name}, (strategy(name), {}), weights)
        for name in methods.STRATEGIES
    ]
    for folder, config in agents(args.runs_dir or paths.runs(args.quick), plans):
        own = (config["arguments"]["preference"],) if "preference" in config["arguments"] else weights
        todo.append((name_of(config), (folder, config), own))
    if args.quick:
        kinds = {tuple(one[0][column] for column in ("method", "trained_on", "trained_for")): one for one in todo[::-1]}
        todo = list(kinds.values())[::-1]
    todo = [one for one in todo if args.overwrite or not has(table, one[0])]
    print(f"{len(todo)} agents and strategies to evaluate, for {path}", flush=True)

    def where(name):
        return {site: one for site, one in plans.items() if name["trained_on"] in ("", str(site))}

    # a learnt policy plays every weight, greedy and sampled
    episodes = [len(where(name)) * len(weathers) * (2 * len(own) if name["run"] else 1) for name, _, own in todo]
    progress = protocol.Progress("distance", sum(episodes), "episodes")
    done = 0

    def played(number):
        nonlocal done
        done += number
        progress.show(done)

    for name, source, own in todo:
        policy, kwargs = agent_policy(*source) if name["run"] else source
        judged = judge(policy, kwargs, where(name), own, bool(name["run"]), played)
        table = pd.concat([without(table, name), judged.assign(**name)], ignore_index=True)
        stored.write(path, complete(table, plans), settings)
    table = complete(table, plans)
    stored.write(path, table, settings)
    report(table)
    print(f"\nwrote {path}")


def report(table: pd.DataFrame) -> None:
    """Print shares of the best known gain: means over sites of both, before the division."""
    sums = table.groupby([*AGENT, "policy", "weight"])[["scalarized_gain", "best_scalarized_gain"]].sum()
    shares = (sums.scalarized_gain / sums.best_scalarized_gain).unstack("weight")
    shares["hypervolume"] = table.groupby([*AGENT, "policy"]).hypervolume_share.mean()
    print("\nshare of the best known scalarised gain by carbon weight, and of the hypervolume, %")
    for key, row in shares.iterrows():
        print(f"{' '.join(part for part in key if part):110s} {' '.join(f'{100 * value:6.0f}' for value in row)}")


if __name__ == "__main__":
    main(protocol.parse(Args))
