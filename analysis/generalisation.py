"""How much of the best known front a policy reaches, site by site, inside and outside the range it was trained on.

The ratios are those of Teoh, Varakantham and Vamplew (2025, ICLR, "On generalization across environments in
multi-objective reinforcement learning"): NHGR is the hypervolume of a policy's front over that of the site's best known
front, EUGR the same of the expected utility, each at most 1. Returns are first scaled per site and objective, the
lowest of all fronts of the site to 0 and the highest to 1, and 0 is the reference point. One departure: theirs takes
the expected utility of returns as they are; ours may be negative, where a ratio says nothing, so both take scaled ones.

A table of fronts has a row a point: `site_seed` and a return of each objective (`carbon_return`, ..).
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from analysis import metrics

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
    """NHGR and EUGR of a policy's points (n, m) against the site's best known front (k, m)."""
    ours, known = scaled(points, low, high), scaled(best, low, high)
    volumes = metrics.hypervolume(ours, 0.0), metrics.hypervolume(known, 0.0)
    utilities = metrics.expected_utility(ours), metrics.expected_utility(known)
    return {name: _share(*pair) for name, pair in zip(RATIOS, (volumes, utilities), strict=True)}


def _share(ours: float, known: float) -> float:
    if not known > 0.0:
        raise ValueError("a best known front that dominates nothing: it has to be as good as the policies' somewhere")
    return min(ours / known, 1.0)


def ratios(policies: Mapping[str, pd.DataFrame], best: pd.DataFrame) -> pd.DataFrame:
    """A row a policy and site, with `policy`, `site_seed` and `RATIOS`.

    policies : name -> fronts; best : the best known fronts. All are of the same objectives and sites; the scale of a
    site is that of all policies and its best known front together, so add all that are compared.
    """
    columns = metrics.return_columns(metrics.objectives_of(best.columns))
    known = {seed: rows[columns].to_numpy(dtype=float) for seed, rows in best.groupby("site_seed")}
    points: dict[str, dict] = {}
    for name, table in policies.items():
        if not set(columns) <= set(table.columns):
            raise ValueError(f"policy {name}: returns of {', '.join(columns)} are needed")
        points[name] = {seed: rows[columns].to_numpy(dtype=float) for seed, rows in table.groupby("site_seed")}
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
    intervals: paired by site, since a shift keeps the sites' seeds and moves one property.

    by_split : split -> what `ratios` gave; inside : the split within the sampled range.
    """
    if inside not in by_split:
        raise ValueError(f"split {inside!r}: allowed are {', '.join(by_split)}")
    tables = {split: table.set_index(["policy", "site_seed"]).sort_index() for split, table in by_split.items()}
    rows = []
    for split, table in tables.items():
        if not table.index.equals(tables[inside].index):
            raise ValueError(
                f"split {split!r} has not the policies and site seeds of {inside!r}: they cannot be paired"
            )
        for policy in table.index.unique("policy"):
            here, there = table.loc[policy], tables[inside].loc[policy]
            row = {"policy": policy, "split": split, "sites": len(here)}
            for name in RATIOS:
                row |= metrics.with_interval(name, here[name].to_numpy())
                row |= metrics.with_interval(f"{name}_drop", (there[name] - here[name]).to_numpy())
            rows.append(row)
    return pd.DataFrame(rows)
