"""The weather generator's calibrated constants, calibrated again on halves of the records.

The constants came from all of these records, so no comparison with them is independent. Here each is found from the
days of even and of odd years (days, where a record has one year), by the same simple rule: what differs between the
halves is how well the records fix it. Each half's values then predict the other half's days.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.validation import climate_records, document, tower_comparison, tower_report
from analysis.validation.climate_records import SEASONS, Climate
from analysis.validation.document import Miss, number
from analysis.validation.scores import skill
from sim.io import longwave
from sim.parameters import CONSTANTS
from sim.physical_constants import FREEZING_POINT_K

WET_MM = 1.0  # of a day that counts as wet, as in the generator
DRY_MM = 0.2  # below which a sky is called dry where its clouds were calibrated
WINTER_HALF = (11, 12, 1, 2, 3)
STABLE = 0.05  # difference beyond which a constant and its calibration disagree
RELATIVE_HUMIDITY_MEAN = 0.7
EVAPORATION_APART = 0.03  # of LE / (LE + H), modelled and measured
SUN_RECORDS = ("US-Prr", "ERA-Interim", "SE-Svb")
SKY_RECORDS = ("US-Prr", "SE-Svb", "FI-Sod")


@dataclass(frozen=True)
class Half:
    """Days of one record with what calibration needs: season, wet or dry, sun above the atmosphere, cloud term."""

    days: pd.DataFrame

    @classmethod
    def of(cls, climate: Climate, days: pd.DataFrame) -> "Half":
        days = days.dropna(subset=["precipitation_mm"])
        return cls(
            days.assign(
                season=climate_records.season_of(days.index),
                wet=days["precipitation_mm"] >= WET_MM,
                extraterrestrial=longwave.extraterrestrial(days.index, climate.latitude_deg),
                cloud=climate_records.cloud_term(days),
                humidity=days["vapour_pressure_hpa"] / climate_records.saturation(days["air_temperature_c"]),
            )
        )

    def clearness(self, season: str, wet: bool | None = None) -> float:
        """Ratio of the sums of shortwave at the ground and above the atmosphere; all days for `wet` None."""
        days = self._select(season, wet).dropna(subset=["shortwave_w_m2"])
        return days["shortwave_w_m2"].sum() / days["extraterrestrial"].sum()

    def cloud(self, seasons: tuple[str, ...], wet: bool | None = None) -> float:
        """Mean cloud term; dry days here have less than DRY_MM."""
        days = self.days[self.days["season"].isin(seasons)]
        if wet is not None:
            days = days[days["wet"]] if wet else days[days["precipitation_mm"] < DRY_MM]
        return days["cloud"].mean()

    def _select(self, season: str, wet: bool | None) -> pd.DataFrame:
        days = self.days[self.days["season"] == season]
        return days if wet is None else days[days["wet"] == wet]


def split(records: dict[str, Climate]) -> tuple[dict[str, Half], dict[str, Half]]:
    """Even and odd halves of every record, by name."""
    halves = {name: climate.halves() for name, climate in records.items()}
    even, odd = ({name: Half.of(records[name], halves[name][k]) for name in records} for k in (0, 1))
    return even, odd


def calibrate(halves: dict[str, Half], wet_share: dict[str, float], snowfall_unscaled_mm: float) -> dict[str, float]:
    """Constants by name from one half of the records.

    wet_share : the generator's share of wet days by season, at which dry days get what leaves all days as observed;
    snowfall_unscaled_mm : its mean precipitation of November to March [mm day-1] at a snowfall_scale of 1.
    """
    sun = [halves[name] for name in SUN_RECORDS]
    sky = [halves[name] for name in SKY_RECORDS]
    pooled = pd.concat([half.days for half in sky])
    found = {}
    for season in SEASONS:
        wet, every = (np.mean([half.clearness(season, w) for half in sun]) for w in (True, None))
        share = wet_share[season]
        found[f"clearness_wet_{season}"] = wet
        found[f"clearness_dry_{season}"] = (every - share * wet) / (1.0 - share)
        for kind in ("dry", "wet"):
            days = pooled[(pooled["season"] == season) & (pooled["wet"] == (kind == "wet"))]
            found[f"humidity_{kind}_{season}"] = days["humidity"].mean() - RELATIVE_HUMIDITY_MEAN
    found["cloud_wet_cold"] = np.mean([half.cloud(("autumn", "winter"), wet=True) for half in sky])
    found["cloud_wet_warm"] = np.mean([half.cloud(("spring", "summer"), wet=True) for half in sky])
    for season in ("winter", "spring"):
        found[f"cloud_dry_{season}"] = np.mean([half.cloud((season,), wet=False) for half in sky])
    for season, wet in (("summer", found["cloud_wet_warm"]), ("autumn", found["cloud_wet_cold"])):
        every = np.mean([half.cloud((season,)) for half in sky])
        found[f"cloud_dry_{season}"] = (every - wet_share[season] * wet) / (1.0 - wet_share[season])
    snow = halves["ERA-Interim"].days
    snow = snow.loc[snow.index.month.isin(WINTER_HALF), "precipitation_mm"].mean()
    found["snowfall_scale"] = snow / snowfall_unscaled_mm
    return {name: float(found[name]) for name in CONSTANTS if name in found}


def evaporative_fractions(repeats: int) -> tuple[list[list[str]], list[Miss]]:
    """Modelled against measured LE / (LE + H) of the summer at SE-Svb: rows of a table, misses.

    `priestley_taylor_conifer` was found on even days; odd ones test it. repeats : times that the tower's year is run.
    """
    pairs = tower_report.svartberget(repeats).pairs
    rows, misses = [], []
    for parity, label in enumerate(("even days (calibration)", "odd days (test)")):
        measured, modelled = tower_comparison.summer_evaporative_fraction(pairs, parity)
        missed = abs(modelled - measured) > EVAPORATION_APART
        rows.append([label, number(measured, 3), number(modelled, 3), "**MISS**" if missed else "in"])
        if missed:
            what = f"LE/(LE + H) at SE-Svb, {label}: {number(modelled, 3)}, measured {number(measured, 3)}"
            misses.append(Miss("calibration", what, "coefficient of conifers, or the stress taken off it"))
    return rows, misses


def report(wet_share: dict[str, float], snowfall_unscaled_mm: float, repeats: int) -> tuple[str, list[Miss]]:
    """Text and misses of the calibration; arguments as of `calibrate` and `evaporative_fractions`."""
    even, odd = split(climate_records.records())
    fits = [calibrate(half, wet_share, snowfall_unscaled_mm) for half in (even, odd)]
    evaporation, misses = evaporative_fractions(repeats)
    rows = []
    for name in fits[0]:
        values = [fit[name] for fit in fits]
        used, mean = CONSTANTS[name].low, float(np.mean(values))
        verdict = "in" if abs(used - mean) <= STABLE else "**MISS**"
        cells = [number(value, 3) for value in (used, *values)]
        rows.append([f"`{name}`", *cells, number(mean - used, 3, sign=True), verdict])
        if verdict != "in":
            what = f"`{name}` is {cells[0]}, calibrated again {cells[1]} and {cells[2]}"
            misses.append(Miss("calibration", what, "another weighting of the records"))
    text = f"""Calibrated on these records are `snowfall_scale`, `clearness_*`, `cloud_*` and `humidity_*` (below), the
