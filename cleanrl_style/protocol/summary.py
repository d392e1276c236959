"""What a run shows at its end: a short table per weight, and a picture."""

import math
from pathlib import Path

import pandas as pd

from cleanrl_style.protocol import fronts

COLOURS = ("tab:green", "tab:blue", "tab:orange", "tab:purple", "tab:brown", "tab:red")  # of objectives, in order


def print_table(objectives, evaluation: pd.DataFrame) -> None:
    """Mean returns per weight of the sampled and the greedy policy; metrics of the sampled one's front."""
    names = [*objectives, "scalarized"]
    weights, columns = fronts.weight_columns(objectives), [f"{name}_return" for name in names]
    means = evaluation.groupby(["policy", *weights])[columns].mean()
    sampled, greedy = means.loc["sampled"], means.loc["greedy"]
    widths = [max(8, len(name) + 2) for name in names]

    def block(cells):
        return " " + "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))

    def row(label, *rows):
        return label + "".join(block(f"{value:.2f}" for value in values) for values in rows)

    episodes = (evaluation.policy == "sampled").sum() // len(sampled)
    whose = objectives[0] if len(objectives) == 2 else ", ".join(objectives)
    label = 6 * len(weights)
    print(f"\nMean returns of {episodes} evaluation episodes per weight")
    if len(objectives) > 2:
        print(f"weights of {whose}")
    above = "".join(f"{f'{kind} policy':^{sum(widths) + 1}}" for kind in ("sampled", "greedy"))
    print(f"{whose if len(objectives) == 2 else '':{label}}{above}".rstrip())
    print(f"{'weight':{label}}{block(names)}{block(names)}")
    for (key, one), (_, other) in zip(sampled.iterrows(), greedy.iterrows(), strict=True):
        print(row("".join(f"{w:6.2f}" for w in (key if isinstance(key, tuple) else (key,))), one, other))
    print(row(f"{'mean':>{label}}", sampled.mean(), greedy.mean()))
    front = sampled[fronts.return_columns(objectives)].to_numpy()
    print(
        f"sampled policy: hypervolume {fronts.hypervolume(front):.2f} above "
        f"{(fronts.REFERENCE_POINT,) * len(objectives)}, sparsity {fronts.sparsity(front):.3g}\n"
    )


def draw_summary(file, title: str, objectives, evaluation: pd.DataFrame, years: pd.DataFrame | None, episodes: Path):
    """PNG of the learning curves and the trade-off; of a fixed strategy, its stand's years and episodes."""
    from matplotlib.figure import Figure

    learns = episodes.exists()
    rows = math.ceil((len(objectives) + 2) / 2) if learns else 2
    figure = Figure(figsize=(10, 3.5 * rows), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplots(rows, 2).ravel()
    if learns:
        used = len(objectives) + 2
        _draw_learning(axes[: used - 1], objectives, pd.read_csv(episodes))
        draw = _draw_trade_off if len(objectives) == 2 else _draw_parallel
        draw(figure, axes[used - 1], objectives, evaluation)
        for ax in axes[used:]:
            ax.set_axis_off()
    else:
        _draw_years(axes[:3], of_last_weights(years, objectives))
        _draw_episodes(axes[3], objectives, of_last_weights(evaluation, objectives))
    figure.savefig(file, format="png", dpi=120)


def of_last_weights(table: pd.DataFrame, objectives) -> pd.DataFrame:
    """Rows of the sampled policy at the last weights, in ascending order."""
    weights = fronts.weight_columns(objectives)
    last = table[weights].drop_duplicates().sort_values(weights).iloc[-1]
    return table[(table.policy == "sampled") & (table[weights] == last).all(axis=1)]


def _draw_learning(axes, objectives, episodes: pd.DataFrame) -> None:
    columns = [*fronts.return_columns(objectives), "scalarized_return"]
    colours = [COLOURS[k % len(COLOURS)] for k in range(len(objectives))] + ["black"]
    for ax, column, colour in zip(axes, columns, colours, strict=True):
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
    for ax, (variable, label) in zip(axes, labels.items(), strict=True):
        rows = years[years.variable == variable]
        ax.fill_between(rows.year, rows.p10, rows.p90, alpha=0.3, label="80 % of the episodes")
        ax.plot(rows.year, rows["mean"], label="mean")
        ax.set(xlabel="year", ylabel=label)
        ax.legend(fontsize=8)


def _draw_trade_off(figure, ax, objectives, evaluation: pd.DataFrame) -> None:
    first, second = objectives
    returns = fronts.return_columns((second, first))
    for policy, marker in (("sampled", "o"), ("greedy", "^")):
        means = evaluation[evaluation.policy == policy].groupby("preference")[returns].mean()
        points = ax.scatter(
            means[returns[0]],
            means[returns[1]],
            c=means.index,
            vmin=0,
            vmax=1,
            marker=marker,
            edgecolors="black",
            linewidths=0.5,
        )
        ax.plot([], [], marker, color="white", markeredgecolor="black", label=f"{policy} policy")
        for weight in (means.index[0], means.index[-1]):
            ax.annotate(f"{weight:g}", means.loc[weight], xytext=(5, 5), textcoords="offset points", fontsize=8)
    ax.set(xlabel=f"mean {second} return", ylabel=f"mean {first} return", title="evaluation, one point per weight")
    ax.locator_params(nbins=6)
    ax.ticklabel_format(useOffset=False)
    ax.legend(fontsize=8)
    figure.colorbar(points, ax=ax, label=f"{first} weight")


def _draw_parallel(figure, ax, objectives, evaluation: pd.DataFrame) -> None:
    """A line per weight of the sampled policy's mean returns, in the colour of the objective that weighs most."""
    weights, returns = fronts.weight_columns(objectives), fronts.return_columns(objectives)
    means = evaluation[evaluation.policy == "sampled"].groupby(weights)[returns].mean()
    for its_weights, values in means.iterrows():
        heaviest = max(range(len(objectives)), key=lambda k: its_weights[k])
        ax.plot(range(len(objectives)), values, "o-", color=COLOURS[heaviest % len(COLOURS)], alpha=0.7)
    for k, name in enumerate(objectives):
        ax.plot([], [], "o-", color=COLOURS[k % len(COLOURS)], label=f"{name} weighs most")
    ax.set_xticks(range(len(objectives)), objectives)
    ax.set(ylabel="mean return", title="evaluation, sampled policy, one line per weight")
    ax.legend(fontsize=8)


def _draw_episodes(ax, objectives, evaluation: pd.DataFrame) -> None:
    first, second = objectives[:2]
    x, y = evaluation[f"{second}_return"], evaluation[f"{first}_return"]
    ax.plot(x, y, ".", color="grey", label="episode")
    ax.plot(x.mean(), y.mean(), "k*", markersize=12, label="mean")
    ax.set(xlabel=f"{second} return", ylabel=f"{first} return", title="evaluation")
    ax.legend(fontsize=8)
