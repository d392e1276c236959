"""Conservation under stress: random and extreme stand-years, with every balance, stock and range checked.

    python analysis/stress.py [--stand-years 100000] [--seed 1] [--threads 2]

A batch is sixteen stands that are spun up and then managed, some at random, some without moderation. All of it
is drawn from the seed and the batch's number, which is how a failure is replayed:

    python analysis/stress.py --seed 1 --batch 137

prints every failure of that batch with all its terms. Writes results/stress: residuals.csv (a row a group, the
tolerances first), extremes.csv (smallest and largest value of everything that has a range), failures.csv.
Ends with exit code 1 if anything failed.
"""

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd

import sim
from analysis.paths import make_writable
from cleanrl_style import protocol
from sim.block import LANES
from sim.closure import TOLERANCES
from sim.demography import AGES
from sim.management import LARGEST_DENSITY, LEAST_DENSITY
from sim.organic import LEAST_DEPTH_M
from sim.parameters import ORDERED_CONSTANTS, WHOLE_CONSTANTS, Parameter
from sim.physical_constants import LATENT_HEAT_FUSION, LATENT_HEAT_VAPORISATION
from sim.spin_up import CLASS_NAMES, INITIAL_LIMITS
from sim.stands import available_cores
from sim.state import CARBON_BUDGETS, DAILY_NAMES, DAYS, PARAMETER_NAMES, STATE_NAMES
from sim.trunk import LEAST_TRUNK_CAPACITY


@dataclass(frozen=True)
class Group:
    """How a batch's sites, constants, switches and first stocks are drawn.

    sites : limits of the 62 parameters, "sampled" or "physical"; corners : each parameter at one of its limits,
    instead of anywhere between; constants : all literature constants drawn too, in the same way, within physical
    limits; switches : each mechanism on or off; first_stocks : each at one of its physical limits.
    """

    sites: str
    corners: bool = False
    constants: bool = False
    switches: bool = False
    first_stocks: bool = False
    years: int = 10


GROUPS = {
    "sampled sites": Group("sampled", years=25),
    "sampled corners": Group("sampled", corners=True),
    "first stocks": Group("sampled", first_stocks=True),
    "switches": Group("sampled", switches=True),
    "physical limits": Group("physical"),
    "physical corners": Group("physical", corners=True),
    "constants": Group("physical", constants=True),
    "constant corners": Group("physical", corners=True, constants=True),
    "all at once": Group("physical", corners=True, constants=True, switches=True, first_stocks=True),
}
STEP_MINUTES = {10: 0.05, 15: 0.05, 20: 0.10, 30: 0.40, 60: 0.20, 120: 0.20}  # and the share of batches with it
HALF_LIVES = (None, 0.1, 20.0, 1e4)  # of wood products [yr]
CLASSES_TO_CUT = ("young", "mature", "old")

#: Stocks of `CARBON_BUDGETS`, as the state has them.
CARBON_STORES = {
    "biomass_kgc_m2": ("conifer_biomass", "deciduous_biomass"),
    "soil_kgc_m2": ("soil_carbon",),
    "conifer_deadwood_kgc_m2": ("conifer_deadwood",),
    "deciduous_deadwood_kgc_m2": ("deciduous_deadwood",),
    "hwp_kgc_m2": ("products",),
}

#: What is added up again from states and records, without the kernel's help: name -> tolerance, per (1 + the stock or
#: the year's flux that the sum contains).
YEARLY_BUDGETS = {
    "carbon_of_the_year_kgc_m2": 1e-9,
    "biomass_of_the_year_kgc_m2": 1e-9,
    "soil_of_the_year_kgc_m2": 1e-9,
    "conifer_deadwood_of_the_year_kgc_m2": 1e-9,
    "deciduous_deadwood_of_the_year_kgc_m2": 1e-9,
    "hwp_of_the_year_kgc_m2": 1e-9,
    "water_of_the_year_mm": 1e-9,
    "deep_heat_of_the_year_mj_m2": 1e-9,
    "latent_heat_of_the_year_mj_m2": 1e-9,
}

#: Largest difference of a day's mean temperature from the air's [K]: (sites in the sampled ranges, all others).
#: Half as much again as was seen: a guard against a node that runs away, not a statement on nature.
FARTHEST_FROM_AIR = {"canopy_temperature_c": (20.0, 190.0), "ground_temperature_c": (20.0, 120.0)}
#: Range of the soil's daily means [degC], likewise.
SOIL_TEMPERATURES = ((-50.0, 40.0), (-120.0, 120.0))


