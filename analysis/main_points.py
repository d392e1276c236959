"""What README.md and docs/results.md say first: rows of the main table, and what all its rows say, in words.

Methods are compared with each other and with one plan that looks at nothing by the interval of their difference on the
same sites, over training seeds and sites; with 100, the best constant plans of these sites, by the interval of the
score, in which every drawn set of sites has its own.
"""

import textwrap

import numpy as np
import pandas as pd

import boreal_env
from analysis import methods, metrics
from analysis.experiments import BALANCED, GENERALIST, WEIGHTS
from analysis.paper_claims.claim import FEWEST_SEEDS
from analysis.results import PAIR
from analysis.tables import main_results
from analysis.tables.common import score_text

WORLDS = (BALANCED, GENERALIST)
BEST_PLAN, DECIDUOUS = "best_constant_mix", "dense_deciduous"
PLANTING = ("plus_100", "")
GROUP = "ppo_group"
LEARNED = ("eupg_var_lambda", "ppo_gated", "ppo_curriculum", GROUP, "plan_regression")
"""Rows of the README below the plans that look at nothing."""
MORE_STEPS = (1_000_000, 3_000_000)  # of Group PPO
SPLITS = 1000  # of the test sites into random halves
NOT_RUN = "Not run yet: `python analysis/reproduce.py --only main balanced`.\n"


def default_rows(results, env_id: str) -> dict[tuple[str, str], list]:
    """(Script, flags that make it a method) -> its runs in an environment, as the method's defaults are."""
    return {
        (script, flags): replicates
        for (script, its_env, setting), replicates in results.rows_of_two_objectives().items()
        if its_env == env_id and replicates
        for flags in (methods.flags(setting),)
        if not flags or (script, flags) in methods.BY_FLAGS
    }


def blind(results, env_id: str, name: str) -> list:
    """A constant plan, or the best of each weight, as `default_rows` has its rows; empty if its study is not there."""
    return main_results.constant_plans(results)[name, env_id, "default"]


def shown(scores: dict) -> str:
    """The greedy score with its interval; empty where it is not known."""
    return score_text(*(scores.get(f"score_greedy{part}", np.nan) for part in ("", "_low", "_high")))


def short_table(results) -> str:
    """Scores of two plans that look at nothing and of trained methods, in both worlds; Group PPO with more steps, too.

    That of a single training is not shown: another seed's may be far from it.
    """
    rows = {env_id: default_rows(results, env_id) for env_id in WORLDS}
    text = "| method | training seeds | " + " | ".join(f"`{env_id}`" for env_id in WORLDS) + " |\n" + "|---" * 4 + "|\n"
    plans = {
        methods.title(*PLANTING): [rows[env_id].get(PLANTING, []) for env_id in WORLDS],
        main_results.CONSTANT_PLANS[DECIDUOUS][0]: [blind(results, env_id, DECIDUOUS) for env_id in WORLDS],
    }
    for title, of_worlds in plans.items():
        text += f"| {title} | | {' | '.join(shown(main_results.scores(one)) if one else '' for one in of_worlds)} |\n"
    for script in LEARNED:
        of_worlds = [rows[env_id].get((script, ""), []) for env_id in WORLDS]
        seeds = " and ".join(dict.fromkeys(str(len(replicates)) for replicates in of_worlds if replicates))
        cells = [shown(main_results.scores(one)) if len(one) > 1 else "" for one in of_worlds]
        text += f"| {methods.title(script)} | {seeds or 'not run yet'} | {' | '.join(cells)} |\n"
        if script == GROUP:
            text += "".join(of_more_steps(results, steps) for steps in MORE_STEPS)
    return text


def of_more_steps(results, steps: int) -> str:
    """Group PPO's row with so many steps; none until both worlds have several seeds."""
    of_worlds = [with_more_steps(results, env_id, steps) for env_id in WORLDS]
    if min(map(len, of_worlds)) < 2:
        return ""
    values = " | ".join(shown(main_results.scores(replicates)) for replicates in of_worlds)
    seeds = " and ".join(dict.fromkeys(str(len(replicates)) for replicates in of_worlds))
    return f"| {methods.title(GROUP)}, {steps:,} steps | {seeds} | {values} |\n"


