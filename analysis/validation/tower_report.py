"""The part of the validation on two towers: records, runs, tables, figures, and what misses."""

from dataclasses import dataclass

import pandas as pd

from analysis.validation import document, poker_flat, tower_comparison, tower_figures, tower_stands, towers
from analysis.validation.document import Miss, Part, number, percent
from analysis.validation.scores import skill
from analysis.validation.tower_comparison import QUANTITIES
from sim.io import disaggregation
from sim.parameters import CONSTANTS
from sim.physical_constants import LATENT_HEAT_FUSION, MJ_PER_DAY, WATER_DENSITY

SUMMER = (6, 7, 8)
THAW = (4, 5, 6)
THAWED_C = 0.5  # of the soil at 5 cm under a snowpack that has gone
SNOW_DENSITY = (170.0, 217.0)  # kg m-3: Ikawa et al. 2024 at US-Prr in March 2013; Sturm et al. 2010, taiga

LIKELY = {
    "SE-Svb": {
        "GPP": "light use is that of ten Nordic forests; what the understorey adds is counted again; the record "
        "derives it from net exchange with a respiration that doubles in twelve days of August",
        "ecosystem respiration": "soil carbon is assumed; respiration of roots follows the air, not the warm soil",
        "net exchange": "respiration follows the temperature of air and soil alone, the record's changes within days",
        "latent heat": "transpiration follows net radiation; canopy evaporation in autumn",
        "sensible heat": "the tower's energy balance is open: H + LE is too small in the record",
        "ground heat": "one surface node below the organic layer; soil that freezes early",
        "soil temperature": "one store of water in the organic layer, one surface node below it",
        "albedo": "snow in the crowns changes no albedo; sky light and low sun",
    },
    "US-Prr": {
        "GPP": "light use of Nordic forests, on cold and poor ground; deciduous shrubs have no phenology",
        "ecosystem respiration": "one soil pool; the understorey respires as it photosynthesises, not in winter",
        "net exchange": "shrubs and moss have no phenology; soil carbon is assumed",
        "latent heat": "the ground evaporates too much, most in the weeks after melt (April to June): its moss stays "
        "wet, since the soil below gives it water; the tower's open balance",
        "sensible heat": "too little heat goes into the ground in summer, so more goes to the air",
        "net radiation": "snow's albedo, and the temperature of the ground's surface",
        "soil temperature": "one store of water in the organic layer: its moss does not dry by itself; snow too thin",
        "albedo": "crowns hide the snow at a low sun, and the snow on them changes no albedo; the thin snow of "
        "autumn is soon gone",
    },
}
#: Compared without a verdict, with the reason in the text.
UNJUDGED = {"SE-Svb": (), "US-Prr": ("ground heat",)}
SNOW_DEPTH_TOLERANCE = 0.2  # of the measured depth
SPRING_SENSORS_M = 0.44  # below the moss's surface: the mean of 0.34, 0.44 and 0.54
SENSOR_DEPTH_M = 0.19  # at US-Prr, below the surface: 0.14 m of moss above the sensors' zero (Ikawa et al. 2024), 0.05


@dataclass(frozen=True)
class Comparison:
    """A tower's measured days and, modelled, the daily output for them."""

    site: str
    fluxes: pd.DataFrame
    modelled: pd.DataFrame

    @property
    def pairs(self) -> dict[str, pd.DataFrame]:
        return tower_comparison.pair(self.fluxes, self.modelled)


def svartberget(repeats: int) -> Comparison:
    """SE-Svb 2019 in half-hours, the year run `repeats` times."""
    tower = towers.SE_SVB
    record = towers.read(tower)
    forcing = towers.forcing(record, tower)
    fluxes = towers.daily_fluxes(towers.fluxes(record, tower))
    sun = forcing["shortwave_w_m2"].resample("D").mean()
    fluxes["albedo"] = (1.0 - fluxes["net_shortwave_w_m2"] / sun).where(sun > poker_flat.LEAST_SUN_W_M2)
    fluxes["albedo_measured"] = fluxes["net_shortwave_w_m2_measured"]
    return Comparison("SE-Svb", fluxes, tower_comparison.simulate(tower_stands.SE_SVB, forcing, fluxes.index, repeats))


def poker_flat_days(repeats: int, stand=tower_stands.US_PRR, measured_spring: bool = False) -> Comparison:
    """US-Prr 2011-14 from daily weather, the four years run `repeats` times."""
    fluxes = poker_flat.daily_fluxes(poker_flat.record())
    forcing = poker_flat.forcing(measured_spring)
    modelled = tower_comparison.simulate(stand, forcing, fluxes.index, repeats)
    modelled["soil_top_temperature_c"] = temperature_in_moss(modelled, SENSOR_DEPTH_M)
    return Comparison("US-Prr", fluxes, modelled)


