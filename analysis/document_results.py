"""Writes what was measured into README.md and docs/: archived runs, tables of results/, docs/validation.md.

    python analysis/document_results.py

Each page has a pair of comments, `<!-- results of ppo_gated -->` and `<!-- end of results -->`; what is between them
is made here, so that no page shows a number that was not measured.
"""

import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

import sim
from analysis import excerpts, experiments, generalisation, main_points, methods, metrics, paths, stored
from analysis.experiments import BALANCED, GENERALIST
from analysis.figures import learning_asymmetry, learning_curves, learning_difficulty, many_objectives
from analysis.paper_claims.claim import FEWEST_SEEDS
from analysis.results import Results
from analysis.studies import ensembles
from analysis.tables import best_known, choices, main_results, runtime, single_sites
from analysis.tables import learning_difficulty as difficulty_table
from analysis.tables.common import has_numbers, over_seeds, paper_name, score_text
from analysis.tables.thaw_formulations import under_asymmetric
from cleanrl_style import protocol
from cleanrl_style.protocol import sites
from sim.task.shifts import SHIFTS, shifts_of

PAGES = (
    "README.md",
    "docs/start.md",
    "docs/learning.md",
    "docs/performance.md",
    "docs/planners.md",
    "docs/results.md",
    "docs/scaling.md",
    "docs/outside.md",
    *(
        f"docs/algorithms/{name}.md"
        for name in methods.scripts(methods.CONDITIONED, methods.BANDIT, methods.FIXED_WEIGHT)
    ),
    "docs/algorithms/heuristics.md",
)
SECTION = re.compile(r"(<!-- results of ([\w-]+) -->\n).*?(<!-- end of results -->)", re.DOTALL)
ENDS = (0.0, 1.0)  # weights
HEADING = (
    "| {what} | seeds | score, greedy | score, sampled | gain | gain hypervolume | carbon, weight 0 "
    "| carbon, weight 1 | thaw, weight 0 | thaw, weight 1 | scalarised | scalarised, the paper |\n"
    + "|---" * 12
    + "|\n"
)
RETURNS = ("carbon_0", "carbon_1", "thaw_0", "thaw_1", "scalarized")
COLUMNS = {"score_greedy": 0, "score_sampled": 0, "gain_scalarized": 2, "gain_hypervolume": 2} | dict.fromkeys(
    RETURNS, 2
)
"""Columns, and their decimals."""


@dataclass
class Args:
    """Writes the results of the archived runs into the documents."""

    runs_dir: tuple[Path, ...] = (paths.archive(),)
    """folders that hold the runs, at any depth: the archive, so that the documents show what a clone has"""
    root: Path = Path()
    """folder of README.md and docs/"""


def numbers(evaluation: pd.DataFrame, gains: pd.DataFrame | None) -> dict:
    """What a row shows of one run; a weight that it was not evaluated at is not a number."""
    front = metrics.mean_returns(evaluation)
    row = {
        f"{objective}_{weight:g}": front[f"{objective}_return"].get(weight, np.nan)
        for objective in ("carbon", "thaw")
        for weight in ENDS
    }
    row |= main_results.front_metrics(evaluation)
    return row if gains is None else row | main_results.gain_metrics(gains)


def line(title: str, replicates: list, published: float = np.nan, trained: bool = False) -> str:
    """A row of the table: interquartile means over training seeds with 95 % intervals, and the paper's return."""
    shown = [*RETURNS, "gain_hypervolume"]
    table = pd.DataFrame([numbers(one.evaluation, one.gains) for one in replicates], columns=shown)
    values = over_seeds(table) | main_results.scores(replicates)
    if replicates and len(np.unique(metrics.weights_of(replicates[0].evaluation), axis=0)) <= len(ENDS):
        # a mean over the ends alone is no mean over the preferences
        values = {name: value for name, value in values.items() if "gain" not in name and "scalarized" not in name}
    cells = cells_of(values, COLUMNS)
    cells.append("" if np.isnan(published) else f"{published:.2f}")
    seeds = trainings(replicates) if trained else ""
    return f"| {title} | {seeds} | " + " | ".join(cells) + " |\n"


