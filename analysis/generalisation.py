"""How much of the best known front a policy reaches, site by site, inside and outside the range it was trained on.

    python analysis/generalisation.py RUN [RUN ..]                      # outside: four shifts of the test sites
    python analysis/generalisation.py RUN --split validation calmer     # or any splits

A split is the test or validation sites, or the test sites with one property, or two, moved out of the range
that sites are drawn from (`sim/task/shifts.py`); "outside" is all of those. The test sites are always there, to compare
with. A run is a finished one with its policy.pt; on the test sites its own evaluation counts, and an archived run will
do. Printed are, for both policies, the score against the constant plans of the split, two ratios, and how much each
drops outside; the ratios of every site are written. docs/results.md shows those of Group PPO's two that ship.

The ratios are those of Teoh, Varakantham and Vamplew (2025, ICLR, "On generalization across environments in
multi-objective reinforcement learning"): NHGR is the hypervolume of a policy's front over that of the site's best known
front, EUGR the same of the expected utility, each at most 1. Returns are first scaled per site and objective, the
lowest of all fronts of the site to 0 and the highest to 1, and 0 is the reference point. One departure: theirs takes
the expected utility of returns as they are; ours may be negative, where a ratio says nothing, so both take scaled ones.

Best known of a site, on every split, are the constant plans, each played on the site's own episode. The test sites that
`analysis/best_plans.py` has searched have a better front, which then gives rows of their own ("test, best plans").

A table of fronts has a row a point: `site_seed` and a return of each objective (`carbon_return`, ..).
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cleanrl_style.flags import require

require("tyro")

import numpy as np
import pandas as pd
import tyro

from analysis import metrics, paths, runs, stored
from cleanrl_style import protocol
from cleanrl_style.protocol import provenance, reference, sites
from cleanrl_style.protocol.arguments import ask, groups_without_site
from cleanrl_style.protocol.score import Comparison

TEST, OUTSIDE, SEARCHED = "test", "outside", "test, best plans"
RATIOS = ("nhgr", "eugr")


def fronts(evaluation: pd.DataFrame) -> pd.DataFrame:
    """What a policy reaches on each site: mean returns over its episodes there, a row a site and weight.

    evaluation : a row an episode, with `site_seed`, the columns of the weights and the returns.
    """
    objectives = metrics.objectives_of(evaluation.columns)
    missing = [name for name in ("site_seed", *metrics.weight_columns(objectives)) if name not in evaluation]
    if missing:
        raise ValueError(f"evaluation: column {missing[0]} is missing")
    keys = ["site_seed", *metrics.weight_columns(objectives)]
    return evaluation.groupby(keys)[metrics.return_columns(objectives)].mean().reset_index()


def limits(points: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest return of each objective over all fronts of a site, (m,) each."""
    together = np.concatenate(points)
    return together.min(axis=0), together.max(axis=0)