def temperature_in_moss(modelled: pd.DataFrame, depth: float) -> pd.Series:
    """Modelled temperature [degC] at a depth [m] in the organic layer: straight lines between its surface, its middle
    and the top of the mineral soil."""
    whole = modelled["organic_layer_m"]
    upper, middle, lower = (modelled[f"{node}_temperature_c"] for node in ("ground", "organic", "soil_top"))
    share = 2.0 * depth / whole
    above = upper + (middle - upper) * share.clip(0.0, 1.0)
    return above.where(share <= 1.0, middle + (lower - middle) * (share - 1.0).clip(0.0, 1.0))


def temperature_below_moss(modelled: pd.DataFrame, depth: float) -> pd.Series:
    """Modelled temperature [degC] at a depth [m] below the moss's surface, in the mineral soil: a straight line between
    its top and the middle of the surface soil.

    Raises ValueError for a depth that is not between the two.
    """
    node = CONSTANTS["surface_soil_depth_m"].low / 2.0
    share = (depth - modelled["organic_layer_m"]) / node
    if not share.between(0.0, 1.0).all():
        raise ValueError(f"{depth:g} m is not between the organic layer and {node:g} m below it")
    upper, lower = modelled["soil_top_temperature_c"], modelled["surface_soil_temperature_c"]
    return upper + share * (lower - upper)


def report(repeats: int) -> Part:
    """Both towers; the record's years are run `repeats` times and the last time is compared."""
    swedish, alaskan = svartberget(repeats), poker_flat_days(repeats)
    misses = [*_misses(swedish), *_misses(alaskan)]
    svb_text, svb_misses = _svartberget_text(swedish)
    prr_text, prr_misses = _poker_flat_text(alaskan, repeats)
    figures = {
        "validation_SE-Svb.png": tower_figures.draw(
            "SE-Svb 2019: simulator under the tower's weather",
            swedish.pairs,
            swedish.modelled["swe_mm"],
            "measured, 5 cm",
            weeks=True,
        ),
        "validation_US-Prr.png": tower_figures.draw(
            "US-Prr 2011-14: simulator under the tower's weather",
            alaskan.pairs,
            alaskan.modelled["swe_mm"],
            "measured, 5 cm below the moss",
            weeks=False,
        ),
    }
    again = f"A tower's years are run {repeats} times over, so that soil and snow are in balance; the last is compared."
    return Part(f"{_INTRODUCTION} {again}\n\n{svb_text}\n\n{prr_text}", figures, [*misses, *svb_misses, *prr_misses])


_INTRODUCTION = f"""The simulator takes the tower's weather instead of its own, and a stand from inventories
(`analysis/validation/tower_stands.py` has every value with its source; soil carbon and boundary are in part assumed,
and at SE-Svb the boundary has the mean of the soil temperature that is compared). One constant was calibrated on fluxes
of these towers: the Priestley-Taylor coefficient of conifers (LE/(LE + H) of June to August at SE-Svb, even days only;
part 3). Those of the weather generator are not in play here.

A quantity misses if the bias of its months (modelled less measured) exceeds {percent(QUANTITIES["GPP"].tolerance)} of
their mean magnitude, or their RMSE {percent(QUANTITIES["GPP"].largest_rmse)} of it, as where seasons go wrong that make
up for each other; for temperature, {QUANTITIES["soil temperature"].tolerance:g} and
{QUANTITIES["soil temperature"].largest_rmse:g} degC; for albedo, {QUANTITIES["albedo"].tolerance:g} of bias; for the
day that snow is gone, {tower_comparison.DAYS_OF_SNOW_OFF:g} days; for a depth of snow,
{percent(SNOW_DEPTH_TOLERANCE)}. Only days count on which at least {percent(tower_comparison.MEASURED_SHARE)} of the
quantity was measured (at US-Prr: measured or filled well; where a record has no flag, as for ground heat there and
radiation at SE-Svb, every value), and months of at least {tower_comparison.FEWEST_DAYS} such days; n is the
number of months or days. The worst month has the largest gap."""


def _misses(comparison: Comparison) -> list[Miss]:
    unjudged = UNJUDGED[comparison.site]
    judged = {name: days for name, days in comparison.pairs.items() if name not in unjudged}
    return tower_comparison.find_misses(comparison.site, judged, LIKELY[comparison.site])