@dataclass
class Args:
    """Runs random and extreme stand-years and checks that nothing is lost, negative or out of range."""

    stand_years: int = 100_000
    """stand-years to plan, at the least; a batch in which a year does not close ends there"""
    seed: int = 1
    """of all that is drawn"""
    threads: int = available_cores()
    """batches at a time"""
    batch: int | None = None
    """run this batch alone, and print its failures in full"""
    output_dir: Path = Path("results/stress")
    """folder for residuals.csv, extremes.csv and failures.csv"""


@dataclass
class Outcome:
    """What a batch has shown. Residuals are scaled as their tolerances are; failures name stand, year and quantity."""

    number: int
    group: str
    minutes: int
    stand_years: int = 0
    residuals: dict[str, float] = field(default_factory=lambda: dict.fromkeys((*TOLERANCES, *YEARLY_BUDGETS), 0.0))
    extremes: dict[str, tuple] = field(default_factory=dict)  # name -> (lowest, highest, allowed low, allowed high)
    failures: list[dict] = field(default_factory=list)

    def fail(self, kind: str, stand, year: int, what: str) -> None:
        """Note a failure: kind is "balance", "not finite" or "out of range"."""
        self.failures.append(
            {
                "batch": self.number,
                "group": self.group,
                "time_step_minutes": self.minutes,
                "kind": kind,
                "stand": stand,
                "year": year,
                "what": what,
            }
        )


# ------------------------------------------------------------------------------------------------- what is drawn


def draw_values(generator, table: dict[str, Parameter], limits: str, corners: bool) -> dict[str, float]:
    """A value of every parameter of a table, between its sampled or physical limits or at one of them."""
    values = {}
    for name, p in table.items():
        low, high = (p.low, p.high) if limits == "sampled" else (p.physical_low, p.physical_high)
        values[name] = float(generator.choice((low, high)) if corners else generator.uniform(low, high))
    return values


def draw_constants(generator, corners: bool) -> dict[str, float]:
    """All constants within physical limits; those that need an order are drawn again until they have it."""
    constants = draw_values(generator, sim.CONSTANTS, "physical", corners)
    while disordered := [pair for pair in ORDERED_CONSTANTS if constants[pair[0]] >= constants[pair[1]]]:
        pair = {name: sim.CONSTANTS[name] for name in disordered[0]}
        constants |= draw_values(generator, pair, "physical", corners)
    return constants | {name: float(round(constants[name])) for name in WHOLE_CONSTANTS}


def draw_actions(generator, years: int) -> np.ndarray:
    """Actions of a stand, shape (years,): at random, or a stubborn forester's."""
    mix = int(generator.integers(5))
    forester = generator.choice(["random", "plants", "thins", "alternates", "one species", "rests"])
    if forester == "plants":
        return np.full(years, 20 + mix)
    if forester == "thins":
        return np.full(years, mix)
    if forester == "alternates":
        return np.where(np.arange(years) % 2, mix, 24 - mix)
    if forester == "one species":
        return 5 * generator.integers(5, size=years) + 4 * (mix % 2)
    return np.full(years, 12) if forester == "rests" else generator.integers(25, size=years)


def draw_first_stocks(generator) -> dict[str, float]:
    """First stocks, each at one of its physical limits; stems as a whole, or by species and age class."""
    by_class = generator.random() < 0.5
    left_out = ("density_stems_ha", "conifer_fraction", "oldest_age_years") if by_class else CLASS_NAMES
    return {name: float(generator.choice(pair)) for name, pair in INITIAL_LIMITS.items() if name not in left_out}