def trainings(replicates: list) -> str:
    """How many training seeds a row has; of trainings on single sites how many sites, each with a seed of its own."""
    sites = {one.runs[0].arguments.get("site_seed") for one in replicates}
    return f"{len(replicates)} sites" if len(sites) > 1 else str(len(replicates) or "not run yet")


def cells_of(values: dict, columns: dict[str, int]) -> list[str]:
    """Values with their intervals, in so many decimals; columns : their names, and the decimals."""
    cells = []
    for name, decimals in columns.items():
        value, low, high = (values.get(f"{name}{part}", np.nan) for part in ("", "_low", "_high"))
        if name.startswith("score_") and not decimals:
            cells.append(score_text(value, low, high))
            continue
        interval = "" if np.isnan(low) else f" [{low:.{decimals}f}, {high:.{decimals}f}]"
        cells.append("" if np.isnan(value) else f"{value:.{decimals}f}{interval}")
    return cells


def not_run(*names: str) -> str:
    """What stands where runs of experiments are missing."""
    return f"Not run yet: `python analysis/reproduce.py --only {' '.join(names)}`.\n"


def experiments_of(script: str) -> list[str]:
    """The experiments that a script has jobs in."""
    return list(dict.fromkeys(job.experiment for job in experiments.jobs() if job.script == script))


def has_default(rows: list[tuple], script: str) -> bool:
    """Whether a script's row without flags is among rows."""
    return any(row[0] == methods.title(script) for row in rows)


def figure_of(name: str) -> Callable[[Results], str]:
    """Makes the section with a figure of results/figures, or with the command that makes its runs."""
    module, shown = FIGURES[name]

    def section_of_figure(results: Results) -> str:
        path = paths.results() / "figures" / f"{name}.png"
        if path.exists():
            return f"![{shown}](../{path.as_posix()})\n"
        return f"Not run yet: `{module.MADE_BY}` (a figure: {shown}).\n"

    return section_of_figure


def flags(setting: str) -> str:
    """A row's setting as flags of the command line, as code."""
    words = methods.flags(setting)
    return f"`{words}`" if words else ""


def titled(script: str, shown_flags: str) -> str:
    """A method's name and its flags, but those that name it."""
    if (script, shown_flags.strip("`")) in methods.BY_FLAGS:
        return methods.title(script, shown_flags.strip("`"))
    return ", ".join(filter(None, (methods.title(script), shown_flags)))


def rows_of(results: Results, script: str, environment: str | None = None) -> list[tuple]:
    """`line`'s arguments, the title being the flags, for a script's rows that have runs, the default first.

    What was trained on another thaw reward is judged by the asymmetric one, as all others are.
    """
    published = main_results.paper_rows().paper_scalarized
    found = [
        (key, replicates)
        for key, replicates in results.rows_of_two_objectives().items()
        if key[0] == script and replicates and environment in (None, key[1])
        # under the asymmetric reward, which judges all, what does not learn is the same whatever is rewarded
        if script in methods.TRAINED or "thaw_formulation" not in key[2]
    ]
    shown_rows = []
    for (_, env_id, setting), replicates in found:
        parts = [flags(setting), "" if env_id in (GENERALIST, environment) else f"`{env_id}`"]
        title = ", ".join(filter(None, parts)) or "default"
        papers = published.get(paper_name(script, env_id, setting), np.nan)
        judged = [under_asymmetric(results, one) for one in replicates]
        shown_rows.append((title, judged, papers, script in methods.TRAINED))
    return sorted(shown_rows, key=lambda row: row[0] != "default")


def named(script: str, rows: list) -> list:
    """The rows with the method's name before the flags."""
    return [(titled(script, "" if title == "default" else title), *rest) for title, *rest in rows]


def plans(results: Results, environment: str) -> list[tuple[str, list]]:
    """Rows of the constant plans of an environment, if their study is there."""
    found = main_results.constant_plans(results)
    return [
        (title, found[name, environment, "default"])
        for name, (title, _) in main_results.CONSTANT_PLANS.items()
        if found[name, environment, "default"]
    ]


