"""What README.md and pages of docs/ show of results/first_run.txt, readme.csv and benchmark.csv, of the files of
scaling and maps, and of docs/validation.md, as Markdown."""

import itertools
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from analysis import methods, paths, stored
from analysis.studies import boreal_map as region_map
from analysis.studies import decade_plans, replanning, site_choice, site_regression
from analysis.tables.common import markdown
from analysis.validation import robustness_report
from boreal_env import DEFAULT_YEARS
from cleanrl_style import protocol
from cleanrl_style.protocol.arguments import DEFAULT_STEPS

VALIDATION = Path("docs/validation.md")
TOWERS = ("SE-Svb", "US-Prr")
SCORES = ("months: bias", "RMSE", "r", "verdict")  # of a tower's table, in this order; those of months come first

#: Row of benchmark.csv -> what the README calls it.
SPEEDS = {
    "50-year episode, 1 stand": "50-year episode, one stand, one core",
    "50-year episode, 16 stands in lockstep, each": "the same in lockstep (16 stands), per stand and core",
    "lockstep, 300,000 steps with evaluation": "300,000 steps with evaluation, 32 stands in lockstep on all cores",
    "async, 300,000 steps with evaluation": "the same, 8 stands in worker processes",
    "first start, 16 stands": "first start, the physics compiled",
    "later start, 16 stands": "later starts",
}

#: Part of a step of a training in lockstep, in benchmark.csv -> what docs/performance.md calls it.
SHARES = {
    "physics": "the compiled year",
    "update": "PPO's update",
    "plumbing": "the environment's Python, and starts of episodes",
    "policy": "the policy in rollouts",
}

#: (column, arithmetic) of outside_speed.csv -> its heading in docs/outside.md.
OUTSIDE_SPEED = {
    ("milliseconds_a_step", "any"): "ms a step",
    ("hours", "any"): "hours for 300,000 steps",
    ("hours", "own"): "hours with `MKL_CBWR=AUTO`",
}


def figures(names) -> pd.DataFrame:
    """Rows of results/benchmark.csv, by their names."""
    path = paths.results() / "benchmark.csv"
    table = pd.read_csv(path, keep_default_na=False).set_index("what")
    missing = [name for name in names if name not in table.index]
    if missing:
        protocol.fail(f"{path}: no row {missing[0]!r}; python analysis/benchmark.py writes it")
    return table.loc[list(names)]


def without_empty_columns(text: str) -> str:
    """The text, its tables without the columns that no row has anything in."""
    parts = []
    for is_table, lines in itertools.groupby(text.splitlines(keepends=True), lambda line: line.startswith("|")):
        part = "".join(lines)
        if is_table:
            header, _, *rows = map(cells, part.splitlines())
            filled = [k for k, column in enumerate(zip(*rows, strict=True)) if any(column)]
            if 0 < len(filled) < len(header):
                part = markdown([header[k] for k in filled], [[row[k] for k in filled] for row in rows])
        parts.append(part)
    return "".join(parts)


def speed() -> str:
    """Times of episodes, trainings and starts, beside the paper's."""
    table = figures(SPEEDS)
    repeats = " or ".join(map(str, sorted(set(table.repeats[table.low < table.high]))))
    rows = []
    for row in table.itertuples():
        middle, low, high = (f"{time:#.2g}".rstrip(".") for time in (row.median, row.low, row.high))
        spread = " (once)" if row.low == row.high else f" ({low}-{high})" if low != high else ""
        rows.append([SPEEDS[row.Index], f"{middle} {row.unit}{spread}", row.paper])
    return markdown(["speed", f"here: median of {repeats} (lowest-highest)", "paper"], rows)


def shares() -> str:
    """Where the time of a training goes."""
    times = figures([f"lockstep, 32 stands: {part}" for part in SHARES])["median"]
    rows = zip(SHARES.values(), 100 * times / times.sum(), strict=True)
    return markdown(["what", "share of a lockstep training"], [[what, f"{share:.0f} %"] for what, share in rows])


def scaling() -> str:
    """How speed grows with stands and cores, and what a region costs: of each machine that was measured."""
    measured = sorted(paths.results().glob("scaling*.csv"))
    return "\n".join(of_machine(pd.read_csv(path)) for path in measured) or "Not measured yet.\n"