def draw_batch(seed: int, number: int) -> tuple[Outcome, sim.Stands, dict, np.ndarray]:
    """A batch before it begins: empty outcome, stands, arguments of `Stands.start`, actions (years, stands)."""
    name = list(GROUPS)[number % len(GROUPS)]
    group = GROUPS[name]
    generator = np.random.default_rng([seed, number])
    minutes = int(generator.choice(list(STEP_MINUTES), p=list(STEP_MINUTES.values())))
    stands = sim.Stands(
        LANES,
        time_step_minutes=minutes,
        constants=draw_constants(generator, group.corners) if group.constants else None,
        mechanisms={switch: bool(generator.integers(2)) for switch in sim.MECHANISMS} if group.switches else None,
        hwp_half_life_years=HALF_LIVES[generator.integers(len(HALF_LIVES))],
        harvest_min_class=CLASSES_TO_CUT[generator.integers(len(CLASSES_TO_CUT))],
        threads=1,
    )
    start = {
        "stands": np.arange(LANES),
        "sites": [draw_values(generator, sim.SITE_PARAMETERS, group.sites, group.corners) for _ in range(LANES)],
        "seeds": [sim.episode_seeds(int(generator.integers(2**62))) for _ in range(LANES)],
        "initial": {k: draw_first_stocks(generator) for k in range(LANES)} if group.first_stocks else None,
    }
    actions = np.stack([draw_actions(generator, group.years) for _ in range(LANES)], axis=1)
    return Outcome(number, name, minutes), stands, start, actions


# ----------------------------------------------------------------------------------------------- what is checked


def budgets(before: np.ndarray, after: np.ndarray, record: dict) -> Iterator[tuple[str, np.ndarray]]:
    """Yearly budgets added up from the states before and after and the record: (name, scaled failure (stands,))."""

    def change(*names):
        columns = [STATE_NAMES.index(name) for name in names]
        stock = np.abs(before[:, columns]).sum(axis=1) + np.abs(after[:, columns]).sum(axis=1)
        return (after[:, columns] - before[:, columns]).sum(axis=1), stock

    r = record
    carbon, stock = change(*(store for stores in CARBON_STORES.values() for store in stores))
    crossed = (
        r["gpp_kgc_m2"]
        - r["autotrophic_respiration_kgc_m2"]
        - r["heterotrophic_respiration_kgc_m2"]
        - r["fire_loss_kgc_m2"]
        - r["harvest_emission_kgc_m2"]
        - r["hwp_decay_kgc_m2"]
    )
    yield "carbon_of_the_year_kgc_m2", np.abs(carbon - crossed) / (1.0 + stock)
    for name, stores in CARBON_STORES.items():
        carbon, stock = change(*stores)
        gains, losses = (sum(r[flux] for flux in fluxes) for fluxes in CARBON_BUDGETS[name])
        yield f"{name.removesuffix('_kgc_m2')}_of_the_year_kgc_m2", np.abs(carbon - gains + losses) / (1.0 + stock)

    water, stock = change("swe", "canopy_snow", "canopy_rain", "organic_water", "soil_water")
    crossed = r["precipitation_mm"] - r["evapotranspiration_mm"] - r["runoff_mm"]
    flux = r["precipitation_mm"] + np.abs(r["evapotranspiration_mm"]) + r["runoff_mm"]
    yield "water_of_the_year_mm", np.abs(water - crossed) / (1.0 + stock + flux)

    heat, stock = change("deep_heat")
    yield "deep_heat_of_the_year_mj_m2", np.abs(1e-6 * heat - r["deep_heat_gain_mj_m2"]) / (1.0 + 1e-6 * stock)

    latent = LATENT_HEAT_VAPORISATION * r["evapotranspiration_mm"] + LATENT_HEAT_FUSION * r["sublimation_mm"]
    failure = np.abs(1e-6 * latent - r["latent_heat_mj_m2"])
    yield "latent_heat_of_the_year_mj_m2", failure / (1.0 + np.abs(r["latent_heat_mj_m2"]))