def _svartberget_text(comparison: Comparison) -> tuple[str, list[Miss]]:
    pairs = comparison.pairs
    measured, modelled = tower_comparison.summer_evaporative_fraction(pairs)
    soil = comparison.fluxes["soil_temperature_c"]
    thaw = soil_thaw_day(soil)
    melt = tower_comparison.melt_out(comparison.modelled["swe_mm"].to_numpy())
    closed = [tower_comparison.energy_closure(comparison.fluxes, (month,)) for month in SUMMER]
    offset, days = tower_comparison.energy_offset(comparison.fluxes)
    heat = comparison.fluxes["ground_heat_w_m2"]
    taken = heat.sum() * MJ_PER_DAY
    counts = comparison.fluxes["soil_temperature_c_measured"] >= tower_comparison.MEASURED_SHARE
    filled_from = counts[counts].index[-1] + pd.Timedelta(days=1)
    text = f"""### SE-Svb, Svartberget, 2019

Pine and spruce in northern Sweden, 64.3 N, no permafrost; half-hourly weather. The trees' leaf area is
{tower_stands.SE_SVB.lai:g}, from the inventory.

**Energy.** The tower's balance is open: (H + LE)/(Rn − G) is {number(min(closed))}-{number(max(closed))} in June to
August, and over the {days} days of the year with all four Rn − G exceeds H + LE by {number(offset, 0)} W m⁻² on
average. A model that closes has to exceed the latent or the sensible heat. LE/(LE + H) of June to August does not
depend on that: measured {number(measured)}, modelled {number(modelled)}.

**Ground.** Soil was measured at 5 cm; the model's is the top of the mineral soil. From
{filled_from.day} {filled_from:%B} on its record is filled with one value and not compared; that
of ground heat ends there, too, after having taken up {number(taken, 0)} MJ m⁻² on its {heat.notna().sum()} whole days.

**Carbon.** What was measured is net exchange. The record's respiration doubles from 4 to 16 August, with the soil 2 K
warmer at most, and halves in a week of September in which it cools by 3 K; GPP, which is derived from it, follows.

{tower_comparison.skill_table(pairs, UNJUDGED["SE-Svb"])}

By month:

{tower_comparison.course_table(pairs)}

Snow has no sensor there. The soil at 5 cm left 0 degC for good ({THAWED_C:g} degC) on day {thaw}; the modelled snow was
gone on day {melt}.

![SE-Svb](images/validation_SE-Svb.png)"""
    likely = "melt under a dense canopy is too slow: longwave and warm trunks, or too much snow reaches the ground"
    return text, _snow_off_miss(comparison.site, melt - thaw, "day that the soil left 0 degC, or more", likely)


def _poker_flat_text(comparison: Comparison, repeats: int) -> tuple[str, list[Miss]]:
    pairs = comparison.pairs
    modelled_ground = comparison.modelled["ground_heat_mj_m2"] / MJ_PER_DAY
    closed = [
        tower_comparison.energy_closure(comparison.fluxes.assign(ground_heat_w_m2=ground), SUMMER)
        for ground in (comparison.fluxes["ground_heat_w_m2"], modelled_ground)
    ]
    measured, modelled = tower_comparison.summer_evaporative_fraction(pairs)
    observed = poker_flat.snow_off()
    years = list(poker_flat.YEARS)
    swe = comparison.modelled["swe_mm"]
    melt = {year: tower_comparison.melt_out(swe[swe.index.year == year].to_numpy()) for year in years}
    difference = sum(melt[year] - observed[year] for year in years) / len(years)
    snow_rows = [
        ["snow gone, measured [day of year]", *(str(observed[year]) for year in years)],
        ["snow gone, modelled [day of year]", *(str(melt[year]) for year in years)],
        ["largest snow water, modelled [mm]", *(number(swe[swe.index.year == year].max(), 0) for year in years)],
        ["deepest thaw, from the moss's surface, modelled [m]", *map(number, _thaw_depths(repeats))],
    ]
    spring, spring_misses = _spring(comparison, poker_flat_days(repeats, measured_spring=True))
    text = f"""### US-Prr, Poker Flat, 2011-14

Black spruce, 2.4 m tall, on permafrost in interior Alaska, 65.1 N. The published weather is daily: it is spread over
the day as `sim/io/disaggregation.py` says (temperature by a cosine of half-range
{number(_spring_cycle().half_range_per_shortwave, 3)} K per W m⁻² of the day's shortwave with its peak at
{number(_spring_cycle().peak_hour, 1)} h, both from the half-hourly spring of 2013; shortwave by the sun's height).
Precipitation of frosty days is ERA-Interim's, because the gauge catches half of it. GPP and respiration are the
daytime partitioning; the night-time one gives GPP of 0.7 and 1.3 gC m⁻² day⁻¹ in January and February, on average of
the four years. Net radiation is
the sum of its four components (the published sum differs from it by up to 39 W m⁻² in months of 2011-13). From June
to August LE/(LE + H) is {number(measured)} measured, {number(modelled)} modelled. Soil was measured 5 cm below the
14 cm of moss, {SENSOR_DEPTH_M:g} m below the surface and within the 0.30 m of organic layer; the model's is taken
there, between its surface, its middle and the top of the mineral soil.

{_ground_heat_text(comparison, closed)}

{_latent_heat_text(comparison)}

{tower_comparison.skill_table(pairs, UNJUDGED["US-Prr"])}

By month:

{tower_comparison.course_table(pairs)}

{document.table(["snow and thaw", *map(str, years)], snow_rows)}

{spring}

{_understorey_text(poker_flat_days(repeats, tower_stands.US_PRR_TREES_ALONE), comparison)}

![US-Prr](images/validation_US-Prr.png)"""
    likely = "too little snow (sublimation), which ages and melts too early; no refreezing of meltwater"
    what = "day that the tower's albedo gives, mean of four springs"
    return text, [*_snow_off_miss(comparison.site, difference, what, likely), *spring_misses]