def scaled(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Returns as shares of the limits, in [0, 1]; 1 in an objective in which no front differs from another."""
    span = high - low
    return np.where(span > 0.0, np.clip((points - low) / np.where(span > 0.0, span, 1.0), 0.0, 1.0), 1.0)


def ratios_of_site(points: np.ndarray, best: np.ndarray, low: np.ndarray, high: np.ndarray) -> dict[str, float]:
    """NHGR and EUGR of a policy's points (n, m) against the site's best known front (k, m).

    NaN where that front dominates nothing: it has two ends alone, and no policy does worse than each in any objective.
    """
    ours, known = scaled(points, low, high), scaled(best, low, high)
    volumes = metrics.hypervolume(ours, 0.0), metrics.hypervolume(known, 0.0)
    utilities = metrics.expected_utility(ours), metrics.expected_utility(known)
    return {name: _share(*pair) for name, pair in zip(RATIOS, (volumes, utilities), strict=True)}


def _share(ours: float, known: float) -> float:
    return min(ours / known, 1.0) if known > 0.0 else np.nan


def by_site(table: pd.DataFrame, columns: list[str]) -> dict[int, np.ndarray]:
    """Points (n, m) of each site, by its seed, ascending."""
    ordered = table.sort_values("site_seed", kind="stable")
    seeds, first = np.unique(ordered.site_seed, return_index=True)
    return dict(zip(seeds.tolist(), np.split(ordered[columns].to_numpy(dtype=float), first[1:]), strict=True))


def ratios(policies: Mapping[str, pd.DataFrame], best: pd.DataFrame) -> pd.DataFrame:
    """A row a policy and site, with `policy`, `site_seed` and `RATIOS`.

    policies : name -> fronts; best : the best known fronts. All are of the same objectives and sites; the scale of a
    site is that of all policies and its best known front together, so add all that are compared.
    """
    columns = metrics.return_columns(metrics.objectives_of(best.columns))
    known = by_site(best, columns)
    points: dict[str, dict] = {}
    for name, table in policies.items():
        if not set(columns) <= set(table.columns):
            raise ValueError(f"policy {name}: returns of {', '.join(columns)} are needed")
        points[name] = by_site(table, columns)
        other = sorted(set(points[name]) ^ set(known))
        if other:
            raise ValueError(f"policy {name}: site {other[0]} has not both the policy's and a best known front")
    rows = []
    for seed, front in known.items():
        low, high = limits([front, *(of_sites[seed] for of_sites in points.values())])
        for name, of_sites in points.items():
            rows.append({"policy": name, "site_seed": seed, **ratios_of_site(of_sites[seed], front, low, high)})
    return pd.DataFrame(rows)


def summary(by_split: Mapping[str, pd.DataFrame], inside: str) -> pd.DataFrame:
    """Means over sites of `RATIOS` by policy and split, and the drop from inside to each other split, with 95 % t
    intervals: paired by site, since a shift keeps the sites' seeds. Neither `inside` itself nor a split of other sites
    has one. Sites without a ratio do not count.

    by_split : split -> what `ratios` gave; inside : the split within the sampled range.
    """
    if inside not in by_split:
        raise ValueError(f"split {inside!r}: allowed are {', '.join(by_split)}")
    tables = {split: table.set_index(["policy", "site_seed"]).sort_index() for split, table in by_split.items()}
    rows = []
    for split, table in tables.items():
        paired = table.index.equals(tables[inside].index)
        for policy in table.index.unique("policy"):
            here, there = table.loc[policy], tables[inside].loc[policy]
            row = {"policy": policy, "split": split, "sites": len(here)}
            for name in RATIOS:
                row |= metrics.with_interval(name, here[name].dropna().to_numpy())
                if paired and split != inside:
                    row |= metrics.with_interval(f"{name}_drop", (there[name] - here[name]).dropna().to_numpy())
            rows.append(row)
    return pd.DataFrame(rows)


# ------------------------------------------------------------------------------------------------- runs, on splits


@dataclass
class Args:
    """Evaluates finished runs on other sites, and says how much of the best known fronts they reach."""

    runs: tyro.conf.Positional[tuple[Path, ...]]
    """folders of finished runs, of one environment"""
    split: tuple[str, ...] = (OUTSIDE,)
    """test, validation, a shift such as calmer, or outside: all shifts"""
    episodes: int = 50
    """the first sites of each split"""
    output: Path | None = None
    """table of each policy, split and site (None: runs/generalisation/<environment>.csv, of archived runs
    results/studies/generalisation/<environment>.csv)"""


def task_of(config: dict) -> protocol.Task:
    """The environment of a run, with what its policy observes."""
    arguments = config["arguments"]
    kwargs = {"thaw_formulation": arguments["thaw_formulation"]} if "thaw_formulation" in config["not_default"] else {}
    if arguments.get("hide_site"):
        ask(arguments["env_id"], "environment")  # which registers what a module brings
        kwargs["observation_groups"] = groups_without_site(arguments["env_id"])
    return ask(arguments["env_id"], "environment", **kwargs)


def config_of(folder: Path) -> dict:
    """A run's configuration; ValueError names the folder of what is none."""
    if not (folder / "config.json").is_file():
        raise ValueError(f"{folder}: no folder of a run")
    try:
        return runs.read_config(folder)
    except ValueError as error:
        raise ValueError(f"{folder}: {error}") from error


def splits_of(task: protocol.Task, wanted: Sequence[str]) -> list[str]:
    """The splits that the flags name, the test sites first; ValueError says what is allowed."""
    allowed = (*sites.SPLITS, *task.shifts)
    for name in wanted:
        if name not in (*allowed, OUTSIDE):
            raise ValueError(f"--split {name}: allowed are {', '.join((*allowed, OUTSIDE))}")
    named = [one for name in wanted for one in (task.shifts if name == OUTSIDE else [name])]
    return list(dict.fromkeys([TEST, *named]))


def evaluation_of(folder: Path, config: dict, task: protocol.Task, episodes: int, split: str) -> pd.DataFrame:
    """A run's episodes on a split, both policies: of the test sites what it left, else played."""
    if split == TEST:
        try:
            run = runs.read_run(folder)
        except ValueError as error:
            raise ValueError(f"{folder}: {error}") from error
        if runs.of_another_physics([run]):
            print(f"{folder}: its test sites are of another source of the simulator than this", file=sys.stderr)
        found = run.tables["evaluation"]
        chosen = found[found.seed.isin(sites.evaluation_seeds(task, episodes))]
        if chosen.seed.nunique() < episodes:
            number = chosen.seed.nunique()
            raise ValueError(
                f"--episodes {episodes}: {folder} was evaluated on {number} of the sites; at most that is allowed"
            )
        return chosen
    weights = config["arguments"]["eval_weights"]
    return protocol.evaluate(task, protocol.load_policy(folder), weights, episodes, split=split)[0]


def known_fronts(plans: pd.DataFrame, evaluation: pd.DataFrame) -> pd.DataFrame:
    """Plans' returns on a split's episodes as a table of fronts; evaluation : a policy's on the same episodes."""
    site_of = evaluation.drop_duplicates("seed").set_index("seed").site_seed
    known = plans[plans.seed.isin(site_of.index)]
    return known.assign(site_seed=site_of.loc[known.seed].to_numpy())


def judged(evaluations: Mapping[str, pd.DataFrame], plans: pd.DataFrame) -> pd.DataFrame:
    """`ratios` of policies' evaluations on the sites of some plans, against those plans."""
    some = next(iter(evaluations.values()))
    of_sites = {name: fronts(table[table.seed.isin(plans.seed)]) for name, table in evaluations.items()}
    return ratios(of_sites, known_fronts(plans, some))


def searched_plans(task: protocol.Task) -> pd.DataFrame | None:
    """What analysis/best_plans.py found in this physics; None if it has not been run, which is said."""
    path = paths.there(paths.studies()) / "best_plans" / f"{task.env_id}.csv"
    if set(task.env_kwargs) - {"observation_groups"}:
        return None
    if not path.exists() or stored.settings(path)["physics"] != provenance.physics_name():
        print(f"{path} is not there, or of another physics: `python analysis/best_plans.py` makes it")
        return None
    table = stored.read(path, text=("plan",))
    return table[table.front]


def main(args: Args) -> None:
    """Judge the runs on every split, print the summary, write the sites' ratios."""
    path = args.output
    if path is not None:
        paths.make_file_writable("--output", path)
    try:
        if args.episodes < 1:
            raise ValueError(f"--episodes {args.episodes}: 1 or more are allowed")
        if not args.runs:
            raise ValueError("runs: at least one is needed")
        configs = {folder: config_of(folder) for folder in dict.fromkeys(args.runs)}
        tasks = [task_of(config) for config in configs.values()]
        env_ids = sorted({task.env_id for task in tasks})
        if len(env_ids) != 1 or not tasks[0].draws_sites:
            raise ValueError(f"runs of {', '.join(env_ids)}: one boreal environment that draws its sites is allowed")
        splits = splits_of(tasks[0], args.split)
        scores, found = {}, {}
        for split in splits:
            evaluations = {}
            for (folder, config), task in zip(configs.items(), tasks, strict=True):
                table = evaluation_of(folder, config, task, args.episodes, split)
                evaluations |= {f"{folder}, {policy}": rows for policy, rows in table.groupby("policy")}
            shifted, seeds = sites.of_split(tasks[0], args.episodes, split)
            plans = reference.constant(reference.reference_returns(shifted, seeds))
            found[split] = judged(evaluations, plans)
            for name, table in evaluations.items():
                scores[name, split] = Comparison(table, plans).score(table.policy.iloc[0])
            best = searched_plans(tasks[0]) if split == TEST else None
            if best is not None and set(seeds) & set(best.seed):
                found[SEARCHED] = judged(evaluations, best[best.seed.isin(seeds)])
    except (ValueError, FileNotFoundError) as error:
        sys.exit(f"error: {error}")
    archived = all(folder.resolve().is_relative_to(paths.archive().resolve()) for folder in configs)
    path = path or (paths.studies() if archived else paths.runs()) / "generalisation" / f"{tasks[0].env_id}.csv"
    settings = {"runs": [str(folder) for folder in args.runs], "episodes": args.episodes, "splits": splits}
    scored = [[policy, split, round(score, 4)] for (policy, split), score in scores.items()]
    table = pd.concat([table.assign(split=split) for split, table in found.items()])
    stored.write(path, table, settings | {"scores": scored})
    report(summaries(found), scores)
    print(f"\nwrote {path}")


def summaries(found: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """`summary` of the splits against the test sites, and of those with searched plans by themselves."""
    parts = [summary({name: table for name, table in found.items() if name != SEARCHED}, TEST)]
    parts += [summary({SEARCHED: found[SEARCHED]}, SEARCHED)] if SEARCHED in found else []
    return pd.concat(parts, ignore_index=True)


def report(table: pd.DataFrame, scores: Mapping[tuple, float]) -> None:
    """Print `summaries` by policy and split, with the drop from the test sites and its 95 % interval."""
    for policy, rows in table.groupby("policy", sort=False):
        print(f"\n{policy}\n{'split':18s} sites  score   NHGR  drop (95 %)            EUGR  drop (95 %)")
        for row in rows.to_dict("records"):
            score = scores.get((policy, row["split"]), np.nan)
            line = f"{row['split']:18s} {row['sites']:5d}" + (" " * 7 if np.isnan(score) else f"{score:7.0f}")
            for name in RATIOS:
                drop, low, high = (row.get(f"{name}_drop{end}", np.nan) for end in ("", "_low", "_high"))
                shown = "" if np.isnan(drop) else f"{drop:+.2f} ({low:+.2f} .. {high:+.2f})"
                line += f"  {row[name]:5.2f}  {shown:21s}"
            print(line.rstrip())


if __name__ == "__main__":
    main(protocol.parse(Args))
