"""What the results hang on: every site parameter at the ends of its range, every literature constant +-10 %.

    python analysis/studies/sensitivity.py                       # all, into results/sensitivity and docs/sensitivity.md
    python analysis/studies/sensitivity.py --names light_use_conifer max_lai_conifer   # these only, printed

One at a time, on the same sites, starts and weathers, under four plans: zero change, and planting 100 stems a year of
conifers, of deciduous trees, of half each. A group of parameters is one table; a command that was stopped goes on
with the next group.
"""

import sys
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

import sim
from analysis import stored
from analysis.paths import make_writable
from analysis.studies import open_loop
from analysis.validation import document
from cleanrl_style import protocol
from sim.parameters import ORDERED_CONSTANTS, Parameter
from sim.stands import available_cores

YEARS = 50
SITES, WEATHERS = 4, 1
TOP = 20
SHARE = 0.1
PLANS = {"zero change": 12, "conifers": 24, "deciduous": 20, "half": 22}

#: What +-10 % means for quantities whose zero is arbitrary: a tenth of a span, by unit or by the name's beginning.
SPANS = {
    "degC": (20.0, "a seasonal half-range of air temperature"),
    "day of year": (91.0, "a season"),
    "humidity_": (0.2, "the range of the sites' mean relative humidity"),
}

#: Published values other than the table's, several constants at once: label -> constants, mechanisms.
ALTERNATIVES = {
    "light use of conifers: PRELES of Hyytiala": (
        {
            "light_use_conifer": 0.7485,
            "light_saturation_conifer": 0.03394,
            "acclimation_days": 12.75,
            "acclimation_start_conifer_c": -3.567,
            "acclimation_span_conifer_k": 18.45,
            "dry_air_conifer": 0.1367,
        },
        {},
    ),
    "light use of conifers: PRELES of 17 boreal forests": (
        {
            "light_use_conifer": 0.743,
            "light_saturation_conifer": 0.04258,
            "acclimation_days": 7.51,
            "acclimation_start_conifer_c": -3.804,
            "acclimation_span_conifer_k": 17.85,
            "dry_air_conifer": 0.1426,
        },
        {},
    ),
    "light use of deciduous trees that of conifers": (
        {
            "light_use_deciduous": 0.7457,
            "light_saturation_deciduous": 0.03673,
            "acclimation_start_deciduous_c": -3.063,
            "acclimation_span_deciduous_k": 17.72,
            "dry_air_deciduous": 0.1027,
        },
        {},
    ),
    "crowns of both species develop alike": ({}, {"crown_development": False}),
    "organic layer thin: .15 conifer, .05 deciduous": (
        {"organic_depth_conifer_m": 0.15, "organic_depth_deciduous_m": 0.05},
        {},
    ),
    "organic layer thick: .18 conifer, .10 deciduous": (
        {"organic_depth_conifer_m": 0.18, "organic_depth_deciduous_m": 0.10},
        {},
    ),
}

#: Columns that the effects are measured on.
MEASURES = {
    "zero_carbon": "carbon return of zero change",
    "zero_thaw": "thaw return of zero change",
    "gain_carbon": "carbon gain of planting, mean of the three plans",
    "gain_thaw": "thaw gain of planting, mean of the three plans",
    "species_carbon": "carbon return of planting conifers less that of planting deciduous trees",
    "species_thaw": "the same of the thaw return",
}


@dataclass
class Args:
    """Measures what returns, gains and the conflict between the objectives hang on."""

    names: tuple[str, ...] = ()
    """only these parameters and constants, printed and not written"""
    output_dir: Path = Path("results/sensitivity")
    """folder of the tables"""
    document: Path = Path("docs/sensitivity.md")
    """the page that is written when all are there"""


@dataclass(frozen=True)
class Variant:
    """One factor at one level: what differs from the default."""

    factor: str
    level: str
    value: str
    group: str
    site: dict = field(default_factory=dict)
    constants: dict = field(default_factory=dict)
    mechanisms: dict = field(default_factory=dict)