def _thaw_depths(repeats: int) -> list[float]:
    """Deepest thaw [m] of each of US-Prr's years."""
    years = pd.Index(poker_flat.YEARS)
    annual = tower_comparison.simulate(tower_stands.US_PRR, poker_flat.forcing(), years, repeats, "annual")
    return annual["active_layer_depth_m"].tolist()


def _ground_heat_text(comparison: Comparison, closed: list[float]) -> str:
    """Why measured ground heat has no verdict; closed : closure of the summer with it, and with the modelled one."""
    measured = MJ_PER_DAY * comparison.fluxes["ground_heat_w_m2"]
    modelled = comparison.modelled["ground_heat_mj_m2"]
    measured, modelled = (days.groupby(days.index.year).sum() for days in (measured, modelled))
    ice = 1e6 * measured / (LATENT_HEAT_FUSION * WATER_DENSITY)
    return f"""Ground heat has no verdict. Measured, {number(measured.min(), 0)} to {number(measured.max(), 0)} MJ m⁻²
stay in the ground every year, enough to melt {number(ice.min())} to {number(ice.max())} m of frozen water each time,
which cannot be (modelled {number(modelled.min(), 0)} to {number(modelled.max(), 0)}). (H + LE)/(Rn − G) of June to
August, {number(closed[0])} with it, is therefore no evidence of a closed balance; with the modelled ground heat it is
{number(closed[1])}."""


def _latent_heat_text(comparison: Comparison) -> str:
    """The excess of latent heat, parted into days with and without snow in the model."""
    days = comparison.pairs["latent heat"]
    days = days[days["counts"]]
    excess = days["modelled"] - days["measured"]
    snow = comparison.modelled.loc[days.index, "swe_mm"] > tower_comparison.SNOW_GONE_MM
    free = excess[~snow]
    thaw = free[free.index.month.isin(THAW)]
    return f"""Latent heat exceeds the measured by {number(excess[snow].mean(), 1)} W m⁻² on days with modelled snow and
by {number(free.mean(), 1)} on the others, which are {percent(len(free) / len(excess))} of the days and make
{percent(free.sum() / excess.sum())} of the excess: {number(thaw.mean(), 1)} W m⁻² from April to June,
{number(free.drop(thaw.index).mean(), 1)} later."""


def _spring_cycle() -> disaggregation.DiurnalCycle:
    weather = poker_flat.spring_weather()
    return disaggregation.diurnal_cycle(weather["air_temperature_c"], weather["shortwave_w_m2"])