def of_machine(table: pd.DataFrame) -> str:
    """Its speeds, a row a number of stands, then its environment and its costs."""
    years = table[table.what.str.startswith("a year")]
    columns = {}
    for (backend, what, threads), group in years.groupby(["backend", "what", "threads"], sort=False):
        name = "the GPU" if backend == "cuda" else "1 core" if threads == 1 else f"{threads} cores"
        column = group.set_index("stands")
        cells = column["median"].map("{:,.0f}".format)
        if backend == "numba" and threads > 1:
            cells += " (" + column.efficiency.map("{:.0%}".format) + ")"
        columns[name + what.removeprefix("a year")] = cells
    shown = pd.DataFrame(columns).fillna("")
    lines = []
    steps, region = table[table.what == "an environment's step"], table[table.what.str.contains("stands, ")]
    for _, row in steps.iterrows():
        on = "the GPU" if row.backend == "cuda" else f"{row.threads} cores"
        lines.append(f"- `BorealVectorEnv` of {row.stands:,} stands on {on}: {row['median']:,.0f} steps a second.")
    for backend, group in region.groupby("backend", sort=False):
        hours, dollars = (row for _, row in group.iterrows())
        costs = [f"{row['median']:,.3g} {row.unit} ({row.low:,.3g} to {row.high:,.3g})" for row in (hours, dollars)]
        price = f"{dollars['median'] / hours['median']:.4g} dollars a {hours.unit.replace('-hours', '-hour')}"
        what = hours.what.replace("1000000 stands,", "A million stands for")
        lines.append(f"- {what}, {'on GPUs' if backend == 'cuda' else 'on cores'}: {', '.join(costs)}, at {price}.")
    rows = [[f"{stands:,}", *cells] for stands, cells in zip(shown.index, shown.to_numpy(), strict=True)]
    names = " and ".join(dict.fromkeys(table.machine))
    return f"{names}:\n\n" + markdown(["stands", *shown.columns], rows) + "\n" + "\n".join(lines) + "\n"


def region_killed() -> str:
    """What came of a region that was killed; results/region_killed.csv has it (analysis/region_killed.py)."""
    path = paths.results() / "region_killed.csv"
    if not path.exists():
        return "Not measured yet.\n"
    row = pd.read_csv(path).iloc[0]
    outcome = "the same bytes as" if row.same_bytes else "OTHER BYTES THAN"
    return (
        f"`python analysis/region_killed.py`: {row.stands:,} stands under `{row.policy}` for {row.years} years, in "
        f"steps of {row.step_minutes} minutes, killed {row.kills} times at random moments and gone on with, gave "
        f"{outcome} a run that was left alone, in at most {row.peak_mb} MB of memory.\n"
    )


def outside_speed() -> str:
    """What other libraries' algorithms take of a processor; results/studies/outside_speed.csv has it."""
    path = paths.studies() / "outside_speed.csv"
    if not path.exists():
        return "Not run yet: `python analysis/studies/outside_speed.py`.\n"
    table = stored.read(path).pivot(index="script", columns="arithmetic")
    rows = [
        [f"`{script}.py`", *("" if np.isnan(row[column]) else f"{row[column]:.1f}" for column in OUTSIDE_SPEED)]
        for script, row in table.loc[list(methods.OUTSIDE)].iterrows()
    ]
    return markdown(["command", *OUTSIDE_SPEED.values()], rows)


def boreal_map() -> str:
    """What the map says; results/studies/boreal_map.csv has it."""
    path = paths.studies() / "boreal_map.csv"
    if not path.exists():
        return "Not drawn yet.\n"
    settings = stored.settings(path)
    answer = region_map.sentences(stored.read(path), settings["preference"], settings["years"])
    return f"![What the policy plants, and what that does](images/boreal_map.png)\n\n{answer}\n"


def changing_the_plan() -> str:
    """What plans that change every ten years gain over constant ones, without looking."""
    rows = []
    for task in decade_plans.TASKS:
        if not decade_plans.path(task).exists():
            return f"Not run yet: `python {decade_plans.__name__.replace('.', '/')}.py`.\n"
        for row in stored.read(decade_plans.path(task), text=("weight", "constant", "plan")).itertuples():
            plans = [row.constant.split()[0], row.plan] if row.plan else ["", ""]
            more = "0" if plans[1] == row.constant else f"{row.more:.2f} [{row.more_low:.2f}, {row.more_high:.2f}]"
            if row.weight == decade_plans.ALL:
                more = f"score {row.plan_gain:.1f} [{100 + row.more_low:.1f}, {100 + row.more_high:.1f}]"
            weight = row.weight if row.weight == decade_plans.ALL else f"{float(row.weight):g}"
            rows.append([f"`{task}`", weight, *plans, more])
    header = ["task", "carbon weight", "best constant plan", "found, by decade", "gain more than the constant plan's"]
    return markdown(header, rows)