persistence, warmest day and `diurnal_full_sun` of temperature, and `priestley_taylor_conifer` (at the end); of the
weather as observed `noise_factor_*`, `wet_day_factor` and `wind_spread`, too. What follows from one of these has the
verdict *in, calibrated* above. `sublimation_exposure` was raised to its limit of 1, `flammability_*` to the return of
fire. Half A is the even years (US-Prr, ERA-Interim) or days (SE-Svb, FI-Sod), half B the odd ones. A constant misses if
it is more than {STABLE:g} from the mean of both. Persistence, warmest day and `diurnal_full_sun` are not calibrated
again by halves, nor are the constants of the weather as observed (`clearness_observed_*` and `cloud_observed_*` among
them); its wind is compared nowhere.

{document.table(["constant", "in use", "half A", "half B", "mean less in use", "verdict"], rows)}

What a half's dry and wet days of a season say about the days of the other half, which of them are wet being known:

{_transfer(even, odd)}

`priestley_taylor_conifer` is the coefficient without stress, which no tower measures: what one reports contains the
stress that the simulator takes off itself. It is the value with which LE/(LE + H) of June to August at SE-Svb, on even
days of the month, is the measured one; the odd days were not used, nor was US-Prr. A difference of more than
{EVAPORATION_APART:g} is a miss.

{document.table(["LE/(LE + H), SE-Svb", "measured", "modelled", "verdict"], evaporation)}"""
    return text, misses


def _transfer(even: dict[str, Half], odd: dict[str, Half]) -> str:
    """Markdown: skill of the one half's clearness, cloud term and humidity on the other half's days."""
    rows = []
    for label, column, names in (
        ("shortwave [W m-2]", "shortwave_w_m2", ("US-Prr", "SE-Svb")),
        ("longwave [W m-2]", "longwave_w_m2", SKY_RECORDS),
        ("relative humidity", "humidity", SKY_RECORDS),
    ):
        for name in names:
            row = [label, name]
            for fitted, other in ((even, odd), (odd, even)):
                s = skill(_predict(column, fitted[name].days, other[name].days), other[name].days[column])
                digits = 2 if column == "humidity" else 1
                row += [number(s.bias, digits, sign=True), number(s.rmse, digits), number(s.r)]
            rows.append(row)
    header = ["", "record", "A on B: bias", "RMSE", "r", "B on A: bias", "RMSE", "r"]
    return document.table(header, rows, left=2)


def _predict(column: str, fitted: pd.DataFrame, days: pd.DataFrame) -> pd.Series:
    """Daily values for `days` from the season's mean of wet and of dry days of `fitted`."""
    groups = [fitted["season"], fitted["wet"]]
    keys = pd.MultiIndex.from_frame(days[["season", "wet"]])
    if column == "humidity":
        return pd.Series(fitted["humidity"].groupby(groups).mean().reindex(keys).to_numpy(), days.index)
    if column == "shortwave_w_m2":
        valid = fitted["shortwave_w_m2"].notna()
        received = fitted["shortwave_w_m2"].groupby(groups).sum()
        possible = fitted["extraterrestrial"].where(valid).groupby(groups).sum()
        return days["extraterrestrial"] * (received / possible).reindex(keys).to_numpy()
    cloud = fitted["cloud"].groupby(groups).mean().reindex(keys).to_numpy()
    clear = climate_records.clear_emissivity(days)
    return (clear + (1.0 - clear) * cloud) * climate_records.black_body(days["air_temperature_c"] + FREEZING_POINT_K)
