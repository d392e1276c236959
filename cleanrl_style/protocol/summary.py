"""What a run shows at its end: a short table per weight, and a picture."""

import itertools
import math
from pathlib import Path

import numpy as np
import pandas as pd

from cleanrl_style.protocol import fronts
from cleanrl_style.protocol.course import Course, gain_columns
from cleanrl_style.protocol.evaluation import POLICIES, PRIMARY
from cleanrl_style.protocol.reference import NOTHING, title
from cleanrl_style.protocol.score import Comparison, at_weights, by_weight, change, gain_hypervolume, gains

SHOWN_WEIGHTS = (0.0, 0.25, 0.5, 0.75, 1.0)  # of two objectives, where they were evaluated
WIDTH = 11  # of a column
COLOURS = ("tab:green", "tab:blue", "tab:orange", "tab:purple", "tab:brown", "tab:red")  # of objectives, in order


def print_table(objectives, evaluation: pd.DataFrame) -> None:
    """Mean returns per weight of both policies, of an environment where doing nothing is not known."""
    names = [*objectives, "scalarized"]
    weights, columns = fronts.weight_columns(objectives), [f"{name}_return" for name in names]
    means = evaluation.groupby(["policy", *weights])[columns].mean()
    first, second = (means.loc[policy] for policy in POLICIES)
    widths = [max(8, len(name) + 2) for name in names]

    def block(cells):
        return " " + "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))

    def row(label, *rows):
        return label + "".join(block(f"{value:.2f}" for value in values) for values in rows)

    episodes = (evaluation.policy == POLICIES[0]).sum() // len(first)
    label = 6 * len(weights)
    print(f"\nMean returns of {episodes} evaluation episodes per weight")
    if len(objectives) > 2:
        print(f"weights of {', '.join(objectives)}")
    above = "".join(f"{f'{policy} policy':^{sum(widths) + 1}}" for policy in POLICIES)
    print(f"{objectives[0] if len(objectives) == 2 else '':{label}}{above}".rstrip())
    print(f"{'weight':{label}}{block(names)}{block(names)}")
    for (key, one), (_, other) in zip(first.iterrows(), second.iterrows(), strict=True):
        print(row("".join(f"{w:6.2f}" for w in (key if isinstance(key, tuple) else (key,))), one, other))
    print(row(f"{'mean':>{label}}", first.mean(), second.mean()) + "\n")


def print_score(objectives, comparison: Comparison, trained: bool = True) -> None:
    """Gains per weight beside what one can do without looking, the score, and how far the preference is followed.

    trained : whether something was to be learnt; of a fixed strategy it is not said that nothing was.
    """
    table, label = comparison.by_weight, 6 * len(fronts.weight_columns(objectives))
    shown = [*POLICIES, "plus_100", "best"]
    if len(objectives) == 2 and any(weight in table.index for weight in SHOWN_WEIGHTS):
        chosen = table.index.isin(SHOWN_WEIGHTS)
    else:
        chosen = np.ones(len(table), dtype=bool)

    def row(name, values, words=""):
        return f"{name:>{label}}" + "".join(f"{value:>z{WIDTH}.2f}" for value in values) + words  # z: no -0.00

    episodes = comparison.evaluation.seed.nunique()
    scores = {name: f"{comparison.score(name):z.0f}" for name in shown}
    policies = ", ".join(f"{scores[policy]} {policy}" for policy in sorted(POLICIES, key=lambda name: name != PRIMARY))
    print(f"\nSCORE {policies}: 0 is to do nothing, 100 at each weight the best plan that does the same every year")
    what = comparison.utility.title
    print(f"\nGain: {what} of an episode above that of doing nothing, mean of {episodes} evaluation episodes")
    whose = objectives[0] if len(objectives) == 2 else ""
    if len(objectives) > 2:
        print(f"weights of {', '.join(objectives)}")
    who = "agent," if trained else "strategy,"
    heads = (whose, who, who, "+100", "best"), ("weight", *POLICIES, "a year", "constant")
    for (first, *others), words in zip(heads, ("", "  plan, which is to"), strict=True):
        print(f"{first:>{label}}" + "".join(f"{head:>{WIDTH}}" for head in others) + words)
    for (key, values), plan, wanted in zip(table[shown].iterrows(), comparison.best_plans, chosen, strict=True):
        if wanted:
            name = "".join(f"{w:6.2f}" for w in (key if isinstance(key, tuple) else (key,)))
            print(row(name, values, f"  {title(plan)}"))
    print(row("mean", table[shown].mean()))
    print(
        f"{'SCORE':>{label}}" + "".join(f"{value:>{WIDTH}}" for value in scores.values()) + "  % of the best constant"
    )
    if trained and np.allclose(table[PRIMARY], 0.0, atol=1e-4):  # doing nothing is stored in six digits
        print(f"The {PRIMARY} policy gains what doing nothing does: it has learnt nothing yet")
    if len(table) > 1:
        print(followed(objectives, comparison))
    hypervolumes = (f"{name} {gain_hypervolume(comparison.gains[name]):.2f}" for name in POLICIES)
    print(
        f"Hypervolume of the mean gains: {', '.join(hypervolumes)}; "
        f"best constant plans {gain_hypervolume(comparison.gains['best']):.2f}\n"
    )