def other_worlds(results: Results) -> str:
    """Score and gain of what was trained with more objectives or in another climate."""
    columns, rows = {name: COLUMNS[name] for name in ("score_greedy", "score_sampled", "gain_scalarized")}, []
    lacking = list(experiments.OTHER_WORLDS)
    for (script, env_id, setting), replicates in results.rows.items():
        if env_id in experiments.OTHER_WORLDS and replicates:
            cells = [f"`{env_id}`", titled(script, flags(setting)), str(len(replicates))]
            rows.append([*cells, *cells_of(main_results.scores(replicates), columns)])
            lacking = [name for name in lacking if name != env_id]
    names = ", ".join(f"`{name}`" for name in lacking)
    text = excerpts.markdown(["environment", "method", "seeds", "score, greedy", "score, sampled", "gain"], rows)
    return text + (f"\n{names}. {not_run('worlds')}" if lacking else "")


def distances(results: Results) -> str:
    """How much of the best known plans' gains agents, planners and blind planting reach, in percent."""
    table = best_known.make(results)
    columns = {f"share_{weight:g}": f"{weight:g}" for weight in best_known.WEIGHTS} | {"share": "all"}
    shown = (*methods.TRAINED, "plus_100", *best_known.BLIND)
    table = table[table.method.isin(shown) & (table.policy != "sampled")]
    table = table[table.method.isin(methods.TRAINED) | (table.setting == "default")]
    if table.empty:
        return not_run("main")
    cells = []
    for _, row in table.iterrows():
        title = best_known.BLIND.get(row.method) or titled(row.method, flags(row.setting))
        seeds = f"{row.seeds:.0f}" if row.method in methods.TRAINED else ""
        cells.append([title, f"`{row.environment}`", seeds, *(excerpts.with_interval(row, name) for name in columns)])
    return excerpts.markdown(
        ["% of the best known gain at carbon weight", "environment", "seeds", *columns.values()], cells
    )


#: Of the table `learning_difficulty`, rows that docs/learning.md does not show.
DIFFICULTY_LEFT_OUT = "one year|one choice|discounted|GAE|total utility| x "


def difficulty(results: Results) -> str:
    """What the returns vary with, effects of actions against their noise, and how much of a gradient is noise."""
    table = difficulty_table.make(results)
    if not has_numbers(table, difficulty_table.COLUMNS):
        return f"Not run yet: `{difficulty_table.MADE_BY}`.\n"
    table = table[~(table["of"] + table.quantity).str.contains(DIFFICULTY_LEFT_OUT)]
    cells = [
        [row["of"], row.quantity, *(excerpts.with_interval(row, objective) for objective in ("carbon", "thaw"))]
        for _, row in table.iterrows()
    ]
    return excerpts.markdown(list(difficulty_table.COLUMNS.values()), cells)


def choices_of(script: str, *experiments_: str):
    """A script with one choice changed less its default, bold where both intervals of five seeds and more lack 0.

    That an interval lacks 0 has to be seen: as it is printed.
    """

    def written(results: Results) -> str:
        table = choices.make(results, script)
        table = table[table.seeds > 0]
        if not has_numbers(table, choices.COLUMNS):
            return not_run("main", "balanced", *experiments_)
        decimals = {"score_greedy": 1, "score_sampled": 1} | dict.fromkeys(choices.CHANGES, 2)
        rows = []
        for row in table.to_dict("records"):
            cells = cells_of(row, decimals)
            for k, (name, digits) in enumerate(decimals.items()):
                seen = row[f"{name}_told"] and (
                    round(row[f"{name}_low"], digits) > 0 or round(row[f"{name}_high"], digits) < 0
                )
                cells[k] = f"**{cells[k]}**" if seen and row["seeds"] >= FEWEST_SEEDS else cells[k]
            rows.append([flags(row["setting"]), f"`{row['environment']}`", str(row["seeds"]), *cells])
        header = [choices.COLUMNS[name] for name in ("setting", "environment", "seeds", *decimals)]
        return excerpts.markdown(header, rows)

    return written


