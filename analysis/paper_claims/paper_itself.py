"""The paper against itself: what its tables say of each other. Nothing here is ours."""

from dataclasses import replace
from functools import cache, partial
from itertools import permutations
from math import factorial

import numpy as np
import pandas as pd

from analysis import methods, metrics
from analysis.paper_claims.claim import ARITHMETIC, CONTRADICTS, UNTESTABLE, Answer, Row, finding, short
from analysis.paper_claims.claim import claim as claim_of_any_kind
from analysis.tables.common import paper
from analysis.tables.main_results import paper_rows

TITLE = "The paper's tables against each other"
claim = partial(claim_of_any_kind, kind=ARITHMETIC)
NAMES = {method.paper: method.title for method in methods.ROWS}
# pairs of weights behind the percentages of violations, by the weights that the paper shows
PAIRS = {"curriculum_ppo": 4, "fixed_weight_eupg": 4, "eupg_variable_lambda": 9, "ppo_gated": 5}


def details() -> dict[str, pd.DataFrame]:
    """The paper's detailed objectives by method."""
    return dict(list(paper("detailed_objectives").groupby("method", sort=False)))


def front(table: pd.DataFrame) -> np.ndarray:
    """Mean returns by weight, (weights, 2)."""
    return table[["carbon_mean", "thaw_mean"]].to_numpy()


def compared(name: str, detail: str, tolerance: float, what: str):
    """The finding on a column of the main table that the table of details should give too."""
    table = paper_rows().loc[list(details())]
    rows = [
        Row(f"{what}, {NAMES[method]}", f"{short(row[name])} printed", f"{short(row[detail])} from its details")
        for method, row in table.iterrows()
    ]
    same = bool((abs(table[name] - table[detail]) <= tolerance * table[detail].abs()).all())
    return finding(rows, Answer(same, f"all agree within {short(100 * tolerance)} %"), CONTRADICTS)


@claim(
    "Hypervolumes above (−2, −2) are 84.3, 23.6 and 14.2.",
    "Table 2 against the table of detailed objectives",
    note="The scalarised rewards below show that the details are of the same evaluation. EUPG's details lack some "
    "of its weights; more points can only enlarge a hypervolume. The paper does not say what its own are of, and those "
    "of its heuristics are of more than mean returns.",
)
def hypervolumes(evidence):
    return replace(compared("paper_hypervolume", "paper_detail_hypervolume", 0.05, "hypervolume"), verdict=UNTESTABLE)


@claim(
    "Sparsities are 0.12, 0.09 and 0.07.",
    "Table 2 against the table of detailed objectives",
    note="Sparsity as in morl-baselines, whose EUPG the paper uses; the paper does not define it. A front of a few "
    "points that spans several units cannot have gaps this small; one divided by some scale can.",
)
def sparsities(evidence):
    return replace(compared("paper_sparsity", "paper_detail_sparsity", 0.05, "sparsity"), verdict=UNTESTABLE)


@claim(
    "Mean scalarised rewards are 8.5, 4.7 and 1.7.",
    "Table 2 against the table of detailed objectives",
    note="So the details are of the same evaluation as the main table.",
)
def scalarised(evidence):
    rows, same = [], []
    for method, table in details().items():
        printed = paper("main_results", index_col="method").scalarized_mean[method]
        ours = metrics.scalarize(front(table), metrics.pair(table.lambda_carbon)).mean()
        rows.append(Row(f"scalarised, {NAMES[method]}", f"{short(printed)} printed", f"{short(ours)} from its details"))
        same.append(abs(ours - printed) <= 0.0501)
    return finding(rows, Answer(all(same), "all agree within the rounding of one decimal"), CONTRADICTS)


@claim(
    "Scalarised rewards scatter by 3.0, 6.0 and 5.0 between episodes.",
    "Table 2 against the details",
    note="The bound takes carbon and thaw to move together in every episode, which makes the scatter of their "
    "weighted sum as large as it can be, and adds that of the means between weights (EUPG's: those shown).",
)
def spreads(evidence):
    rows, possible = [], []
    for method, table in details().items():
        weights = metrics.pair(table.lambda_carbon)
        most = metrics.scalarize(table[["carbon_std", "thaw_std"]].to_numpy(), weights)
        means = metrics.scalarize(front(table), weights)
        bound = np.sqrt((most**2).mean() + means.var(ddof=0))
        printed = paper("main_results", index_col="method").scalarized_std[method]
        rows.append(
            Row(
                f"standard deviation, {NAMES[method]}",
                f"{short(printed)} printed",
                f"at most {short(bound)} by its details",
            )
        )
        possible.append(printed <= 1.05 * bound)
    return finding(rows, Answer(all(possible), "none is larger than its bound by more than a twentieth"), CONTRADICTS)