def with_more_steps(results, env_id: str, steps: int) -> list:
    """Group PPO's runs with so many steps in a world."""
    setting = f"total_timesteps={steps}, vectorization=lockstep"
    return results.rows_of_two_objectives().get((GROUP, env_id, setting), [])


def on_sites(replicates: list) -> pd.DataFrame:
    """What the greedy policies gain, (seeds, sites)."""
    return pd.DataFrame([metrics.of_sites(one.by_policy["greedy"]) for one in replicates])


def ends_of_difference(replicates: list, other: list) -> tuple[float, float]:
    """Ends of both 95 % intervals of what one gains more: over seeds and sites, and by Welch's t over seeds.

    Of a plan or a single training, which has no seeds to differ, the other's seeds alone count.
    """
    first, second = on_sites(replicates), on_sites(other)
    _, low, high = metrics.difference_interval(first, second)
    t_low, t_high = metrics.welch_interval(first.mean(axis=1), second.mean(axis=1))
    return min(low, t_low), max(high, t_high)


def is_above(replicates: list, other: list) -> bool:
    """Whether all of both intervals of the difference lies above 0; never of a single training, which has none."""
    return len(replicates) > 1 and ends_of_difference(replicates, other)[0] > 0.0


def is_below(replicates: list, other: list) -> bool:
    """Whether all of them lies below 0."""
    return len(replicates) > 1 and ends_of_difference(replicates, other)[1] < 0.0


def ends_of_score(scores: dict, replicates: list, best_plans: list) -> tuple[float, float]:
    """Ends of both 95 % intervals of a greedy score: over seeds and sites, and by t over seeds."""
    whole = on_sites(best_plans).to_numpy().mean()
    by_t = 100 * np.array(metrics.mean_interval(on_sites(replicates).mean(axis=1))) / whole
    return metrics.both_ends(scores["score_greedy_low"], scores["score_greedy_high"], *by_t)


def beside_100(low: float, high: float) -> int:
    """1 of a score whose intervals lie above 100, -1 of one below, 0 of one that has 100 in them."""
    return int(low > 100.0) - int(high < 100.0)


def points(replicates: list, other: list, best_plans: list) -> str:
    """The difference with its interval, in percent of what the best constant plans gain."""
    found = metrics.difference_interval(on_sites(replicates), on_sites(other))
    value, low, high = 100 * np.array(found) / on_sites(best_plans).to_numpy().mean()
    return f"{value:.1f}" if len(replicates) < 2 else f"{value:.1f} [{low:.1f}, {high:.1f}]"


def gain_hypervolume(replicates: list) -> float:
    """Of the greedy policies' mean gains, over training seeds."""
    gains = pd.DataFrame([main_results.gain_metrics(one.gains) for one in replicates])
    return main_results.over_seeds(gains)["gain_hypervolume"]


def front_of_plans(results, env_id: str) -> float:
    """Gain hypervolume of all constant plans together."""
    plans = results.constant_plans_in(env_id, "asymmetric", None)
    means = plans.groupby("action")[metrics.return_columns(metrics.objectives_of(plans.columns))].mean()
    return metrics.hypervolume((means - means.loc[boreal_env.NO_CHANGE]).to_numpy(), 0.0)


def flattery(results, env_id: str) -> float:
    """What the best constant plan of each weight gains less on sites that it was not chosen on [%].

    Chosen on one half of the test sites and judged on the other, mean of `SPLITS` divisions at random, against chosen
    and judged on all.
    """
    plans = results.constant_plans_in(env_id, "asymmetric", None)
    returns = [plans.pivot(index="action", columns="seed", values=name) for name in metrics.return_columns(PAIR)]
    cube = np.einsum("mas,km->aks", np.array(returns), metrics.pair(np.array(WEIGHTS)))
    cube -= cube[returns[0].index.get_loc(boreal_env.NO_CHANGE)]
    everywhere, unseen = cube.mean(axis=2).max(axis=0).mean(), []
    generator, sites = np.random.default_rng(0), cube.shape[2]
    for _ in range(SPLITS):
        halves = np.array_split(generator.permutation(sites), 2)
        for chosen_on, judged_on in (halves, halves[::-1]):
            best = cube[:, :, chosen_on].mean(axis=2).argmax(axis=0)
            unseen.append(cube[:, :, judged_on].mean(axis=2)[best, np.arange(len(best))].mean())
    return 100 * (1 - np.mean(unseen) / everywhere)


