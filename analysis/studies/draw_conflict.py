"""Draws where the two objectives conflict: docs/images/conflict.png.

    python analysis/studies/draw_conflict.py

from the tables of `fronts.py`, `fronts.py --without-mechanisms` and `variance.py`.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd

from analysis import paths, stored
from analysis.studies import open_loop
from analysis.studies.fronts import ALL_ON, GAINS, YEARS, path_of, plan_means, with_gains
from cleanrl_style import protocol

MADE_BY = {"fronts": "fronts.py", "fronts/mechanisms": "fronts.py --without-mechanisms", "variance": "variance.py"}
COLUMNS = 4


@dataclass
class Args:
    """Draws the fronts of the sites, what each mechanism does to them, and the split of the variance."""

    results: Path = Path("results")
    """folder with fronts, fronts/mechanisms and variance"""
    path: Path = Path("docs/images/conflict.png")
    """file of the picture"""


def read(folder: Path, name: str, text: tuple[str, ...] = ()) -> pd.DataFrame:
    """A table, or an end with the command that makes it."""
    path = folder / name
    if not path.exists():
        command = MADE_BY[next(key for key in sorted(MADE_BY, reverse=True) if folder.as_posix().endswith(key))]
        sys.exit(f"draw_conflict.py: {path} is missing; python analysis/studies/{command} makes it")
    return stored.read(path, text)


def draw_front(ax, front: pd.DataFrame, title: str):
    """One site's front in gains, coloured by the conifers' share of the stems planted."""
    ax.axhline(0.0, color="#cccccc", lw=0.8, zorder=0)
    ax.axvline(0.0, color="#cccccc", lw=0.8, zorder=0)
    ax.plot(front[GAINS[0]], front[GAINS[1]], color="#888888", lw=0.8, zorder=1)
    colors = matplotlib.colormaps["viridis"].with_extremes(bad="#bbbbbb")  # grey: nothing was planted
    points = ax.scatter(
        front[GAINS[0]], front[GAINS[1]], c=front.conifer_share, cmap=colors, vmin=0, vmax=1, s=16, plotnonfinite=True
    )
    if front.clipped_thaw_years.min() > 0.99 * YEARS:
        ax.set_ylim(-1.0, 1.0)
        words = "thaw reward clipped\nat −1 in nearly every year"
        ax.text(0.5, 0.8, words, transform=ax.transAxes, ha="center", fontsize=7)
    ax.set_title(title, fontsize=8)
    ax.tick_params(labelsize=7)
    return points


def draw_mechanisms(axes, summary: pd.DataFrame) -> None:
    """Extent of the front with everything on and each mechanism off: sites as dots, their mean as a bar."""
    order = [ALL_ON, *(name for name in summary.off.unique() if name != ALL_ON)]
    for ax, name in zip(axes, open_loop.OBJECTIVES, strict=True):
        by_site = summary.pivot(index="off", columns="site_seed", values=f"{name}_extent").loc[order]
        rows = np.arange(len(order))
        ax.barh(rows, by_site.mean(axis=1), color=["#555555", *["#9dbfd9"] * (len(order) - 1)])
        for site in by_site:
            ax.plot(by_site[site], rows, "o", color="black", ms=2.5)
        ax.axvline(by_site.loc[ALL_ON].mean(), color="#555555", lw=0.8, ls=":")
        labels = [row if row == ALL_ON else f"without {row.replace('_', ' ')}" for row in order]
        ax.set_yticks(rows, labels, fontsize=7)
        ax.invert_yaxis()
        ax.set_title(f"extent of the front in {name}", fontsize=8)
        ax.tick_params(axis="x", labelsize=7)
    axes[1].set_yticklabels([])


def draw_variance(ax, components: pd.DataFrame) -> None:
    """Shares of the variance, stacked: site, weather, policy, and what weather and policy do together.

    Weather and policy with their interaction with the site. A third bar leaves the site out: what is left to a policy
    that knows its site.
    """
    groups = {
        "site": (["site"], "#8c6d46"),
        "weather": (["weather", "site x weather"], "#9dbfd9"),
        "policy": (["policy", "site x policy"], "#2a7a3b"),
        "weather x policy": (["weather x policy", "site x weather x policy"], "#d0d0d0"),
    }
    by_component = components.set_index(["objective", "value", "component"]).share.sort_index()
    bars = {}
    for name in open_loop.OBJECTIVES:
        for value in ("return", "one year"):
            shares = {group: by_component[name, value][parts].sum() for group, (parts, _) in groups.items()}
            bars[f"{name}, {value}"] = shares
            if value == "return":
                bars[f"{name}, return on a site"] = {
                    group: share / (1.0 - shares["site"]) if group != "site" else 0.0 for group, share in shares.items()
                }
    table = pd.DataFrame(bars).T
    left = np.zeros(len(table))
    for group, (_, color) in groups.items():
        ax.barh(range(len(table)), table[group], left=left, color=color, label=group)
        left += table[group].to_numpy()
    ax.set_yticks(range(len(table)), table.index, fontsize=7)
    ax.invert_yaxis()
    ax.set_xlim(0, 1)
    ax.set_title("share of the variance", fontsize=8)
    ax.tick_params(axis="x", labelsize=7)
    ax.legend(fontsize=7, frameon=False, ncols=4, loc="upper center", bbox_to_anchor=(0.4, -0.08))


def main(args: Args) -> None:
    """Read the tables and draw."""
    sites = read(args.results / "fronts", "summary.csv")
    mechanisms = read(args.results / "fronts/mechanisms", "summary.csv")
    components = read(args.results / "variance", "components.csv")
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    rows = -(-len(sites) // COLUMNS)
    figure = plt.figure(figsize=(9, 2 * rows + 3.4), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(2 * rows, 3.2))
    axes = upper.subplots(rows, COLUMNS, squeeze=False)
    for ax in axes.flat[len(sites) :]:
        ax.set_visible(False)
    for ax, site in zip(axes.flat, sites.sort_values("boundary_above_air_k").itertuples(), strict=False):
        path = path_of(args.results / "fronts", site.site_seed, ALL_ON)
        front = plan_means(with_gains(read(path.parent, path.name, text=("actions",))), "front")
        title = f"boundary {site.boundary_above_air_k:.1f} K above air\nsnow {site.snow_mm_day:.1f} mm/day"
        points = draw_front(ax, front, title)
    upper.supxlabel("carbon gain over zero change", fontsize=9)
    upper.supylabel("thaw gain over zero change", fontsize=9)
    bar = upper.colorbar(points, ax=axes, shrink=0.8)
    bar.set_label("conifers among stems planted", fontsize=8)
    bar.ax.tick_params(labelsize=7)
    below = lower.subplots(1, 3, width_ratios=(1, 1, 1.6))
    draw_mechanisms(below[:2], mechanisms)
    draw_variance(below[2], components)

    paths.make_writable("--path", args.path.parent)
    with protocol.replacing(args.path) as file:
        figure.savefig(file, format="png", dpi=120, metadata={"Software": None})
    plt.close(figure)
    print(f"wrote {args.path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