def knowing_the_site() -> str:
    """What choosing a plan by site is worth; the two tables in results/studies have every weight."""
    for study in (site_choice, site_regression):
        if not study.path().exists():
            return f"Not run yet: `python {study.__name__.replace('.', '/')}.py`.\n"
    table, fitted = stored.read(site_choice.path()), stored.read(site_regression.path())
    fitted = fitted[fitted.weight.astype(str) == site_choice.ALL].set_index("task")
    rows = []
    for row in table[table.weight.astype(str) == site_choice.ALL].itertuples():
        scores = [
            f"{getattr(row, way):.1f} [{getattr(row, f'{way}_low'):.1f}, {getattr(row, f'{way}_high'):.1f}]"
            for way in site_choice.WAYS[1:]
        ]
        scores += [
            "{:.1f} [{:.1f}, {:.1f}]".format(*(fitted.loc[row.task, f"{name}{part}"] for part in ("", "_low", "_high")))
            for name in ("score", "score_constant")
        ]
        thaw = table[(table.task == row.task) & (table.weight.astype(str) == "0.0")].iloc[0]
        spread = [f"{thaw[name]:.2f}" for name in ("sd_sites", "sd_dice")]
        rows.append([f"`{row.task}`", "100", *scores, conifers_less_deciduous(thaw), *spread])
    header = ["task", "one plan for all sites", "the best of each site, on the dice that judge it"]
    header += [
        "on other dice",
        "on all its dice",
        "by a regression on other sites",
        "of constant plans alone",
        "conifers less deciduous, thaw",
        "its deviation between sites",
    ]
    made, others = (stored.settings(study.path())["sites"] for study in (site_choice, site_regression))
    design = f"{made} sites, weathers and dice on each: {stored.settings(site_choice.path())['dice']}"
    table = markdown([*header, "between dice of a site"], rows)
    return f"{table}\n{design}; of the regression {others} other sites, one each.\n"


def looking_at_the_stand() -> str:
    """What choosing a plan anew is worth; the tables in results/studies/replanning have every weight."""
    rows = []
    for task in replanning.TASKS:
        if not replanning.path(task).exists():
            return f"Not run yet: `python {replanning.__name__.replace('.', '/')}.py`.\n"
        row = stored.read(replanning.path(task)).iloc[-1]
        shown = [
            f"{row[name]:.1f} [{row[f'{name}_low']:.1f}, {row[f'{name}_high']:.1f}]"
            for name in (*replanning.WAYS[1:], "anew_less_once")
        ]
        rows.append([f"`{task}`", "100", *shown, f"{row.plan_changed:.0%}"])
    header = ["task", "one plan for all sites", "chosen at the start", "chosen anew every ten years", "what that adds"]
    made = stored.settings(replanning.path(task))
    design = f"{made['sites']} sites, episodes on each: {made['dice']}; other weathers and dice: {made['futures']}."
    return markdown([*header, "choices that change the plan"], rows) + f"\n{design}\n"


def conifers_less_deciduous(row: pd.Series) -> str:
    """The mean over sites and dice of `site_choice`, with its 95 % t interval over sites."""
    made = stored.settings(site_choice.path())
    error = np.sqrt((row.sd_sites**2 + row.sd_dice**2 / made["dice"]) / made["sites"])
    half = stats.t.ppf(0.975, made["sites"] - 1) * error
    value = row.conifers_less_deciduous
    return f"{value:.2f} [{value - half:.2f}, {value + half:.2f}]"