def ranges(group: Group, parameters: dict, state: dict, stems: np.ndarray, record: dict, daily: dict):
    """Everything that has limits: (name, values (stands, ...), low, high), where limits may differ by stand.

    Albedos are NaN where no light arrives.
    """
    p, s, r, d = parameters, state, record, daily
    rounded = 1.0 + 1e-12

    # Stocks and what else lasts: not below zero, not beyond what holds it.
    for name in (
        "conifer_biomass",
        "deciduous_biomass",
        "soil_carbon",
        "conifer_deadwood",
        "deciduous_deadwood",
        "products",
        "organic_depth",
        "swe",
        "canopy_snow",
        "drought",
    ):
        yield name, s[name], 0.0, np.inf
    yield "stems by age", stems, 0.0, np.inf
    yield "soil_water", s["soil_water"], 0.0, p["max_water_content_mm"] * rounded
    yield "organic_water", s["organic_water"], 0.0, np.inf
    lightest = np.minimum(p["snow_density_least"], p["snow_density_fresh"])  # also where no snow lies
    yield "snow_density", s["snow_density"], lightest / rounded, np.inf
    wood = p["woody_area_index"] * np.maximum(p["woody_area_deciduous"], 1.0)
    plant_area = p["max_lai_conifer"] + p["max_lai_deciduous"] * (1.0 + p["leafless_share"]) + wood
    yield "canopy_rain", s["canopy_rain"], 0.0, p["rain_capacity_mm"] * plant_area * rounded
    yield "trunk_capacity", s["trunk_capacity"], LEAST_TRUNK_CAPACITY, np.inf
    yield "snow albedo", s["albedo"], p["snow_albedo_old"] / rounded, p["snow_albedo_fresh"] * rounded

    # The year: shares, days, fluxes of one sign, and what management may do.
    for name in ("conifer_fraction", "conifer_fraction_after_action", "fire_mortality", "insect_mortality"):
        yield name, r[name], 0.0, rounded
    for name in ("snow_days", "growing_season_days"):
        yield name, r[name], 0.0, DAYS
    for name in ("summer_albedo", "winter_albedo"):
        yield name, r[name], 0.0, 1.0
    for name in (
        "litterfall_kgc_m2",
        "understorey_gpp_kgc_m2",
        "understorey_litter_kgc_m2",
        "mortality_kgc_m2",
        "fire_mortality_kgc_m2",
        "dead_litter_kgc_m2",
        "deadwood_respiration_kgc_m2",
        "fire_loss_kgc_m2",
        "burned_trees_kgc_m2",
        "burned_soil_kgc_m2",
        "harvest_kgc_m2",
        "harvest_emission_kgc_m2",
        "hwp_stored_kgc_m2",
        "hwp_decay_kgc_m2",
        "precipitation_mm",
        "canopy_sublimation_mm",
        "boundary_warming_mj_m2",
        "boundary_cooling_mj_m2",
        "planted_stems_ha",
        "thinned_stems_ha",
        "dead_stems_ha",
        "recruited_stems_ha",
        "drought_index",
        "peak_swe_mm",
        "peak_snow_depth_m",
    ):
        yield name, r[name], 0.0, np.inf
    yield "snowfall_mm", r["snowfall_mm"], 0.0, r["precipitation_mm"] * rounded
    yield "transpiration_mm", r["transpiration_mm"], 1.0 - rounded, np.inf
    deepest = (np.maximum(s["organic_depth"], LEAST_DEPTH_M) + p["boundary_depth_m"]) * rounded
    yield "active_layer_depth_m", r["active_layer_depth_m"], 0.0, deepest
    planted, thinned = r["planted_stems_ha"] > 0.0, r["thinned_stems_ha"] > 0.0
    least, largest = np.where(thinned, LEAST_DENSITY, 0.0), np.where(planted, LARGEST_DENSITY, np.inf)
    yield "density_after_action", r["density_after_action"], least / rounded, largest * rounded

    # The days.
    for name in (
        "swe_mm",
        "canopy_snow_mm",
        "lai",
        "organic_layer_m",
        "precipitation_mm",
        "shortwave_mj_m2",
        "gpp_kgc_m2",
        "autotrophic_respiration_kgc_m2",
        "heterotrophic_respiration_kgc_m2",
        "runoff_mm",
    ):
        yield f"daily {name}", d[name], 0.0, np.inf
    yield "daily soil_water_mm", d["soil_water_mm"], 0.0, p["max_water_content_mm"][:, None] * rounded
    yield "daily albedo", d["albedo"], 0.0, 1.0
    unusual = group.sites == "physical"
    for name, farthest in FARTHEST_FROM_AIR.items():
        yield f"daily {name} less air", d[name] - d["air_temperature_c"], -farthest[unusual], farthest[unusual]
    for name in ("organic_temperature_c", "surface_soil_temperature_c", "deep_soil_temperature_c"):
        yield f"daily {name}", d[name], *SOIL_TEMPERATURES[unusual]