def _spring(spread: Comparison, measured: Comparison) -> tuple[str, list[Miss]]:
    """Spring 2013 with spread and with measured half-hours, and what only that record has: deeper soil and snow, which
    are judged."""
    fluxes = towers.daily_fluxes(poker_flat.spring_fluxes())
    soil = fluxes[[f"soil_{depth}_cm_c" for depth in (34, 44, 54)]].mean(axis=1)
    for comparison in (spread, measured):
        comparison.modelled["spring_soil_c"] = temperature_below_moss(comparison.modelled, SPRING_SENSORS_M)
    rows, watts = [], 1.0 / MJ_PER_DAY
    for label, column, series, factor in (
        ("latent heat [W m-2]", "latent_heat_mj_m2", _mostly_measured(fluxes, "latent_heat_w_m2"), watts),
        ("sensible heat [W m-2]", "sensible_heat_mj_m2", _mostly_measured(fluxes, "sensible_heat_w_m2"), watts),
        ("soil, 0.34-0.54 m [degC]", "spring_soil_c", soil, 1.0),
    ):
        row = [label, number(series.mean(), 1)]
        for comparison in (spread, measured):
            s = skill(factor * comparison.modelled.loc[fluxes.index, column], series)
            row += [number(s.bias, 1, sign=True), number(s.rmse, 1), number(s.r)]
        rows.append(row)
    found = []
    limits = QUANTITIES["soil temperature"]
    deeper = skill(measured.modelled.loc[fluxes.index, "spring_soil_c"], soil)
    if abs(deeper.bias) > limits.tolerance or deeper.rmse > limits.largest_rmse:
        what = f"soil at 0.34-0.54 m, March to May 2013: bias of days {number(deeper.bias, 1, sign=True)} degC, RMSE "
        what += f"{number(deeper.rmse, 1)}, r {number(deeper.r)}"
        found.append(Miss(spread.site, what, "a winter that ends too warm below snow (the monthly course above)"))
    header = ["March to May 2013, days", "measured", "spread: bias", "RMSE", "r", "half-hours: bias", "RMSE", "r"]
    march = fluxes.index.month == 3
    depth = fluxes.loc[march, "snow_depth_cm"].mean()
    water = [number(0.01 * depth * density, 0) for density in SNOW_DENSITY]
    modelled = measured.modelled.loc[fluxes.index[march]]
    swe, deep = modelled["swe_mm"].mean(), modelled["snow_depth_m"].mean()
    if abs(100.0 * deep / depth - 1.0) > SNOW_DEPTH_TOLERANCE:
        what = f"snow in March 2013: {number(100.0 * deep, 0)} cm deep, measured {number(depth, 0)}"
        found.append(Miss(spread.site, what, "too little snow (sublimation), and too dense"))
    text = f"""The spring of 2013 was measured in half-hours. The same run with them in place of the spread days
(precipitation stays spread):

{document.table(header, rows)}

The soil's sensors are {SPRING_SENSORS_M:g} m below the moss's surface on average; the model's is taken there, between
the top of the mineral soil and the middle of its upper metre.

Snow lay {number(depth, 0)} cm deep in March 2013, {water[0]}-{water[1]} mm of water at
{SNOW_DENSITY[0]:g}-{SNOW_DENSITY[1]:g} kg m⁻³ (Ikawa et al. 2024; Sturm et al. 2010); the model has
{number(swe, 0)} mm, {number(100.0 * deep, 0)} cm deep, {number(swe / deep, 0)} kg m⁻³."""
    return text, found


def _mostly_measured(fluxes: pd.DataFrame, name: str) -> pd.Series:
    return fluxes[name].where(fluxes[f"{name}_measured"] >= tower_comparison.MEASURED_SHARE)


def _understorey_text(trees: Comparison, both: Comparison) -> str:
    rows = []
    for name in ("GPP", "ecosystem respiration", "net exchange"):
        q, digits = QUANTITIES[name], QUANTITIES[name].digits
        courses = [tower_comparison.climatology(comparison.pairs[name]) for comparison in (trees, both)]
        summer = [course.loc[list(SUMMER)].mean() for course in courses]
        values = (summer[0]["measured"], summer[0]["modelled"], summer[1]["modelled"])
        rows.append([f"{name} [{q.unit}]", *(number(value, digits) for value in values)])
    return f"""The understorey has more leaf area here (0.78, measured) than the trees (0.48). What it adds to the
fluxes of June to August (trees alone: `tower_stands.US_PRR_TREES_ALONE`):

{document.table(["", "measured", "trees alone", "with understorey"], rows)}"""


def _snow_off_miss(site: str, days: float, what: str, likely: str) -> list[Miss]:
    if abs(days) <= tower_comparison.DAYS_OF_SNOW_OFF:
        return []
    return [Miss(site, f"snow gone {number(days, 0, sign=True)} days from the {what}", likely)]


def soil_thaw_day(soil: pd.Series) -> int:
    """First day of year from which the soil [degC, a year of days] stays above THAWED_C until summer. 0 if never."""
    spring = soil.iloc[: tower_comparison.SPRING_ENDS]
    cold = (spring <= THAWED_C).to_numpy().nonzero()[0]
    return int(cold[-1]) + 2 if len(cold) and cold[-1] + 1 < len(spring) else 0