def print_course(course: Course, table: pd.DataFrame) -> None:
    """The score in the course of the training; table : validation.csv, empty of a script that does not play it."""
    if table.empty:
        return
    scores = [f"{course.score(rows):z.0f}" for _, rows in table.groupby("global_step")]
    shares = [f"{100 * step / course.steps:.0f}" for step in table.global_step.unique()]
    print(f"Course: score {', '.join(scores)} on {course.where} after {', '.join(shares)} % of the training (greedy)")


def followed(objectives, comparison: Comparison) -> str:
    """How far the primary policy follows the preference, and how far the best constant plans do."""
    first, last = comparison.weights[[0, -1], 0]
    what = "Own weight lowest to highest (each should rise)"
    if len(objectives) == 2:
        what = f"Preference {first:g} to {last:g} ({objectives[0]} should rise, {objectives[1]} fall)"
    ours, best = (change(comparison.gains[name]) for name in (PRIMARY, "best"))
    changes = (
        f"{objective} {one:+z.2f} (best constant {other:+z.2f})"
        for objective, one, other in zip(objectives, ours, best, strict=True)
    )
    return f"{what}: {', '.join(changes)}"


def draw_summary(
    file,
    name: str,
    objectives,
    evaluation: pd.DataFrame,
    years: pd.DataFrame | None,
    folder: Path,
    comparison: Comparison | None,
    course: Course | None,
):
    """PNG of the learning curves and of the evaluation; of a fixed strategy, its stand's years instead of the curves.

    comparison, course : with what one can do without looking; None where that is not known.
    """
    from matplotlib.figure import Figure

    learns = (folder / "episodes.csv").exists()
    played = pd.DataFrame() if course is None else pd.read_csv(folder / "validation.csv")
    draws = [_draw_gains] if comparison is not None else []
    draws += [_draw_trade_off if len(objectives) == 2 else _draw_parallel] if learns else [_draw_episodes]
    points = evaluation
    if learns and comparison is not None:  # what these two draw are gains then
        points = pd.concat([comparison.gains[name].assign(policy=name) for name in (*POLICIES, "best")])
    used = (len(objectives) + 1 if learns else 3) + len(draws)
    rows = math.ceil(used / 2)
    figure = Figure(figsize=(10, 3.5 * rows), layout="constrained")
    scores = (
        ""
        if comparison is None
        else "\n" + ", ".join(f"{policy} score {comparison.score(policy):z.0f}" for policy in POLICIES)
    )
    figure.suptitle(name + scores)
    axes = figure.subplots(rows, 2).ravel()
    if len(played):
        _draw_course(axes, objectives, course, played)
    elif learns:
        _draw_learning(axes, objectives, pd.read_csv(folder / "episodes.csv"))
    else:
        _draw_years(axes, of_last_weights(years, objectives))
    for ax, draw in zip(axes[used - len(draws) :], draws, strict=False):
        draw(figure, ax, objectives, points if draw is not _draw_gains else comparison)
    for ax in axes[used:]:
        ax.set_axis_off()
    figure.savefig(file, format="png", dpi=120)