def check_year(outcome: Outcome, year: int, stands: sim.Stands, before, record, daily) -> None:
    """Note the year's residuals and extremes, and everything that failed, in the batch's outcome."""
    r = dict(zip(sim.RECORD_NAMES, record.T, strict=True))
    d = dict(zip(DAILY_NAMES, np.moveaxis(daily, 2, 0), strict=True))
    s = dict(zip(STATE_NAMES, stands.state.T, strict=False))
    p = dict(zip(PARAMETER_NAMES, stands.parameters.T, strict=True))

    for name in TOLERANCES:
        scale = 1.0 + r["density_stems_ha"] if name == "stems_residual_ha" else 1.0
        outcome.residuals[name] = max(outcome.residuals[name], float((r[name] / scale).max()))
    for name, failure in budgets(before, stands.state, r):
        outcome.residuals[name] = max(outcome.residuals[name], float(failure.max()))
        for k in np.flatnonzero(~(failure <= YEARLY_BUDGETS[name])):
            outcome.fail("balance", k, year, f"{name} = {failure[k]:.3g} beyond {YEARLY_BUDGETS[name]:.1g}")

    dark = {"albedo": d["shortwave_mj_m2"] == 0.0, "summer_albedo": True, "winter_albedo": True}
    for name, values in (*r.items(), *d.items()):
        missing = ~(np.isfinite(values) | dark.get(name, False))
        for k in np.flatnonzero(missing.reshape(LANES, -1).any(axis=1)):
            outcome.fail("not finite", k, year, name)

    for name, values, low, high in ranges(GROUPS[outcome.group], p, s, stands.state[:, -2 * AGES :], r, d):
        seen = (np.nanmin(values), np.nanmax(values), np.min(low), np.max(high))
        outcome.extremes[name] = widened(outcome.extremes.get(name, seen), seen)
        beyond = np.maximum(low - values, values - high).reshape(LANES, -1)
        for k in np.flatnonzero((beyond > 0.0).any(axis=1)):
            worst = values.reshape(LANES, -1)[k, np.nanargmax(beyond[k])]
            ends = ", ".join(f"{np.broadcast_to(end, LANES)[k]:g}" for end in (np.ravel(low), np.ravel(high)))
            outcome.fail("out of range", k, year, f"{name} = {worst:.6g} outside [{ends}]")


def widened(a: tuple, b: tuple) -> tuple:
    """Extremes (lowest, highest, allowed low, allowed high) of two parts together."""
    return min(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3])


def run_batch(seed: int, number: int) -> Outcome:
    """Run a batch to its end, or to the first year that does not close."""
    outcome, stands, start, actions = draw_batch(seed, number)
    try:
        stands.start(**start)
        for year in range(len(actions)):
            before = stands.state.copy()
            record, daily = stands.step(actions[year], daily=True)
            outcome.stand_years += LANES
            check_year(outcome, year, stands, before, record, daily)
    except sim.PhysicsError as error:
        outcome.fail("balance", None, int(stands.years[0]), str(error))
    return outcome


# ------------------------------------------------------------------------------------------------ what is reported


def plan(stand_years: int) -> list[int]:
    """Numbers of the batches that make so many stand-years."""
    numbers, planned = [], 0
    for number in count():
        if planned >= stand_years:
            return numbers
        numbers.append(number)
        planned += planned_years(number)


def planned_years(number: int) -> int:
    """Stand-years of a batch that runs to its end."""
    return LANES * list(GROUPS.values())[number % len(GROUPS)].years


def tabulate(outcomes: list[Outcome]) -> pd.DataFrame:
    """A row a group, the tolerances first: stand-years, failures by kind, largest residuals (scaled)."""
    rows = [{"group": "tolerance", **TOLERANCES, **YEARLY_BUDGETS}]
    for group in GROUPS:
        members = [outcome for outcome in outcomes if outcome.group == group]
        kinds = [failure["kind"] for outcome in members for failure in outcome.failures]
        row = {"group": group, "stand_years": sum(outcome.stand_years for outcome in members)}
        row |= {kind.replace(" ", "_"): kinds.count(kind) for kind in ("balance", "not finite", "out of range")}
        for name in (*TOLERANCES, *YEARLY_BUDGETS) if members else ():
            row[name] = max(outcome.residuals[name] for outcome in members)
        rows.append(row)
    table = pd.DataFrame(rows)
    counts = ["stand_years", "balance", "not_finite", "out_of_range"]
    table[counts] = table[counts].astype("Int64")
    return table[["group", *counts, *TOLERANCES, *YEARLY_BUDGETS]]


