"""Why thaw is harder to learn than carbon: what returns vary with, one action's effect against the noise, and when it
comes."""

import numpy as np

from analysis.figures.common import finish, no_data, panels
from analysis.studies.open_loop import OBJECTIVES
from analysis.studies.signal_to_noise import CONTRASTS, UNIFORM, WEIGHTINGS
from analysis.tables.learning_difficulty import YEAR, variance_components
from boreal_env import DEFAULT_YEARS
from cleanrl_style.protocol.arguments import DEFAULT_STEPS

SIZE = (7, 5.8)
COURSE, COURSE_YEAR = "conifers, not deciduous", "0"  # both of its effects can be told from none
MADE_BY = "python analysis/studies/variance.py && python analysis/reproduce.py --only difficulty"
CAPTION = (
    f"(b)-(d) one action in year {YEAR}, (c) {COURSE_YEAR}, under uniformly random valid actions, the same sites and "
    "weathers with either; intervals: 95 %, bootstrap over sites. (b) sizes, signs aside; an interval to the left edge "
    "reaches 0. (c) means alone. (d) half of the episodes have either action; dashed line: those of a training run; an "
    "interval to the right edge has no end; diamonds: of the effect as a generalised advantage (GAE) sees it, which "
    "may have the other sign. (b, d) Green: carbon, blue: thaw."
)
COMPONENTS = {"site": "#0072B2", "weather": "#56B4E9", "policy": "#D55E00", "site x policy": "#E69F00"}
REST = "#DDDDDD"
OF = {"carbon": ("#009E73", "o"), "thaw": ("#0072B2", "s")}
TRAINING_EPISODES = DEFAULT_STEPS["generalist"] // DEFAULT_YEARS


def draw(figure, results) -> None:
    """Shares of the variance; effect and noise; the effect's course; episodes needed."""
    variance, noise, course, needed = panels(
        figure,
        2,
        2,
        [
            "what varies",
            "an action's effect and the noise",
            "conifers, not deciduous: when the effect comes",
            "episodes to tell two actions apart",
        ],
    )
    draw_variance(variance, variance_components(results))
    table, years = results.study("signal_to_noise"), results.study("signal_to_noise_years")
    if table is None or years is None:
        for ax in (noise, course, needed):
            no_data(ax, "python analysis/studies/signal_to_noise.py")
        return
    cases = table[(table.reference == UNIFORM) & (table.year == YEAR)].set_index(["weighting", "contrast", "objective"])
    draw_noise(noise, cases.loc["return"])
    draw_course(course, years[(years.reference == UNIFORM) & (years.year == COURSE_YEAR)])
    draw_needed(needed, cases)


def draw_variance(ax, components) -> None:
    """Stacked shares of the variance of returns and of one year's rewards."""
    if components is None:
        no_data(ax, "python analysis/studies/variance.py")
        return
    shares = components.set_index(["value", "objective", "component"]).share
    bars = [("return", "carbon"), ("return", "thaw"), ("one year", "carbon"), ("one year", "thaw")]
    left = np.zeros(len(bars))
    for component, colour in COMPONENTS.items():
        widths = np.array([100 * shares[(*bar, component)] for bar in bars])
        ax.barh(range(len(bars)), widths, left=left, color=colour, label=component.replace(" x ", " × "))
        left += widths
    ax.barh(range(len(bars)), 100 - left, left=left, color=REST, label="rest")
    ax.set_yticks(range(len(bars)), [f"{objective},\n{value}" for value, objective in bars])
    ax.invert_yaxis()
    ax.set_xlim(0, 100)
    ax.set_xlabel("share of the variance (%)")
    ax.legend(ncol=3, loc="upper center", bbox_to_anchor=(0.45, -0.2), fontsize=6)


def rows_of(ax) -> list[tuple[str, str]]:
    """Label the rows of a panel: each contrast with either objective."""
    rows = [(contrast, objective) for contrast in CONTRASTS for objective in OBJECTIVES]
    ax.set_yticks(range(len(rows)), [f"{contrast}: {objective}" for contrast, objective in rows], fontsize=6)
    ax.set_ylim(len(rows) - 0.5, -0.5)
    ax.set_xscale("log")
    return rows