def of_last_weights(table: pd.DataFrame, objectives) -> pd.DataFrame:
    """Rows of the primary policy at the last weights, in ascending order."""
    weights = fronts.weight_columns(objectives)
    last = table[weights].drop_duplicates().sort_values(weights).iloc[-1]
    return table[(table.policy == PRIMARY) & (table[weights] == last).all(axis=1)]


def _draw_gains(figure, ax, objectives, comparison: Comparison) -> None:
    """Scalarised gains by weight, beside those of what does not look."""
    means = comparison.by_weight
    x = means.index if len(objectives) == 2 else np.arange(len(means))
    styles = {
        "best": ("k:", "best constant plan of each weight (100)"),
        "plus_100": ("k--", "+100 a year"),
        "greedy": ("o-", "greedy policy"),
        "sampled": ("^-", "sampled policy"),
    }
    for name, (style, label) in styles.items():
        ax.plot(x, means[name], style, markersize=5, label=label)
    zero = comparison.plans[comparison.plans.plan == NOTHING]
    grey = itertools.cycle(["--", "-.", ":"])
    for plan, rows in comparison.plans.groupby("plan"):
        if not plan.isdigit():  # a fixed strategy, of the evaluation that ships
            table = at_weights(rows, comparison.weights, comparison.utility)
            gained = by_weight(gains(table, zero, comparison.utility)).scalarized_return.mean()
            style = next(grey)
            ax.plot(x, gained, style, color="0.6", linewidth=0.9, label=plan.replace("_", " "))
    ax.axhline(0, color="black", linewidth=0.8)
    ax.annotate("doing nothing (0)", (0.02, 0), xycoords=("axes fraction", "data"), va="bottom", fontsize=8)
    label = f"{objectives[0]} weight" if len(objectives) == 2 else "weight (number in the table)"
    ax.set(xlabel=label, ylabel="gain", title="evaluation, gain over doing nothing")
    ax.xaxis.get_major_locator().set_params(integer=len(objectives) != 2)
    ax.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=2)


def _draw_course(axes, objectives, course: Course, table: pd.DataFrame) -> None:
    """Gains on the validation sites: scalarised in the mean of the weights, and of each objective by weight."""
    weights, marks = fronts.weight_columns(objectives), course.marks
    steps = table.global_step.unique()
    ax, *others = axes[: len(objectives) + 1]
    ax.plot(steps, table.groupby("global_step").scalarized_gain.mean(), "o-", markersize=5, label="greedy policy")
    lines = (("best", ":", "best constant plan of each weight (100)"), ("plus_100", "--", "+100 a year"))
    for name, style, label in lines:
        ax.axhline(marks[name].scalarized_gain.mean(), linestyle=style, color="black", label=label)
    ax.set(ylabel="gain", title=f"training, gain over doing nothing on {course.where}")
    for one, column in zip(others, gain_columns(objectives), strict=False):
        for k, (key, rows) in enumerate(table.groupby(weights)):
            label, colour = f"{objectives[0]} weight " if len(key) == 1 else "weights ", f"C{k}"
            label += " ".join(f"{weight:.2g}" for weight in key)
            one.plot(steps, rows[column], "o-", markersize=4, color=colour, label=label)
            one.axhline(marks["best"][column][k], linestyle=":", color=colour)
        one.axhline(marks["plus_100"][column][0], linestyle="--", color="black")
        one.set(ylabel=column.replace("_", " "))
    for one in (ax, *others):
        one.axhline(0, color="black", linewidth=0.8)
        one.annotate("doing nothing", (0.02, 0), xycoords=("axes fraction", "data"), va="bottom", fontsize=8)
        one.set(xlabel="environment steps", xlim=(0, None))
        one.locator_params(axis="x", nbins=5)
        one.legend(fontsize=7)