DEFAULT = Variant("default", "default", "", "default")


# ------------------------------------------------------------------------------------------------ levels


def levels(name: str, constants: dict[str, Parameter] = sim.CONSTANTS, share: float = SHARE) -> tuple[float, float]:
    """The two values that a constant is set to: a share below and above its own.

    A share of the value, or of a span where zero is arbitrary (SPANS); no farther than the physical limit, and half
    way to the constant that it has to stay below or above (`sim.parameters.ORDERED_CONSTANTS`).
    """
    constant = constants[name]
    value = constant.low
    spans = [span for key, (span, _) in SPANS.items() if constant.unit == key or name.startswith(key)]
    step = share * (spans[0] if spans else abs(value))
    low, high = max(value - step, constant.physical_low), min(value + step, constant.physical_high)
    for smaller, larger in ORDERED_CONSTANTS:
        if name == smaller:
            high = min(high, 0.5 * (value + constants[larger].low))
        if name == larger:
            low = max(low, 0.5 * (value + constants[smaller].low))
    return low, high


def variants() -> list[Variant]:
    """All of them, in the order of the tables."""
    found = [DEFAULT]
    for name, parameter in sim.SITE_PARAMETERS.items():
        middle = 0.5 * (parameter.low + parameter.high)
        for level, value in (("low", parameter.low), ("middle", middle), ("high", parameter.high)):
            found.append(Variant(name, level, f"{value:.4g}", f"site {parameter.group}", site={name: value}))
    for name, constant in sim.CONSTANTS.items():
        for level, value in zip(("low", "high"), levels(name), strict=True):
            if value != constant.low:  # else it is at its limit already
                found.append(
                    Variant(name, level, f"{value:.4g}", f"constants {constant.group}", constants={name: value})
                )
    for label, (constants, mechanisms) in ALTERNATIVES.items():
        found.append(Variant(label, "high", "as named", "alternatives", constants=constants, mechanisms=mechanisms))
    return found


# ------------------------------------------------------------------------------------------------ episodes


def play(variant: Variant, site_seeds: list[int], weathers: int, years: int) -> pd.DataFrame:
    """Mean returns over the weathers; a row for each site and plan."""
    design = [(site, weather, plan) for site in site_seeds for weather in range(weathers) for plan in PLANS.values()]
    sites = [sim.sample_site(site, variant.site) for site, _, _ in design]
    seeds = [open_loop.seeds(site, weather) for site, weather, _ in design]
    plans = np.repeat([[plan] for _, _, plan in design], years, axis=1)
    episodes = open_loop.play(
        sites, seeds, plans, constants=variant.constants, mechanisms=variant.mechanisms, threads=1
    )
    means = episodes.returns().reshape(len(site_seeds), weathers, len(PLANS), 2).mean(axis=1)
    index = pd.MultiIndex.from_product([site_seeds, PLANS], names=["site", "plan"])
    table = pd.DataFrame(means.reshape(-1, 2), index=index, columns=list(open_loop.OBJECTIVES)).reset_index()
    return table.assign(factor=variant.factor, level=variant.level, value=variant.value)


def play_all(chosen: list[Variant], site_seeds: list[int], played) -> pd.DataFrame:
    """The variants side by side, one a core; `played` is called after each with their number."""
    with ThreadPoolExecutor(available_cores()) as pool:
        tables = []
        for table in pool.map(lambda variant: play(variant, site_seeds, WEATHERS, YEARS), chosen):
            tables.append(table)
            played(1)
    return pd.concat(tables, ignore_index=True)


# ------------------------------------------------------------------------------------------------ effects


def measures(table: pd.DataFrame) -> pd.DataFrame:
    """MEASURES of every factor and level, means over the sites; index (factor, level)."""
    means = table.groupby(["factor", "level", "plan"])[list(open_loop.OBJECTIVES)].mean().unstack("plan")
    columns = {}
    for name in open_loop.OBJECTIVES:
        of = means[name]
        columns[f"zero_{name}"] = of["zero change"]
        columns[f"gain_{name}"] = of[["conifers", "deciduous", "half"]].mean(axis=1) - of["zero change"]
        columns[f"species_{name}"] = of["conifers"] - of["deciduous"]
    return pd.DataFrame(columns)[list(MEASURES)]


