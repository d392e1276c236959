"""A front that a weighted sum misses: a site's constant plans, and which of them each utility ever takes.

    python analysis/studies/concave_front.py      # seconds

Every constant plan is played on one of the test sites, under its fixed weather. Of those that no other plan
dominates some lie below the line between two others: at no preference a weighted sum takes them, Chebyshev's utility
does. Prints mean gains over doing nothing, and at how many of 101 preferences a plan is the best one; draws
docs/images/concave_front.png.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis import paths
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts, reference
from cleanrl_style.protocol.arguments import ask, ideal_point
from cleanrl_style.protocol.utility import LINEAR, Chebyshev, Utility

SITE = 1037049714
WEIGHTS = np.linspace(0, 1, 101)


@dataclass
class Args:
    """Finds which constant plans each utility takes on one site."""

    env_id: str = "boreal-site-specific-v0"
    """environment"""
    site_seed: int = SITE
    """site, as sim.sample_site draws it"""
    path: Path = Path("docs", "images", "concave_front.png")
    """file of the picture"""


def taken(returns: np.ndarray, utility: Utility) -> np.ndarray:
    """The best plan at each of WEIGHTS, by the mean utility of its episodes; returns : (plans, episodes, 2)."""
    weights = np.stack([WEIGHTS, 1 - WEIGHTS], axis=1)
    return np.array([utility(returns, one).mean(axis=1).argmax() for one in weights])


def study(task: protocol.Task, seeds: list[int]) -> tuple[pd.DataFrame, dict[str, np.ndarray]]:
    """The plans that no other dominates, by their carbon gain, and the best of them at each of WEIGHTS by utility."""
    table = reference.reference_returns(task, seeds)
    columns = fronts.return_columns(task.objectives)
    plans, of_plans = zip(*table.groupby("plan"), strict=True)
    returns = np.stack([rows.sort_values("seed")[columns].to_numpy() for rows in of_plans])
    gains = returns.mean(axis=1) - returns[plans.index(reference.NOTHING)].mean(axis=0)
    best = fronts.is_nondominated(gains)
    order = [k for k in np.argsort(gains[:, 0]) if best[k]]
    front = pd.DataFrame(
        {"plan": [plans[k] for k in order], "carbon_gain": gains[order, 0], "thaw_gain": gains[order, 1]}
    )
    choices = {
        name: taken(returns[order], one)
        for name, one in (("linear", LINEAR), ("chebyshev", Chebyshev(ideal_point(task))))
    }
    for name, chosen in choices.items():
        front[name] = np.bincount(chosen, minlength=len(front))
    return front, choices


def draw(front: pd.DataFrame, choices: dict[str, np.ndarray], title: str) -> Figure:
    """The plans' gains, and which is the best at each preference."""
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    figure.suptitle(title, fontsize=10)
    supported = front[front.linear > 0]
    left.plot(supported.carbon_gain, supported.thaw_gain, "k--", linewidth=0.8, label="line between its plans")
    left.plot(front.carbon_gain, front.thaw_gain, "o", color="tab:orange", label="Chebyshev's utility takes it")
    left.plot(
        supported.carbon_gain, supported.thaw_gain, "ks", fillstyle="none", markersize=11, label="weighted sum takes it"
    )
    for row in front.itertuples():
        left.annotate(
            reference.title(row.plan).rpartition(", ")[2], (row.carbon_gain, row.thaw_gain), xytext=(-8, -3), **SMALL
        )
    left.set(xlabel="carbon gain", ylabel="thaw gain", title="plans that no other dominates")
    left.margins(x=0.45, y=0.15)
    left.legend(fontsize=7, loc="upper right")
    for (name, chosen), style in zip(choices.items(), ("k-", "C1-"), strict=True):
        right.step(WEIGHTS, front.carbon_gain.to_numpy()[chosen], style, where="mid", label=NAMES[name])
    right.set(xlabel="carbon weight", ylabel="carbon gain", title="the best plan of each preference")
    right.legend(fontsize=7)
    return figure


SMALL = {"textcoords": "offset points", "fontsize": 7, "ha": "right", "va": "top"}
NAMES = {"linear": "weighted sum", "chebyshev": "Chebyshev's utility"}


def main(args: Args) -> None:
    """Play, or take what was played before; write the table and the picture."""
    paths.make_writable("--path", args.path.parent)
    task = ask(args.env_id)
    if not task.boreal:
        protocol.fail(f"--env-id {args.env_id}: a boreal environment is allowed")
    task = protocol.Task.of(args.env_id, site_seed=args.site_seed)
    if task.num_objectives != 2:
        protocol.fail(f"--env-id {args.env_id}: an environment of two objectives is allowed")
    front, choices = study(task, protocol.evaluation_seeds(task, 1))
    print(front.to_string(index=False, float_format="%.3f"))
    with protocol.replacing(args.path) as file:
        title = f"{args.env_id}, site {args.site_seed}: constant plans"
        draw(front, choices, title).savefig(file, format="png", dpi=110)
    print(f"wrote {args.path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