def averaged(results: Results) -> str:
    """Scores of policies of several trainings averaged, beside those of each for itself, and what they are apart."""
    table = results.study("ensembles")
    if table is None:
        return "Not run yet: `python analysis/studies/ensembles.py`.\n"
    rows: dict[int, list[str]] = {}
    for task, of_task in table.groupby("task", sort=False):
        alone = main_points.default_rows(results, task).get((ensembles.SCRIPT, ""), [])
        if not alone or alone[0].plans is None:
            continue
        seeds = [one.runs[0].arguments["seed"] for one in alone]
        members = pd.DataFrame([metrics.of_sites(one.by_policy["greedy"]) for one in alone], index=seeds).sort_index()
        plans = metrics.plans_of_sites(alone[0].plans, np.unique(metrics.weights_of(alone[0].gains), axis=0))
        for size, of_size in [(1, None), *of_task.groupby("size")]:
            gained = members if of_size is None else of_size.pivot(index="first_seed", columns="seed", values="gain")
            of_sets = [members.loc[chosen].mean() for chosen in ensembles.sets_of(list(members.index), size)]
            apart = gained.reset_index(drop=True) - pd.DataFrame(of_sets)
            cells = rows.setdefault(size, [str(size), str(len(gained))])
            cells += [in_points(gained, plans), "" if size == 1 else in_points(apart, plans)]
    titles = [title for task in dict.fromkeys(table.task) for title in (f"`{task}`", "less its members'")]
    return excerpts.markdown(["trainings together", "sets", *titles], list(rows.values()))


def in_points(gained: pd.DataFrame, plans: np.ndarray) -> str:
    """Score of sets of trainings (sets, sites) with its interval; of few sets of their mean, over sites alone."""
    few = len(gained) < FEWEST_SEEDS
    score = metrics.score_interval(np.tile(gained.mean(axis=0), (2, 1)) if few else gained, plans)
    return "{:.1f} [{:.1f}, {:.1f}]".format(*score)


def sites_alone(results: Results) -> str:
    """Gains of agents of one objective on each of the single sites, and of the best constant plan there."""
    table = single_sites.make(results)
    columns = {name: title for name, title in single_sites.COLUMNS.items() if name in table}
    if not has_numbers(table, columns):
        return not_run("main", "site")
    rows = table[list(columns)].to_numpy()
    cells = [[site, *("" if np.isnan(gain) else f"{gain:.2f}" for gain in gains)] for site, *gains in rows]
    return excerpts.markdown(columns.values(), cells)


def other_libraries(results: Results) -> str:
    """Score, gain, hours and memory of the algorithms of other libraries, a row an environment and setting."""
    columns = ("method", "environment", "seeds", "score, greedy", "score, sampled", "gain", "hours", "GB")
    columns += ("steps", "steps of its own evaluation")
    rows, lines = [(key, found) for key, found in results.rows.items() if key[0] in methods.OUTSIDE and found], []
    for (script, env_id, setting), replicates in rows:
        runs = [run for one in replicates for run in one.runs]
        cost = pd.concat([run.tables["cost"] for run in runs]).median()
        of_runs = [sum(runtime.hours(run)[name] for name in ("training", "evaluation")) for run in runs]
        hours = pd.Series(of_runs).median()  # of those that have a time
        scores = main_results.scores(replicates)
        cells = [titled(script, flags(setting)), f"`{env_id}`", str(len(replicates))]
        cells += cells_of(
            scores, {name: COLUMNS[name] for name in ("score_greedy", "score_sampled", "gain_scalarized")}
        )
        cells += ["" if np.isnan(x) else f"{x:.1f}" for x in (hours, cost.peak_memory_mb / 1000)]
        cells += [f"{cost.steps:,.0f}", f"{cost.own_evaluation_steps:,.0f}"]
        lines.append(cells)
    there = {(script, env_id) for (script, env_id, _), _ in rows}
    lacking = [
        f"{methods.title(script)} on `{env_id}`"
        for env_id in (GENERALIST, BALANCED)
        for script in methods.OUTSIDE
        if (script, env_id) not in there
    ]
    text = f"\nNot run yet: {', '.join(lacking)}.\n" if lacking else ""
    return excerpts.markdown(columns, lines) + text if rows else not_run("outside")