def effects(table: pd.DataFrame) -> pd.DataFrame:
    """How far each factor moves MEASURES; a row a factor, in the order of the table.

    The measure at the high level less that at the low one; the default stands in for a level that is missing, because
    the constant is at its limit or the factor is a named alternative. Columns besides: low, high (the values), and
    bend: the largest distance of a middle level from the straight line between the ends, over the largest effect.
    """
    by_level = measures(table)
    default = by_level.loc[("default", "default")]
    values = table.drop_duplicates(["factor", "level"]).set_index(["factor", "level"]).value
    rows = []
    for factor in table.factor.unique():
        if factor == "default":
            continue
        there = by_level.loc[factor]
        low, high = (there.loc[level] if level in there.index else default for level in ("low", "high"))
        moved = high - low
        middle = there.loc["middle"] if "middle" in there.index else 0.5 * (low + high)
        bend = (middle - 0.5 * (low + high)).abs().max() / moved.abs().max() if moved.any() else 0.0
        ends = {level: values.get((factor, level), "") for level in ("low", "high")}
        rows.append({"factor": factor, **ends, **moved, "bend": bend})
    return pd.DataFrame(rows)


def by_size(moved: pd.DataFrame, columns: Iterable[str]) -> pd.DataFrame:
    """Sorted by the sum of the absolute effects on these columns, the largest first."""
    return moved.loc[moved[list(columns)].abs().sum(axis=1).sort_values(ascending=False, kind="stable").index]


# ------------------------------------------------------------------------------------------------ the page


def markdown(moved: pd.DataFrame, extra: tuple[str, ...] = ()) -> str:
    """A table of effects, with more of their columns."""
    columns = (*MEASURES, *extra)
    lines = ["| | low | high | " + " | ".join(columns) + " |", "|---|---|---|" + "---|" * len(columns)]
    for _, row in moved.iterrows():
        numbers = " | ".join(f"{row[name]:+.2f}" for name in columns)
        name = f"`{row.factor}`" if " " not in row.factor else row.factor
        lines.append(f"| {name} | {row.low} | {row.high} | {numbers} |")
    return "\n".join(lines)


