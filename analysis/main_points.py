"""What README.md and docs/results.md say first: six rows of the main table, and what all its rows say, in words."""

import textwrap

import numpy as np
import pandas as pd

from analysis import methods, metrics
from analysis.experiments import BALANCED, GENERALIST
from analysis.paper_claims.claim import FEWEST_SEEDS
from analysis.tables import main_results

WORLDS = (BALANCED, GENERALIST)
BEST_PLAN = "best_constant_mix"
PLANTING = "plus_100"
SIX = (PLANTING, "eupg_var_lambda", "ppo_gated", "ppo_curriculum", "ppo_group")
"""Rows of the README, between doing nothing, which is 0, and the best constant plans."""
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


def best_plan(results, env_id: str) -> list:
    """The best constant plan of each weight, as `default_rows` has its rows; empty if its study is not there."""
    return main_results.constant_plans(results)[BEST_PLAN, env_id, "default"]


def shown(scores: dict) -> str:
    """The greedy score with its interval; empty where it is not known."""
    value, low, high = (scores.get(f"score_greedy{part}", np.nan) for part in ("", "_low", "_high"))
    if np.isnan(value):
        return ""
    return f"{value:.0f}" + ("" if np.isnan(low) or low == high else f" [{low:.0f}, {high:.0f}]")


def six_rows(results) -> str:
    """Scores of the best constant plans, of planting and of four trained methods, in both worlds.

    That of a single training is not shown: another seed's may be far from it.
    """
    rows = {env_id: default_rows(results, env_id) for env_id in WORLDS}
    text = "| method | training seeds | " + " | ".join(f"`{env_id}`" for env_id in WORLDS) + " |\n" + "|---" * 4 + "|\n"
    plans = [shown(main_results.scores(best_plan(results, env_id))) for env_id in WORLDS]
    text += f"| the best constant plan of each preference | | {' | '.join(plans)} |\n"
    for script in SIX:
        of_worlds = [rows[env_id].get((script, ""), []) for env_id in WORLDS]
        seeds = " and ".join(dict.fromkeys(str(len(replicates)) for replicates in of_worlds if replicates))
        what = (seeds if script in methods.TRAINED else "") if seeds else "not run yet"
        fewest = 2 if script in methods.TRAINED else 1
        cells = [shown(main_results.scores(one)) if len(one) >= fewest else "" for one in of_worlds]
        text += f"| {methods.title(script)} | {what} | {' | '.join(cells)} |\n"
    return text


def beats(replicates: list, other: list) -> bool:
    """Whether the greedy policy gains more than a fixed strategy on the same sites, by its whole interval over training
    seeds and sites; never of a single training, which has none."""
    ours, theirs = (
        pd.DataFrame([metrics.of_sites(one.by_policy["greedy"]) for one in rows]) for rows in (replicates, other)
    )
    _, low, _ = metrics.score_interval(ours - theirs.iloc[0], None)
    return low > 0.0


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
    planting = (PLANTING, "")
    if not trained or planting not in known:
        return ""
    best = max(trained, key=known.__getitem__)
    above = [method for method in trained if beats(rows[method], rows[planting])]
    beat = [method for method in trained if beats(rows[method], best_plan(results, env_id))]
    text = (
        f"- **`{env_id}`.** Planting 100 stems a year without looking scores {known[planting]:.0f}. The best of "
        f"{len(trained)} trained method{'s' if len(trained) > 1 else ''} is {methods.title(*best)} with "
        f"{shown(scores[best])}, {of_seeds(rows[best])}; "
        f"by the whole interval of the difference on the same sites {named(above)} above planting, {named(beat)} above "
        "100."
    )
    few = [method for method in trained if len(rows[method]) < FEWEST_SEEDS]
    if few:
        text += f" Few training seeds: {listed([f'{methods.title(*method)} {len(rows[method])}' for method in few])}."
    lacking = [methods.title(script) for script in methods.LEARNERS if (script, "") not in known]
    text += f" Not run yet: {listed(lacking)}." if lacking else ""
    followed = {
        method: main_results.row_of_runs((method[0], env_id, "default"), rows[method])
        for method in trained
        if method[0] in methods.LEARNERS and len(rows[method]) >= FEWEST_SEEDS
    }
    if not followed:
        text += f" Whether a method follows the preference is said from {FEWEST_SEEDS} training seeds on."
        return wrapped(text)
    carbon = [method for method, row in followed.items() if row["carbon_change_low"] > 0.0]
    thaw = [method for method, row in followed.items() if row["thaw_change_high"] < 0.0]
    text += (
        f" Asked for carbon instead of thaw, {named(carbon, 'store')} more carbon for it; asked for thaw instead of "
        f"carbon, {named(thaw, 'keep')} more cold in the ground (intervals over training seeds without 0)."
    )
    return wrapped(text)


def wrapped(text: str) -> str:
    """A point of a list, as the documents' lines are."""
    return textwrap.fill(text, 120, subsequent_indent="  ", break_on_hyphens=False) + "\n"


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
    titles = [methods.title(*method) for method in its_methods]
    words = listed(titles)
    plural = len(titles) > 1
    return f"{words} " + ((verb if plural else f"{verb}s") if verb else ("are" if plural else "is"))