def nearest_plans(results: Results) -> str:
    """MORL/D's greedy policies and the constant plans whose returns are nearest to theirs, a row a training."""
    columns = ["environment", "seed", "score, greedy", "score, sampled", "plan nearest at weight 0", "at 0.5", "at 1"]
    lines = []
    for (script, env_id, _), replicates in results.rows.items():
        for one in replicates if script == "morld" else ():
            nearest, apart = {}, []
            plans = {name: metrics.returns_of(rows.sort_values("seed")) for name, rows in one.plans.groupby("plan")}
            for weight, rows in metrics.by_weight(one.by_policy["greedy"]):
                returns = metrics.returns_of(rows.sort_values("seed"))
                distances = {name: np.sqrt(((of_plan - returns) ** 2).mean()) for name, of_plan in plans.items()}
                nearest[weight] = min(distances, key=distances.get)
                apart.append(distances[nearest[weight]])
            scores = [f"{one.score_of(one.by_policy[policy]):.0f}" for policy in ("greedy", "sampled")]
            names = [protocol.reference.title(nearest[weight]) for weight in (0.0, 0.5, 1.0)]
            seed = str(one.runs[0].arguments["seed"])
            lines.append([f"`{env_id}`", seed, *scores, *names, f"{max(apart):.3f}"])
    return excerpts.markdown([*columns, "returns apart, at most"], lines) if lines else not_run("outside")


#: Split -> what it is for; the shifts besides.
SPLITS = {
    "validation": "variants and budgets are chosen on them; no training learns from them",
    "test": "results are of them; choices made knowing them: the constant plans (decision 65), no relabelling "
    "(decision 109), ten seeds for a million steps (decision 111), five for three million (decision 112), "
    "plan regression as a method (decision 115)",
}


def splits(results: Results) -> str:
    """The splits of sites: seeds, what each is for, and what is moved outside the sampled range."""
    rows = []
    for name, text in SPLITS.items():
        seeds = sites.published_seeds(name)
        which = f"{len(seeds)} of `{sites.TABLE}`"
        rows.append([f"`{name}`", which, text])
    for name, moved in SHIFTS.items():
        worlds = [world for world in ("balanced", "sampled") if name in shifts_of(world)]
        parts = [
            f"`{parameter}` {low:g} to {high:g} (sampled: {one.low:g} to {one.high:g})"
            for parameter, (low, high) in moved.items()
            for one in (sim.SITE_PARAMETERS[parameter],)
        ]
        only = "" if len(worlds) == 2 else f"; only where the boundary is {worlds[0]}"
        rows.append([f"`{name}`", "those of `test`", "; ".join(parts) + only])
    return excerpts.markdown(["split", "reset with", "sites"], rows)


def on_other_sites(results: Results) -> str:
    """Score, NHGR and EUGR of the policies that were judged inside and outside the sampled range, the greedy ones."""
    rows = []
    for path in sorted((results.studies_dir / "generalisation").glob("*.csv")):
        scores = {(policy, split): score for policy, split, score in stored.settings(path)["scores"]}
        of_splits = dict(tuple(stored.read(path).groupby("split", sort=False)))
        for row in generalisation.summaries(of_splits).to_dict("records"):
            folder, _, policy = row["policy"].rpartition(", ")
            if policy != "greedy":
                continue
            script, _, seed = Path(folder).parts[-3:]
            score = scores.get((row["policy"], row["split"]), np.nan)
            cells = [
                f"{methods.title(script)}, {seed.replace('seed', 'seed ')}, `{path.stem}`",
                row["split"],
                str(row["sites"]),
            ]
            cells.append("" if np.isnan(score) else f"{score:.0f}")
            for name in generalisation.RATIOS:
                drop, low, high = (
                    round(row.get(f"{name}_drop{end}", np.nan), 2) + 0.0 for end in ("", "_low", "_high")
                )
                cells += [f"{row[name]:.2f}", "" if np.isnan(drop) else f"{drop:.2f} [{low:.2f}, {high:.2f}]"]
            rows.append(cells)
    if not rows:
        return "Not run yet: `python analysis/generalisation.py RUN`.\n"
    return excerpts.markdown(["policy", "split", "sites", "score", "NHGR", "drop", "EUGR", "drop"], rows)