def page(table: pd.DataFrame) -> str:
    """docs/sensitivity.md."""
    default = measures(table).loc[("default", "default")]
    moved = effects(table)
    site = moved.factor.isin(sim.SITE_PARAMETERS)
    constant = moved.factor.isin(sim.CONSTANTS)
    returns, conflict = ("zero_carbon", "zero_thaw"), ("species_carbon", "species_thaw")
    spans = ";\n".join(
        f"`{name}`: {SHARE * span:g}, a tenth of {what} ({span:g})" for name, (span, what) in SPANS.items()
    )
    defaults = "\n".join(f"| `{name}` | {meaning} | {default[name]:+.2f} |" for name, meaning in MEASURES.items())
    return (
        document.fill(f"""# What the results hang on

Written by `python analysis/studies/sensitivity.py`; not to be edited. Every site parameter at the low and the high end
of its sampled range, and every literature constant {SHARE:.0%} below and above its value, one at a time:
50-year returns on {SITES} sites that span what is sampled (weathers on each: {WEATHERS}), everything else held,
the dice included. The world is the paper's, `boreal-generalist-v0`: what only `boreal-balanced-v0` uses
(`noise_factor_*`, `wet_day_factor`, `wind_spread`, `*_observed_*`) cannot act in it, so that its zeros say nothing of
that task. The sites start with their own stands. Planting is 100 stems/ha a year wherever that can be
done. What was measured:

| | | at the default |
|---|---|---|
{defaults}

The tables below give how far each factor moves these: the measure at the high value less that at the low one.
A constant is not moved past its physical limit, nor more than half way to another that must stay larger or
smaller; then the step
is smaller, as the two columns show; an empty cell is the default. Where zero is arbitrary, {SHARE:.0%} would mean
nothing and the step (for the constants of that unit, or whose name begins so) is
{spans}.
The mean annual temperature follows
the latitude, as it does when a site is sampled. A range and {SHARE:.0%} are not alike: compare parameters with
parameters and constants with constants.

Where the thaw reward is clipped at -1 in every year, as at one of the four sites at the default, small changes have no
effect, and means over sites are smaller for it. Nothing burned in the one weather, nothing was cut, and no stand
thinned itself: zeros of fire, of products and of crowding say nothing about how much they matter. There are no error
estimates: read sizes, not second digits, and no ranks of `species_thaw`, which differs more between sites and dice than
by most factors.

## Alternatives

Published values other than ours; ours with the light use, or the crowns, of both species alike; effects are against the
default.

{markdown(moved[~site & ~constant])}

## The {TOP} constants that move the conflict most

By `|species_carbon| + |species_thaw|`: which species the objectives want. Their order is not to be read.

{markdown(by_size(moved[constant], conflict).head(TOP))}

## The {TOP} site parameters that move the conflict most

{markdown(by_size(moved[site], conflict).head(TOP))}

## The {TOP} constants that move the returns most

By `|zero_carbon| + |zero_thaw|`.

{markdown(by_size(moved[constant], returns).head(TOP))}

## The {TOP} site parameters that move the returns most

{markdown(by_size(moved[site], returns).head(TOP))}

## All site parameters

`bend`: how far the middle of the range is from the straight line between its ends, the largest of all measures, as a
share of the largest effect of all.

{markdown(moved[site], ("bend",))}

## All constants

{markdown(moved[constant])}""")
        + "\n"
    )


def main(args: Args) -> None:
    """Play every group that is not finished, then write the page; or print the factors that were named."""
    everything = variants()
    site_seeds = open_loop.spanning_sites(SITES)
    if args.names:
        unknown = [name for name in args.names if name not in {variant.factor for variant in everything}]
        if unknown:
            sys.exit(
                f"error: --names {unknown[0]}: a name in sim/constants.csv or sim/site_parameters.csv, "
                "or an alternative's, is allowed"
            )
        chosen = [variant for variant in everything if variant.factor in ("default", *args.names)]
        progress = protocol.Progress("sensitivity", len(chosen), "variants")
        table = play_all(chosen, site_seeds, progress.add)
        print(measures(table).to_string(float_format="%+.3f"))
        print(effects(table).to_string(float_format="%+.3f", index=False))
        return

    make_writable("--output-dir", args.output_dir)
    make_writable("--document", args.document.parent)
    settings = {"sites": site_seeds, "weathers": WEATHERS, "years": YEARS, "share": SHARE}
    groups: dict[str, list[Variant]] = {}
    for variant in everything:
        groups.setdefault(variant.group, []).append(variant)
    paths = {group: args.output_dir / f"{group.replace(' ', '_')}.csv" for group in groups}
    made_by = {
        group: settings | {"variants": [f"{v.factor} {v.level} {v.value}" for v in of]} for group, of in groups.items()
    }
    todo = [group for group in groups if not stored.is_finished(paths[group], made_by[group])]
    print(f"{len(groups) - len(todo)} of {len(groups)} groups are there, in {args.output_dir}", flush=True)
    progress = protocol.Progress("sensitivity", sum(len(groups[group]) for group in todo), "variants")
    for group in todo:
        stored.write(paths[group], play_all(groups[group], site_seeds, progress.add), made_by[group])
    table = pd.concat([stored.read(path, text=("value",)) for path in paths.values()], ignore_index=True)
    stored.write(args.output_dir / "effects.csv", effects(table), settings)
    with protocol.replacing(args.document) as file:
        file.write(page(table).encode())
    print(f"wrote {args.output_dir / 'effects.csv'} and {args.document}")


if __name__ == "__main__":
    main(protocol.parse(Args))