def in_words(results) -> str:
    """A paragraph for each world: who is ahead, and whether the preference is followed."""
    paragraphs = [paragraph(results, env_id) for env_id in WORLDS]
    return "".join(paragraphs) or NOT_RUN


def paragraph(results, env_id: str) -> str:
    """What the main table says of one world; empty without trained methods or constant plans."""
    rows = default_rows(results, env_id)
    scores = {method: main_results.scores(replicates) for method, replicates in rows.items()}
    known = {method: its["score_greedy"] for method, its in scores.items() if not np.isnan(its["score_greedy"])}
    trained = [method for method in known if method[0] in methods.TRAINED]
    if not trained or PLANTING not in known:
        return ""
    deciduous, best_plans = blind(results, env_id, DECIDUOUS), blind(results, env_id, BEST_PLAN)
    plans = (
        f"Plans that look at nothing: 100 stems a year, half of them conifers, score {known[PLANTING]:.0f}, 100 "
        f"deciduous trees a year {shown(main_results.scores(deciduous))}. All constant plans together have a gain "
        f"hypervolume of {front_of_plans(results, env_id):.2f}. The best of each weight, which 100 stands for, gain "
        f"{flattery(results, env_id):.1f} % less when they are chosen on a half of the sites and judged on the other."
    )
    ahead = ranking({method: rows[method] for method in trained}, scores, rows[PLANTING], deciduous, best_plans)
    ahead += of_longer_trainings(results, env_id, best_plans)
    few = [method for method in trained if len(rows[method]) < FEWEST_SEEDS]
    if few:
        ahead += f" Few training seeds: {listed([f'{methods.title(*method)} {len(rows[method])}' for method in few])}."
    lacking = [methods.title(script) for script in methods.LEARNERS if (script, "") not in known]
    ahead += f" Not run yet: {listed(lacking)}." if lacking else ""
    followed = following({method: rows[method] for method in trained if len(rows[method]) >= FEWEST_SEEDS})
    return f"- **`{env_id}`**\n" + "".join(
        wrapped(f"  - {point[0].upper()}{point[1:]}") for point in (plans, ahead, followed)
    )


def ranking(rows: dict, scores: dict, planting: list, deciduous: list, best_plans: list) -> str:
    """Which trained method scores highest, and which are told from it, from 100 and from plans that look at nothing."""
    best = max(rows, key=lambda method: scores[method]["score_greedy"])
    alike = [
        method for method in rows if method != best and len(rows[method]) > 1 and not is_above(rows[best], rows[method])
    ]

    above_deciduous = [method for method in rows if is_above(rows[method], deciduous)]
    above_planting = [method for method in rows if is_above(rows[method], planting)]
    below = [method for method in rows if is_below(rows[method], planting)]
    beside = {
        method: beside_100(*ends_of_score(scores[method], rows[method], best_plans))
        for method in rows
        if len(rows[method]) > 1
    }
    over, even, under = ([method for method, side in beside.items() if side == which] for which in (1, 0, -1))
    alone = [method for method in rows if len(rows[method]) == 1]
    below_it = "all are below 100" if len(under) == len(rows) else f"{len(under)} below 100"
    below_it += f", {methods.title(*best)} too" if best in under and len(under) < len(rows) else ""
    text = (
        f"Of {len(rows)} trained method{'s' if len(rows) > 1 else ''} {methods.title(*best)} scores highest, "
        f"{shown(scores[best])} with {of_seeds(rows[best])} and a gain hypervolume of "
        f"{gain_hypervolume(rows[best]):.2f}"
    )
    text += f", not told apart from {listed(titles_of(alike))}." if alike else "."
    return text + (
        f" Its score less that of 100 deciduous trees a year is {points(rows[best], deciduous, best_plans)}. "
        f"By both intervals, that of seeds and sites and that of seeds alone by t, {named(over)} above 100"
        + (f", {named(even)} not told apart from 100" if even else "")
        + (f", {below_it}" if under else "")
        + (f", {named(alone)} of a single training, and not judged" if alone else "")
        + f"; {named(above_deciduous)} above 100 deciduous trees a year, {named(above_planting)} above +100 a year, "
        f"half conifers; {named(below)} below that."
    )