def section(results: Results, name: str) -> str:
    """What stands between the comments: of all methods in a world, of the heuristics, of one script, another table."""
    if name in EXCERPTS:
        return EXCERPTS[name]()
    if name in TABLES:
        return TABLES[name](results)
    rows = []
    if name in OF_ALL:
        for script in (*methods.TRAINED, *methods.STRATEGIES):
            rows += named(script, rows_of(results, script, OF_ALL[name]))
        rows = [row for row in rows if "`--" not in row[0]]  # a method's own page has its variants
    elif name == "heuristics":
        for script in methods.STRATEGIES:
            rows += named(script, rows_of(results, script))
    else:
        rows = rows_of(results, name)
    if name in OF_ALL or name == "heuristics":
        rows += plans(results, OF_ALL.get(name, GENERALIST))
    if not rows:
        return not_run(*EXPERIMENTS_OF.get(name, experiments_of(name)))
    if name in OF_ALL:
        missing = [script for script in (*methods.LEARNERS, *methods.STRATEGIES) if not has_default(rows, script)]
        rows += [(methods.title(script), [], np.nan, True) for script in missing]
    what = "method" if name in OF_ALL or name == "heuristics" else "flags"
    return HEADING.format(what=what) + "".join(line(*row) for row in rows)


EXPERIMENTS_OF = {"all": ["main"], "balanced": ["balanced"], "heuristics": ["main", "balanced"]}
FIGURES = {
    "learning_curves": (learning_curves, "Returns of training episodes, and gains on validation sites"),
    "learning_asymmetry": (
        learning_asymmetry,
        "EUPG of one weight: returns and gains in training; panel f: single sites, with a baseline and without",
    ),
    "learning_difficulty": (
        learning_difficulty,
        "Shares of the variance; effect and noise; course of the effect; episodes needed",
    ),
    "many_objectives_boreal-timber-v0": (many_objectives, "Returns at each weight of carbon, thaw and timber"),
    "many_objectives_boreal-four-v0": (many_objectives, "Returns at each weight of carbon, thaw, timber, biodiversity"),
}
OF_ALL = {"all": GENERALIST, "balanced": BALANCED}
TABLES = {
    "distances": distances,
    "other_worlds": other_worlds,
    "single_sites": sites_alone,
    "short_table": main_points.short_table,
    "in_words": main_points.in_words,
    "outside": other_libraries,
    "nearest_plans": nearest_plans,
    "splits": splits,
    "generalisation": on_other_sites,
    "difficulty": difficulty,
    "group_choices": choices_of("ppo_group", "group", "budgets"),
    "gated_choices": choices_of("ppo_gated", "controls", "variants"),
    "curriculum_choices": choices_of("ppo_curriculum", "controls"),
    "eupg_choices": choices_of("eupg_var_lambda", "variants"),
    "ensembles": averaged,
    **{f"figure_{name}": figure_of(name) for name in FIGURES},
}
EXCERPTS = {
    "speed": excerpts.speed,
    "shares": excerpts.shares,
    "towers": excerpts.towers,
    "first_run": excerpts.first_run,
    "scaling": excerpts.scaling,
    "region_killed": excerpts.region_killed,
    "boreal_map": excerpts.boreal_map,
    "outside_speed": excerpts.outside_speed,
    "times": excerpts.times,
    "misses": excerpts.missing,
    "changing_the_plan": excerpts.changing_the_plan,
    "knowing_the_site": excerpts.knowing_the_site,
    "looking_at_the_stand": excerpts.looking_at_the_stand,
    "gradient": excerpts.gradient,
}


def main(args: Args) -> None:
    """Rewrite the sections of all pages."""
    if not (args.root / PAGES[0]).exists():
        protocol.fail(f"--root {args.root}: no {PAGES[0]} there")
    results = Results.load(False, args.runs_dir)
    rows = results.rows  # completes left_out
    for problem in results.left_out:
        print(f"left out: {problem}", file=sys.stderr)
    for page in PAGES:
        path = args.root / page
        if not path.exists():
            print(f"no page yet: {path}", file=sys.stderr)
            continue
        text = path.read_text(encoding="utf-8")
        new, count = SECTION.subn(
            lambda match: match[1] + excerpts.without_empty_columns(section(results, match[2])) + match[3], text
        )
        if not count:
            protocol.fail(f"{path}: no section of results (<!-- results of ... --> to <!-- end of results -->)")
        with protocol.replacing(path) as file:
            file.write(new.encode())
    print(f"wrote the results of {len(results.runs)} runs in {len(rows)} rows into {len(PAGES)} pages")


if __name__ == "__main__":
    main(protocol.parse(Args))
