"""Compares two methods by their difference on the same sites, with its interval over training seeds and sites.

    python analysis/compare.py runs/ppo_neighbours/boreal-balanced-v0-vectorization=lockstep \\
        results/runs/ppo_gated/boreal-balanced-v0-vectorization=lockstep

Each is a folder with the runs of one method and setting, a training seed each. Whether two methods differ is told by
this interval, not by whether those of their scores overlap: on easy sites both gain more.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

from cleanrl_style.flags import fail, require

require("tyro")

import numpy as np
import tyro

from analysis import methods, metrics
from analysis.results import Replicate, Results
from analysis.tables import main_results
from analysis.tables.common import score_text
from cleanrl_style import protocol


@dataclass
class Args:
    """Compares two methods on the same sites, in points of the score."""

    first: tyro.conf.Positional[Path]
    """folder with the runs of a method, one a training seed"""
    second: tyro.conf.Positional[Path]
    """folder with those of the method to compare it with"""


def row_of(folder: Path) -> tuple[tuple, list[Replicate]]:
    """Script, environment and setting of the runs below a folder, and its replicates; ends the command if not one."""
    if not folder.is_dir():
        fail(f"{folder}: no such folder; one with runs is allowed, such as runs/<script>/<setting>")
    results = Results.load(False, (folder,))
    rows = {key: replicates for key, replicates in results.rows.items() if replicates}
    for problem in results.left_out:
        print(f"left out: {problem}", file=sys.stderr)
    if len(rows) != 1:
        parents = sorted({str(run.folder.parent) for run in results.runs})
        which = parents if len(parents) >= len(rows) else [str(run.folder) for run in results.runs]
        what = f"runs of {len(rows)} settings; give one of {', '.join(which)}" if rows else "no finished run"
        fail(f"{folder} holds {what}")
    [(key, replicates)] = rows.items()
    if any(one.plans is None for one in replicates):
        fail(
            f"{folder}: no constant plans are known on its episodes, in percent of whose gains the difference is; they "
            "are of the project's environments without --site-seed and --thaw-formulation. The score at the run's end, "
            "and evaluation.csv, are what there is of others"
        )
    for line in results.of_several_sources():
        print(f"warning: {line}", file=sys.stderr)
    if "scalarization" in key[2]:
        print(f"{folder}: scores here are of the weighted sum; that of its own utility is at the run's end")
    return key, replicates


def evaluated(key: tuple, row: list[Replicate], weights: np.ndarray) -> str:
    """How a row was evaluated at these weights (n, m), by its flags."""
    shown = weights[:, :1] if weights.shape[1] == 2 else weights
    episodes = row[0].runs[0].arguments["eval_episodes"]
    return f"--env-id {key[1]} --eval-weights {' '.join(f'{w:g}' for w in shown.ravel())} --eval-episodes {episodes}"


def gains_on_sites(replicates: list[Replicate], policy: str) -> tuple[np.ndarray, np.ndarray]:
    """Scalarised gains (seeds, sites) of a policy, and the sites' seeds."""
    tables = [metrics.of_sites(one.by_policy[policy]) for one in replicates]
    if any(not table.index.equals(tables[0].index) for table in tables):
        fail("the training seeds of a method were evaluated on different sites")
    return np.array(tables), tables[0].index.to_numpy()


def told_from(values: np.ndarray, seeds: int) -> float:
    """The least difference that so many training seeds a method tell, in points; infinity if none up to 200 is."""
    differences = np.arange(0.1, 200.0, 0.1)
    return next((d for d in differences if metrics.seeds_to_tell(values, d) <= seeds), np.inf)


def main(args: Args) -> None:
    """Print both scores and their difference, greedy and sampled."""
    (key, first), (other, second) = row_of(args.first), row_of(args.second)
    weights = [np.unique(metrics.weights_of(row[0].evaluation), axis=0) for row in (first, second)]
    how = f"{evaluated(key, first, weights[0])}, and {evaluated(other, second, weights[1])}"
    if key[1] != other[1] or not np.array_equal(*weights):
        fail(f"the two were evaluated differently: {how}")
    gains = {policy: [gains_on_sites(row, policy) for row in (first, second)] for policy in protocol.POLICIES}
    if any(not np.array_equal(ours[1], theirs[1]) for ours, theirs in gains.values()):
        fail(f"the two were evaluated on different sites: {how}")
    best = metrics.best_constant_plans(first[0].plans, weights[0]).scalarized_return.mean()
    for name, (script, env_id, setting), row in (("first", key, first), ("second", other, second)):
        title = ", ".join(filter(None, (methods.title(script), methods.flags(setting))))
        scores = main_results.scores(row)
        both = (
            f"{score_text(*(scores.get(f'score_{policy}{end}', np.nan) for end in ('', '_low', '_high')))} {policy}"
            for policy in protocol.POLICIES
        )
        print(f"{name}: {title} on {env_id}, training seeds: {len(row)}, score {', '.join(both)}")
    for policy in protocol.POLICIES:
        (ours, sites), (theirs, _) = gains[policy]
        value, low, high = 100 * np.array(metrics.difference_interval(ours, theirs)) / best
        text = f"{policy}: first less second {value:+.1f} points"
        if min(len(first), len(second)) > 1:
            alone = 100 * np.array(metrics.welch_interval(ours.mean(axis=1), theirs.mean(axis=1))) / best
            told = "told apart" if min(low, alone[0]) > 0 or max(high, alone[1]) < 0 else "not told apart"
            text += f" [{low:+.1f}, {high:+.1f}] over seeds and {len(sites)} sites, [{alone[0]:+.1f}, {alone[1]:+.1f}] "
            text += f"over seeds alone: {told}"
            seeds = min(len(ours), len(theirs))
            least = max(told_from(100 * gained.mean(axis=1) / best, seeds) for gained in (ours, theirs))
            text += f" (with {seeds} seeds each a t test finds {least:.1f} points with a power of 80 %)"
        else:
            text += ", and no interval of a single training seed"
        print(text)


if __name__ == "__main__":
    main(protocol.parse(Args))