@claim(
    "Heuristics, one point each, have hypervolumes of 11.3 to 21.4.",
    "Table 2",
    note="Averaged over weights that are symmetric about one half, the scalarised reward of one point is the mean "
    "of its two returns. With that mean given, the rectangle above the reference point is largest if both "
    "returns are equal, and empty if the mean is below the reference's. The paper's may be of single "
    "episodes, whose front can be larger, and which are not published.",
)
def heuristic_hypervolumes(evidence):
    table, rows, possible = paper("main_results"), [], []
    for row in table[table.kind == "heuristic"].itertuples():
        side = max(row.scalarized_mean - metrics.REFERENCE_POINT, 0.0)
        rows.append(
            Row(
                f"hypervolume, {NAMES[row.method]} (scalarised {short(row.scalarized_mean)})",
                f"{short(row.hypervolume)} printed",
                f"at most {short(side**2)} as one point",
            )
        )
        possible.append(row.hypervolume <= side**2)
    return finding(rows, Answer(all(possible), "every one is possible"), UNTESTABLE)


@claim("PPO Gated's mean returns are 7.8 and 1.5, under the asymmetric reward.", "Table 3 against the details")
def gated_means(evidence):
    printed = paper("thaw_formulations", index_col="formulation").loc["asymmetric"]
    means = details()["ppo_gated"][["carbon_mean", "thaw_mean"]].mean()
    rows = [
        Row(name, f"{short(printed[f'{name}_mean'])} printed", f"{short(means[f'{name}_mean'])} from its details")
        for name in ("carbon", "thaw")
    ]
    same = all(abs(printed[name] - means[name]) <= 0.0501 for name in means.index)
    return finding(rows, Answer(same, "both agree within the rounding of one decimal"), CONTRADICTS)


@claim(
    "Learned strategies lead to thaw returns of about −5, 8 and 6.",
    "Table of learned strategies against details",
    note='The text below the details says that Variable λ EUPG "clusters near zero" in both objectives.',
)
def strategies(evidence):
    printed, rows, possible = paper("learned_strategies", index_col="method"), [], []
    for method, table in details().items():
        for name, value in (("carbon", printed.carbon[method]), ("thaw", printed.thaw_or_warming[method])):
            low, high = table[f"{name}_mean"].min(), table[f"{name}_mean"].max()
            rows.append(
                Row(
                    f"{name}, {NAMES[method]}",
                    f"about {short(value)}",
                    f"{short(low)} to {short(high)} by weight in its details",
                )
            )
            possible.append(low - 0.5 <= value <= high + 0.5)
    return finding(rows, Answer(all(possible), "each lies among its weights, give or take half a unit"), CONTRADICTS)


@claim(
    "PPO Gated warms the ground strongly (about −5), and PPO Gated under the same reward hardly (about 0.1 MJ).",
    "Table of learned strategies against the table of thaw penalties",
    note="The asymmetric formulation of the second table is the default: the same agents as in the first, by their "
    "scalarised reward and hypervolume.",
)
def gated_warming(evidence):
    gated = paper("learned_strategies", index_col="method").thaw_or_warming["ppo_gated"]
    formulation = paper("thaw_formulations", index_col="formulation").loc["asymmetric"]
    main = paper("main_results", index_col="method").loc["ppo_gated"]
    rows = [
        Row('"high warming", table of strategies', short(gated), "warms"),
        Row("warming flux, table of thaw penalties [MJ]", short(formulation.warming_flux_mj), "hardly warms"),
        Row("mean thaw return, table of formulations", short(formulation.thaw_mean), "cools"),
    ]
    same_agents = formulation.hypervolume == main.hypervolume and formulation.scalarized_mean == main.scalarized_mean
    warms, cools = gated < 0, formulation.thaw_mean > 0
    return finding(rows, Answer(not (same_agents and warms and cools), "the same agents have one sign"), CONTRADICTS)


@claim(
    "λ-monotonicity is violated in 50 % (Curriculum), 66.7 % (Variable λ EUPG) and 100 % (PPO Gated) of the pairs.",
    "Appendix, λ-monotonicity, against the details",
    note="EUPG's table shows six of the ten weights that its percentage and its odd weights point to, so its "
    "percentage cannot be checked.",
)
def violations(evidence):
    printed, rows, same = paper("monotonicity_violations", index_col="method").violations_percent, [], []
    for method, table in details().items():
        ours = metrics.violations_percent(front(table))
        rows.append(
            Row(
                f"violations, {NAMES[method]}",
                f"{short(printed[method])} %",
                f"{short(ours)} % of the {len(table) - 1} pairs shown",
            )
        )
        same.append(abs(ours - printed[method]) < 0.1 or len(table) - 1 < PAIRS[method])
    return finding(rows, Answer(all(same), "those that can be checked agree"), CONTRADICTS)