def of_longer_trainings(results, env_id: str, best_plans: list) -> str:
    """What Group PPO scores with `MORE_STEPS`, and whether that is told from 100; empty without such runs."""
    longer = {steps: with_more_steps(results, env_id, steps) for steps in MORE_STEPS}
    longer = {steps: replicates for steps, replicates in longer.items() if len(replicates) > 1}
    text = ""
    for steps, replicates in longer.items():
        its = main_results.scores(replicates)
        side = {1: "above 100", 0: "not told apart from 100", -1: "below 100"}[
            beside_100(*ends_of_score(its, replicates, best_plans))
        ]
        text += f" With {steps:,} steps and {of_seeds(replicates)} {methods.title(GROUP)} scores {shown(its)}, "
        text += f"{side}."
    if longer:
        more = listed([points(replicates, best_plans, best_plans) for replicates in longer.values()])
        text += " These intervals are of sites like these, which have other best constant plans and so another 100. "
        text += f"Against those of these very sites, taken as given, it gains {more} points more."
    return text


def responses(replicates: list) -> np.ndarray:
    """Change of the greedy policy's returns from the lowest to the highest weight, (returns, seeds, sites)."""
    return np.stack([metrics.response_of_sites(one.by_policy["greedy"]) for one in replicates], axis=1)


def ends(changes: np.ndarray) -> tuple[float, float]:
    """Ends of both 95 % intervals of a change (seeds, sites): over seeds and sites, and by t over seeds."""
    _, low, high = metrics.score_interval(changes, None)
    return metrics.both_ends(low, high, *metrics.mean_interval(changes.mean(axis=1)))


def following(rows: dict[tuple[str, str], list]) -> str:
    """Which methods follow the preference: neither interval may hold 0."""
    if not rows:
        return f"Whether a method follows the preference is said from {FEWEST_SEEDS} training seeds on."
    changes = {method: responses(replicates) for method, replicates in rows.items()}
    unmoved = [method for method, change in changes.items() if not change.any()]
    carbon, thaw = ({method: ends(change[k]) for method, change in changes.items()} for k in (0, 1))
    more_carbon = [method for method, (low, _) in carbon.items() if low > 0.0]
    more_cold = [method for method, (_, high) in thaw.items() if high < 0.0]
    less_cold = [method for method, (low, _) in thaw.items() if low > 0.0]
    text = (
        f"Asked for carbon instead of thaw, {named(more_carbon, 'store')} more carbon for it. Asked for thaw instead "
        f"of carbon, {named(more_cold, 'keep')} more cold in the ground"
    )
    text += f", and {named(less_cold, 'keep')} less." if less_cold else "."
    text += f" {named(unmoved, 'do')} the same whatever is asked for." if unmoved else ""
    told = "a change is named if neither interval, that over seeds and sites or that over seeds alone by t, holds 0"
    return f"{text} (Greedy policies; {told}.)"


def wrapped(text: str) -> str:
    """A point of a list, as the documents' lines are."""
    return textwrap.fill(text, 120, subsequent_indent="    ", break_on_hyphens=False) + "\n"


def of_seeds(replicates: list) -> str:
    """How many trainings a row has."""
    return f"{len(replicates)} training seed{'s' if len(replicates) > 1 else ''}"


def listed(titles: list[str]) -> str:
    """Titles in a sentence."""
    return titles[0] if len(titles) == 1 else ", ".join(titles[:-1]) + f" and {titles[-1]}"


def named(its_methods: list[tuple[str, str]], verb: str = "") -> str:
    """Titles of methods as the subject of a sentence."""
    if not its_methods:
        return "none " + (f"{verb}s" if verb else "is")
    of_one, of_several = {"": ("is", "are"), "do": ("does", "do")}.get(verb, (f"{verb}s", verb))
    return f"{listed(titles_of(its_methods))} {of_one if len(its_methods) == 1 else of_several}"


def titles_of(its_methods: list[tuple[str, str]]) -> list[str]:
    """Their titles."""
    return [methods.title(*method) for method in its_methods]