def tabulate_extremes(outcomes: list[Outcome]) -> pd.DataFrame:
    """Lowest and highest value of everything that has a range, and the range; a row a group and quantity."""
    extremes = {}
    for outcome in outcomes:
        for name, seen in outcome.extremes.items():
            key = outcome.group, name
            extremes[key] = widened(extremes.get(key, seen), seen)
    columns = ["group", "quantity", "lowest", "highest", "allowed_low", "allowed_high"]
    return pd.DataFrame([(*key, *seen) for key, seen in extremes.items()], columns=columns)


def report(table: pd.DataFrame) -> str:
    """The table of residuals for the terminal, residuals as rows."""
    short = table.set_index("group").T
    lines = []
    for quantity, values in short.iterrows():
        cells = ("" if pd.isna(v) else f"{v:.1e}" if isinstance(v, float) else f"{v:,}" for v in values)
        lines.append(f"{quantity:<30}" + "".join(f"{cell:>12}" for cell in cells))
    heads = [[word.rjust(12) for word in group.rsplit(" ", 1)] for group in short.columns]
    first = " " * 30 + "".join(head[0] if len(head) > 1 else " " * 12 for head in heads)
    second = f"{'largest of the years that ran':<30}" + "".join(head[-1] for head in heads)
    return "\n".join([first.rstrip(), second, *lines])


def write(folder: Path, name: str, table: pd.DataFrame) -> None:
    """Write a table as CSV, whole or not at all."""
    with protocol.replacing(folder / name) as file:
        table.to_csv(file, index=False, float_format=protocol.FLOAT_FORMAT, lineterminator="\n")


def main(args: Args) -> None:
    """Run the batches, print and write what they have shown; exits with 1 if anything failed."""
    for name, low in (("stand_years", 1), ("batch", 0)):
        value = getattr(args, name)
        if value is not None and value < low:
            protocol.fail(f"--{name.replace('_', '-')} {value}: an integer from {low} on is allowed")
    if args.batch is not None:
        outcome = run_batch(args.seed, args.batch)
        for failure in outcome.failures:
            print(*(f"{name}={value}" for name, value in failure.items()), sep=", ")
        print(
            f"batch {args.batch} ({outcome.group}, {outcome.minutes} min): {outcome.stand_years} stand-years, "
            f"{len(outcome.failures)} failures"
        )
        sys.exit(1 if outcome.failures else 0)

    make_writable("--output-dir", args.output_dir)
    protocol.compile_physics([LANES])
    numbers = plan(args.stand_years)
    progress = protocol.Progress("stress", sum(map(planned_years, numbers)), "stand-years")
    began, outcomes = perf_counter(), []
    with ThreadPoolExecutor(args.threads) as pool:
        for outcome in pool.map(lambda number: run_batch(args.seed, number), numbers):
            outcomes.append(outcome)
            progress.add(planned_years(outcome.number))
    seconds = perf_counter() - began

    table = tabulate(outcomes)
    failures = [failure for outcome in outcomes for failure in outcome.failures]
    write(args.output_dir, "residuals.csv", table)
    write(args.output_dir, "extremes.csv", tabulate_extremes(outcomes))
    columns = ["batch", "group", "time_step_minutes", "kind", "stand", "year", "what"]
    write(args.output_dir, "failures.csv", pd.DataFrame(failures, columns=columns))
    total = sum(outcome.stand_years for outcome in outcomes)
    print(report(table))
    print(
        f"{total:,} stand-years in {len(outcomes)} batches, {seconds:.0f} s, {total / seconds:,.0f} a second with "
        f"{args.threads} threads; spin-up comes on top. Tables are in {args.output_dir}"
    )
    if failures:
        first = {failure["batch"]: failure for failure in reversed(failures)}
        for number, failure in sorted(first.items())[:10]:
            print(
                f"{failure['group']}: {failure['what'][:100]}; replay it with\n"
                f"    python analysis/stress.py --seed {args.seed} --batch {number}"
            )
        sys.exit(f"{len(failures)} failures in {len(first)} batches")


if __name__ == "__main__":
    main(protocol.parse(Args))
