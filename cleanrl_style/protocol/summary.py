"""What a run shows at its end: a short table per weight, and a picture."""

from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from cleanrl_style.protocol import fronts

OBJECTIVE_COLOURS = {"carbon_return": "tab:green", "thaw_return": "tab:blue", "scalarized_return": "black"}


def print_table(evaluation: pd.DataFrame) -> None:
    """Mean returns per weight of the sampled and the greedy policy; metrics of the sampled one's front."""
    columns = ["carbon_return", "thaw_return", "scalarized_return"]
    means = evaluation.groupby(["policy", "preference"])[columns].mean()
    sampled, greedy = means.loc["sampled"], means.loc["greedy"]
    episodes = (evaluation.policy == "sampled").sum() // len(sampled)
    print(f"\nMean returns of {episodes} evaluation episodes per weight")
    print("carbon       sampled policy                greedy policy")
    print("weight   carbon    thaw  scalarized   carbon    thaw  scalarized")
    for weight in sampled.index:
        print(
            f"{weight:6.2f}"
            + "".join("{:9.2f}{:8.2f}{:12.2f}".format(*table.loc[weight]) for table in (sampled, greedy))
        )
    print("  mean" + "".join("{:9.2f}{:8.2f}{:12.2f}".format(*table.mean()) for table in (sampled, greedy)))
    front = sampled[fronts.OBJECTIVES].to_numpy()
    print(
        f"sampled policy: hypervolume {fronts.hypervolume(front):.2f} above {fronts.REFERENCE_POINT}, "
        f"sparsity {fronts.sparsity(front):.3g}\n"
    )


def draw_summary(file, title: str, evaluation: pd.DataFrame, years: pd.DataFrame | None, episodes: Path):
    """PNG of the learning curves and the trade-off; of a fixed strategy, its stand's years and episodes."""
    figure = Figure(figsize=(10, 7), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplots(2, 2).ravel()
    if episodes.exists():
        _draw_learning(axes[:3], pd.read_csv(episodes))
        _draw_trade_off(figure, axes[3], evaluation)
    else:
        _draw_years(axes[:3], years)
        _draw_episodes(axes[3], evaluation)
    figure.savefig(file, format="png", dpi=120)


def _draw_learning(axes, episodes: pd.DataFrame) -> None:
    for ax, (column, colour) in zip(axes, OBJECTIVE_COLOURS.items(), strict=True):
        ax.plot(episodes.global_step, episodes[column], ".", markersize=1, color=colour, alpha=0.25)
        mean = episodes[column].rolling(100, min_periods=min(20, len(episodes))).mean()
        ax.plot(episodes.global_step, mean, color=colour, label="mean of the last 100 episodes")
        ax.set(xlabel="environment steps", ylabel=column.replace("_", " "))
        ax.locator_params(axis="x", nbins=5)
        ax.legend(fontsize=8)


def _draw_years(axes, years: pd.DataFrame) -> None:
    labels = {
        "density_stems_ha": "density (stems/ha)",
        "conifer_fraction": "conifer fraction",
        "biomass_kgc_m2": "biomass (kgC/m2)",
    }
    one_policy = years[(years.policy == "sampled") & (years.preference == years.preference.max())]
    for ax, (variable, label) in zip(axes, labels.items(), strict=True):
        rows = one_policy[one_policy.variable == variable]
        ax.fill_between(rows.year, rows.p10, rows.p90, alpha=0.3, label="80 % of the episodes")
        ax.plot(rows.year, rows["mean"], label="mean")
        ax.set(xlabel="year", ylabel=label)
        ax.legend(fontsize=8)


def _draw_trade_off(figure, ax, evaluation: pd.DataFrame) -> None:
    for policy, marker in (("sampled", "o"), ("greedy", "^")):
        means = fronts.mean_returns(evaluation[evaluation.policy == policy])
        points = ax.scatter(
            means.thaw_return,
            means.carbon_return,
            c=means.index,
            vmin=0,
            vmax=1,
            marker=marker,
            edgecolors="black",
            linewidths=0.5,
        )
        ax.plot([], [], marker, color="white", markeredgecolor="black", label=f"{policy} policy")
        for weight in (means.index[0], means.index[-1]):
            ax.annotate(
                f"{weight:g}",
                means.loc[weight, ["thaw_return", "carbon_return"]],
                xytext=(5, 5),
                textcoords="offset points",
                fontsize=8,
            )
    ax.set(xlabel="mean thaw return", ylabel="mean carbon return", title="evaluation, one point per weight")
    ax.locator_params(nbins=6)
    ax.ticklabel_format(useOffset=False)
    ax.legend(fontsize=8)
    figure.colorbar(points, ax=ax, label="carbon weight")


def _draw_episodes(ax, evaluation: pd.DataFrame) -> None:
    episodes = evaluation[evaluation.preference == evaluation.preference.max()].drop_duplicates("seed")
    ax.plot(episodes.thaw_return, episodes.carbon_return, ".", color="grey", label="episode")
    ax.plot(episodes.thaw_return.mean(), episodes.carbon_return.mean(), "k*", markersize=12, label="mean")
    ax.set(xlabel="thaw return", ylabel="carbon return", title="evaluation")
    ax.legend(fontsize=8)