def gradient() -> str:
    """How many episodes a gradient needs, as EUPG takes it and as Group PPO does; gradient_noise.csv has the rest."""
    path = paths.studies() / "gradient_noise.csv"
    if not path.exists():
        return "Not run yet: `python analysis/studies/gradient_noise.py`.\n"
    from analysis.studies import gradient_noise  # with torch

    table = stored.read(path)
    needed = table[table.utility == "future"].set_index(["baseline", "objective"])

    def episodes(baseline, objective="preference"):
        row = needed.loc[baseline, objective]
        return f"{with_interval(row, 'episodes')} episodes"

    return (
        f"At the start of a training EUPG's gradient has as much signal as noise after "
        f"{episodes(gradient_noise.NONE)}; less the mean of all other episodes after "
        f"{episodes(gradient_noise.MEAN)}; less that of the seven others of the same site, start and weather, as in "
        f"Group PPO, after {episodes(gradient_noise.SITE)}. Of thaw alone it is "
        f"{episodes(gradient_noise.NONE, 'thaw')} and {episodes(gradient_noise.SITE, 'thaw')}. "
        f"A training has {DEFAULT_STEPS['generalist'] // DEFAULT_YEARS:,} episodes.\n"
    )


def with_interval(row, name: str) -> str:
    """A number of a table to two digits, with its 95 % interval where it has one."""
    value, low, high = (row.get(key, np.nan) for key in (name, f"{name}_low", f"{name}_high"))
    if pd.isna(value):
        return ""
    return two_digits(value) if pd.isna(low) else f"{two_digits(value)} [{two_digits(low)}, {two_digits(high)}]"


def two_digits(value: float) -> str:
    """1,500,000, 24, 0.13, -0.001."""
    if np.isinf(value):
        return "∞"
    rounded = float(f"{value:.2g}")
    return f"{rounded:,.0f}" if abs(rounded) >= 10 else f"{rounded:g}"


def first_run() -> str:
    """The end of what the first run printed."""
    path = paths.results() / "first_run.txt"
    if not path.exists():
        return "*Not run yet: `python analysis/follow_readme.py` runs it, and puts its end here.*\n"
    text = path.read_text(encoding="utf-8")
    return f"```text\n{text[text.index('SCORE') :].rstrip()}\n```\n"


def times() -> str:
    """How long the README's commands took when it was followed last."""
    path = paths.results() / "readme.csv"
    if not path.exists():
        return "*Not timed yet: `python analysis/follow_readme.py` does what stands above, and times it.*\n"
    table = pd.read_csv(path)
    steps = ", ".join(f"`{row.command}` {duration(row.seconds)}" for row in table.itertuples())
    return f"*On {table.machine[0]}: {steps}.*\n"


def duration(seconds: float) -> str:
    """Seconds, or minutes from two on."""
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


def cells(line: str) -> list[str]:
    """Of a row of a Markdown table."""
    return [cell.strip() for cell in line.strip("|\n").split("|")]


def scores(page: str, tower: str) -> dict[str, list[str]]:
    """Quantity -> its scores in a tower's table."""
    part = page.split(f"### {tower},")[1]
    header, _, *rows = re.search(r"\|.*months: bias.*\n(\|.*\n)+", part)[0].splitlines()
    columns = [cells(header).index(name) for name in SCORES]
    return {cells(row)[0]: [cells(row)[column] for column in columns] for row in rows}


def misses(page: str) -> int:
    """How many values the list at the page's end has of what was measured or published."""
    rows = re.findall(r"^\| .*", page.split("What misses\n")[1], re.MULTILINE)[2:]
    return sum(not row.startswith(f"| {robustness_report.SPAN} |") for row in rows)


def of_judged(page: str) -> str:
    """How many values miss of those that are judged, and how many of the others were calibrated."""
    tables = "\n".join(line for line in page.split("What misses\n")[0].splitlines() if line.startswith("|"))
    within = Counter(re.findall(r"(?:\| |\) )(in, calibrated|in)(?= \||, \d)", tables))
    count = misses(page)
    return f"{count} of {count + within.total()} judged values ({within['in, calibrated']} of the others calibrated)"


def towers() -> str:
    """Both towers by month, and how many values of the whole page miss."""
    page = VALIDATION.read_text(encoding="utf-8")
    first, second = (scores(page, tower) for tower in TOWERS)
    header = ["monthly means", *(f"{tower}: {name.split()[-1]}" for tower in TOWERS for name in SCORES)]
    table = markdown(header, [[name, *first[name], *second[name]] for name in first])
    miss = f"{of_judged(page)} of that page miss what was measured or published, and are listed at its end."
    return f"{table}\n{miss}\n"


def missing() -> str:
    """The README's line on what misses."""
    count = of_judged(VALIDATION.read_text(encoding="utf-8"))
    return f"- {count} of [docs/validation.md](docs/validation.md) miss what was measured or published.\n"