def _draw_learning(axes, objectives, episodes: pd.DataFrame) -> None:
    """Returns of the training's episodes, of an environment where what doing nothing returns is not known."""
    columns = [*fronts.return_columns(objectives), "scalarized_return"]
    colours = [COLOURS[k % len(COLOURS)] for k in range(len(objectives))] + ["black"]
    for ax, column, colour in zip(axes, columns, colours, strict=False):
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
    for ax, (variable, label) in zip(axes, labels.items(), strict=False):
        rows = years[years.variable == variable]
        ax.fill_between(rows.year, rows.p10, rows.p90, alpha=0.3, label="80 % of the episodes")
        ax.plot(rows.year, rows["mean"], label="mean")
        ax.set(xlabel="year", ylabel=label)
        ax.legend(fontsize=8)


def what_is_shown(table: pd.DataFrame) -> str:
    """Returns, or gains if the table has the best constant plans' too."""
    return "gain" if (table.policy == "best").any() else "return"


def _draw_trade_off(figure, ax, objectives, evaluation: pd.DataFrame) -> None:
    (first, second), what = objectives, what_is_shown(evaluation)
    returns = fronts.return_columns((second, first))
    for policy, marker in (("greedy", "o"), ("sampled", "^")):
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
    if what == "gain":
        best = evaluation[evaluation.policy == "best"].groupby("preference")[returns].mean()
        ax.plot(best[returns[0]], best[returns[1]], "kx:", markersize=5, linewidth=0.8, label="best constant plans")
        ax.plot(0, 0, "k+", markersize=9, label="doing nothing")
    ax.set(xlabel=f"mean {second} {what}", ylabel=f"mean {first} {what}", title="evaluation, one point per weight")
    ax.locator_params(nbins=6)
    ax.ticklabel_format(useOffset=False)
    ax.legend(fontsize=8)
    figure.colorbar(points, ax=ax, label=f"{first} weight")


def _draw_parallel(figure, ax, objectives, evaluation: pd.DataFrame) -> None:
    """A line per weight of the primary policy's mean returns, in the colour of the objective that weighs most."""
    weights, returns = fronts.weight_columns(objectives), fronts.return_columns(objectives)
    means = evaluation[evaluation.policy == PRIMARY].groupby(weights)[returns].mean()
    for its_weights, values in means.iterrows():
        heaviest = max(range(len(objectives)), key=lambda k: its_weights[k])
        ax.plot(range(len(objectives)), values, "o-", color=COLOURS[heaviest % len(COLOURS)], alpha=0.7)
    for k, name in enumerate(objectives):
        ax.plot([], [], "o-", color=COLOURS[k % len(COLOURS)], label=f"{name} weighs most")
    ax.set_xticks(range(len(objectives)), objectives)
    ax.set(ylabel=f"mean {what_is_shown(evaluation)}", title=f"evaluation, {PRIMARY} policy, one line per weight")
    ax.legend(fontsize=8)


def _draw_episodes(figure, ax, objectives, evaluation: pd.DataFrame) -> None:
    evaluation = of_last_weights(evaluation, objectives)
    first, second = objectives[:2]
    x, y = evaluation[f"{second}_return"], evaluation[f"{first}_return"]
    ax.plot(x, y, ".", color="grey", label="episode")
    ax.plot(x.mean(), y.mean(), "k*", markersize=12, label="mean")
    ax.set(xlabel=f"{second} return", ylabel=f"{first} return", title="evaluation")
    ax.legend(fontsize=8)