def around(values, low: float, high: float) -> tuple[float, float]:
    """Limits of a logarithmic axis that all values lie well within, at least low to high."""
    known = values[np.isfinite(values) & (values > 0)]
    return min(low, known.min() / 3), max(high, 2 * known.max())


def draw_noise(ax, cases) -> None:
    """Size of the effect with its interval, and the noise with and without the site's mean taken off."""
    rows = rows_of(ax)
    shown = cases.loc[rows]
    limits = around(np.concatenate([shown.effect.abs(), shown.noise, shown.site_noise]), 1e-3, 40)
    for k, row in enumerate(rows):
        case, (colour, marker) = cases.loc[row], OF[row[1]]
        ends = np.sort(np.sign(case.effect) * np.array([case.effect_low, case.effect_high]))
        # an interval that reaches 0 has no lower end on a logarithmic axis
        ax.plot(np.maximum(ends, limits[0]), [k, k], color=colour, linewidth=1.5)
        ax.plot(abs(case.effect), k, marker, color=colour, markersize=5, label="effect" if k == 0 else None)
        for column, symbol, label in (("site_noise", "<", "site baseline"), ("noise", "x", "no baseline")):
            ax.plot(
                case[column],
                k,
                symbol,
                color="black",
                markersize=5,
                markerfacecolor="none",
                label=f"noise, {label}" if k == 0 else None,
            )
    ax.set_xlim(limits)
    ax.set_xlabel("return to go")
    ax.legend(ncol=3, loc="upper center", bbox_to_anchor=(0.2, -0.2), fontsize=6)


def draw_course(ax, years) -> None:
    """The effect so far as a share of the whole, and how much later rewards weigh in an advantage."""
    for objective, (colour, marker) in OF.items():
        effect = years[(years.contrast == COURSE) & (years.objective == objective)].effect.to_numpy()
        ax.plot(
            np.cumsum(effect) / effect.sum(),
            color=colour,
            marker=marker,
            markevery=5,
            markersize=3,
            label=f"{objective}: effect so far",
        )
    after = np.arange(len(effect))
    for name, style in (("discounted", ":"), ("GAE", "--")):
        weight = WEIGHTINGS[name] ** after
        ax.plot(after, weight, style, color="black", linewidth=1, label=f"weight of the year's reward, {name}")
    ax.axhline(0, color="#999999", linewidth=0.5)
    finish(ax, xlabel="years after the action", ylabel="share of the whole effect; weight")
    ax.legend(ncol=2, loc="upper center", bbox_to_anchor=(0.45, -0.2), fontsize=6)


def draw_needed(ax, cases) -> None:
    """Episodes without a baseline, with the site's, and with the site's in a generalised advantage."""
    rows = rows_of(ax)
    kinds = (
        ("return", "episodes", "x", "no baseline"),
        ("return", "site_episodes", "o", "site baseline"),
        ("GAE", "site_episodes", "D", "site baseline, GAE"),
    )
    marks = [case for weighting, column, *_ in kinds for case in cases.loc[weighting].loc[rows, column]]
    limits = around(np.array(marks), 30, 1e9)
    for weighting, column, symbol, label in kinds:
        for k, row in enumerate(rows):
            case = cases.loc[(weighting, *row)]
            most = min(case[f"{column}_high"], limits[1])
            shift = 0.2 * (kinds.index((weighting, column, symbol, label)) - 1)
            ax.plot([case[f"{column}_low"], most], [k + shift] * 2, color=OF[row[1]][0], linewidth=1)
            ax.plot(
                case[column],
                k + shift,
                symbol,
                color=OF[row[1]][0],
                markersize=4,
                markerfacecolor="white",
                label=label if k == 0 else None,
            )
    ax.axvline(TRAINING_EPISODES, linestyle="--", color="black", linewidth=0.8)
    ax.set_xlim(limits)
    ax.set_xlabel("episodes")
    ax.legend(ncol=3, loc="upper center", bbox_to_anchor=(0.2, -0.2), fontsize=6)