@cache
def chance_of_kept(points: int) -> np.ndarray:
    """Probability that k = 0 .. points - 1 of the adjacent pairs keep monotonicity if both returns are noise.

    Without ties and with independent returns, a pair is kept if carbon rises and thaw falls: if two random orders
    both rise there. With p(S) the share of orders that rise exactly at the pairs S (counted by recursion over the rank
    of the last element), the probability is the sum of p(S) p(T) over all S and T with k pairs in common.
    """
    pairs = points - 1
    subsets = np.arange(2**pairs)
    shares = np.empty(len(subsets))
    for subset in subsets:
        ways = [1]
        for pair in range(pairs):
            rises = subset >> pair & 1
            ways = [sum(ways[:rank]) if rises else sum(ways[rank:]) for rank in range(len(ways) + 1)]
        shares[subset] = sum(ways) / factorial(points)
    common = np.bitwise_count(subsets[:, None] & subsets)
    return np.bincount(common.ravel(), weights=np.outer(shares, shares).ravel(), minlength=points)


def chance_of_at_most(violations_percent: float, pairs: int) -> float:
    """Probability that noise violates at most so many of the pairs."""
    violated = round(violations_percent / 100 * pairs)
    return float(chance_of_kept(pairs + 1)[pairs - violated :].sum())


def chance_of_slope(table: pd.DataFrame) -> float:
    """Probability that a random order of the weights follows the preference as well as the printed one, or better.

    How well: carbon's slope against its weight less thaw's. All orders are tried.
    """
    weights = table.lambda_carbon.to_numpy()
    centred = weights - weights.mean()
    apart = front(table) @ [1.0, -1.0]
    orders = np.array(list(permutations(range(len(apart)))))
    return float((apart[orders] @ centred >= apart @ centred - 1e-9).mean())


@claim(
    "Curriculum PPO controls the trade-off reliably; the others do not.",
    "Appendix, λ-monotonicity, against the details",
    note="By the slopes of its own details, tested against all orders of the weights. Its own measure, violations, "
    "could not tell: if both returns are independent noise, three pairs of four are violated, whatever the number of "
    "weights. The probabilities are exact. That chance does as well as the others more often than once in twenty does "
    "not show that they follow nothing.",
)
def control_by_chance(evidence):
    printed, rows = paper("monotonicity_violations", index_col="method").violations_percent, []
    chances = {method: chance_of_slope(table) for method, table in details().items()}
    for method, table in details().items():
        ends = front(table)[table.lambda_carbon.to_numpy().argsort()]
        changes = " and ".join(short(change) for change in ends[-1] - ends[0])
        rows.append(
            Row(
                f"{NAMES[method]}, {len(table)} weights: carbon and thaw, last less first",
                changes,
                f"as well or better in {short(100 * chances[method])} % of the orders",
            )
        )
    for method, pairs in PAIRS.items():
        kept = chance_of_kept(pairs + 1)
        expected = 100 * (1 - kept @ np.arange(pairs + 1) / pairs)
        chance = chance_of_at_most(printed[method], pairs)
        rows.append(
            Row(
                f"violations, {NAMES[method]}, {pairs} pairs",
                f"{short(printed[method])} %",
                f"noise: {short(expected)} % on average; as few or fewer in {short(100 * chance)} % of cases",
            )
        )
    one = chances["curriculum_ppo"] < 0.05 <= min(chances[name] for name in chances if name != "curriculum_ppo")
    rule = "chance does as well as Curriculum PPO in less than 5 % of the orders, and as the others in more"
    return finding(rows, Answer(bool(one), rule), CONTRADICTS)


@claim("Training takes 8 to 12 hours at 5 to 7 seconds an episode.", "Appendix, runtime")
def training_time(evidence):
    printed = paper("runtime", index_col="quantity")
    episode, training = printed.loc["episode_50_years_numba"], printed.loc["training_generalist_300k_steps"]
    episodes = 300_000 // 50
    low, high = (seconds * episodes / 3600 for seconds in (episode.low, episode.high))
    rows = [
        Row(
            "hours of 300,000 steps",
            f"{training.low:g} - {training.high:g} printed",
            f"{short(low)} - {short(high)} from the time of an episode",
        )
    ]
    meets = low <= training.high and high >= training.low
    return finding(rows, Answer(meets, "the two ranges overlap"), CONTRADICTS)


CLAIMS = (
    hypervolumes,
    sparsities,
    scalarised,
    spreads,
    heuristic_hypervolumes,
    gated_means,
    strategies,
    gated_warming,
    violations,
    control_by_chance,
    training_time,
)
