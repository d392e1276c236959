"""What in a record no weather, no sensor and no clock gives, though each value is within its limits."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pandas as pd

from sim.io.clock import DAY, hours_apart, noon_of
from sim.io.columns import LIMITS, MM_A_YEAR, Column
from sim.io.disaggregation import declination
from sim.io.longwave import black_body, distance_factor, extraterrestrial
from sim.physical_constants import FREEZING_POINT_K, SOLAR_CONSTANT
from sim.state import DAYS

FEWEST_DAYS = 20  # that tell
NOON_WITHIN_H = 0.75
LEAST_SUN_W_M2 = 50.0  # extraterrestrial, of a day whose clearness tells
WARM_C = 5.0
LEAST_HUMIDITY = 0.15  # relative, in half of all intervals
DAYS_OF_A_YEAR = 300  # at least, that a year's precipitation is told by

#: Clear days' share of the light above the atmosphere: 60 to 85 % are usual; beyond these it is no sunlight. In a whole
#: year some days are clear: photosynthetically active light, taken for all light, has 30 to 40 %.
CLEAR_DAY, CLEAR_DAY_OF_A_YEAR = (0.3, 1.1), (0.5, 1.1)
#: Warmest day of the cosine through a year's air temperatures. In 214 site-years of boreal forests (ABCflux) it is day
#: 176 to 213; coasts are some weeks later.
WARMEST_DAY = (160, 235)
#: The driest moments of warm air: more than this in 98 of 100 is air that never dries.
DAMPEST = 0.85
#: Share of a column that may be set to a limit, and by how much more than saturation humidity may be without a count:
#: a sensor's usual error, and in cold air some stand above saturation for weeks.
MOST_LIMITED, ABOVE_SATURATION = 0.05, 0.03
#: Effective emissivity of the sky over a record or year. Dry clear air has no less than 1 - exp(-sqrt(1.2)) = 0.67
#: (Prata 1996); months of towers here have 0.79 to 0.92; the ground gives 0.97 or more.
SKY_EMISSIVITY = (0.65, 0.95)
#: Mean wind of a record or year. A choice: windy tundra has 6, the towers here 2.0 to 2.9, which in km/h are 7.3 to 10.
MOST_WIND_M_S = 7.0
LEAST_WIND_M_S = 1.0  # of a unit that is proposed
#: A choice: the driest of the boreal forest, in Yakutia and on the Yukon Flats, has around 200 mm; of that half.
LEAST_MM_A_YEAR = 100.0
#: Days so cold that what falls is snow, and the least of it [mm a day] that a gauge catches there: in Yakutsk, where
#: winters are the driest of the boreal forest, 0.2 fall. A choice, a quarter of that.
SNOW_C, FROSTY_DAYS, LEAST_SNOW_MM_A_DAY = -5.0, 30, 0.05
#: More days than these of one and the same number no sensor gives that works. Ice held the anemometer of Poker Flat for
#: 8; saturated air is longer the same (`SATURATED_DAYS`); the longest time without rain there was 50 days.
SAME_DAYS = {
    "air_temperature": 2,
    "humidity": 10,
    "wind_speed": 30,
    "shortwave": 5,
    "longwave": 5,
    "precipitation": 120,
}
SATURATED, SATURATED_DAYS = 0.97, 30
DEAD_DAYS = 1.0  # of light or relative humidity that is 0, where there is some
FEWEST_SAME = 6  # rows: of days rounded to 0.1 K three in a row are the same by chance
#: An interval's light may be more than the sky's above the atmosphere by this factor and sum, beside bright clouds and
#: in twilight; and its clock may be off by what `check_sun` lets pass and by the equation of time.
BRIGHTER, BRIGHTER_W_M2, SUN_WITHIN_H = 1.1, 50.0, NOON_WITHIN_H + 0.3
#: Robust deviations from the month around beyond which air is not of its season, and the least that is one: 8 times 5 K
#: is more than a foehn brings to a quiet month.
DEVIATIONS, LEAST_DEVIATION_K = 8.0, 5.0
#: Light by which an interval is of the day, and the sun's height at which there is as much. By the length of their days
#: Svartberget and Sodankylä are found to 1 degree and 3 days; by the brightest daily means Poker Flat, in each of 26
#: years, to 1 degree and 6 days, Svartberget to 1 and 3, shaded Sodankylä to 6 and 4.
DAYLIGHT_W_M2, SUNRISE_DEG, HALF_MONTH = 5.0, 1.0, 15
PLACE_WITHIN, PLACE_WITHIN_OF_DAYS = (5.0, 10), (9.0, 14)  # degrees of latitude, days
TILT = np.array([declination(day) for day in range(366)])
#: Months in which all clocks of summer time are ahead, and in which none is. Svartberget's light has its middle 0.1
#: hours earlier in summer, Sodankylä's 0.3 later; such a clock adds 1.
SUMMER, WINTER, SUMMER_TIME_H = (5, 6, 7, 8), (11, 12, 1, 2), 0.65
A_YEAR = pd.date_range("2001-01-01", periods=DAYS)


def check_sun(name: str, weather: pd.DataFrame, interval: int, expected_h: float, clock: str) -> float | None:
    """Hours that the middle of the sunlight is after noon, where it can be told. Raises ValueError if they are many.

    expected_h : the hour of the index at which the sun is highest.
    """
    days = weather["shortwave"].groupby(weather.index.normalize()).mean()
    if (days > 20.0).sum() < FEWEST_DAYS:
        return None
    noon = noon_of(weather.index, interval, weather["shortwave"].to_numpy())
    if noon is None:
        return None
    late = hours_apart(noon, expected_h)
    if abs(late) > NOON_WITHIN_H:
        when = "after" if late > 0 else "before"
        raise ValueError(
            f"{name}: the record has the middle of its light {abs(late):.1f} hours {when} solar noon; {clock}, "
            "longitude_deg, a clock of summer time, or starts that are ends of the intervals may be wrong"
        )
    _check_summer_time(name, weather, interval, days)
    return late


def _check_summer_time(name: str, weather: pd.DataFrame, interval: int, days: pd.Series) -> None:
    """Refuse a clock that is an hour ahead in summer, by the middle of the light; days : its means by date."""
    parts = []
    for months in (WINTER, SUMMER):
        if (days[days.index.month.isin(months)] > 20.0).sum() < FEWEST_DAYS:
            return
        parts.append(weather["shortwave"][weather.index.month.isin(months)])
    winter, summer = (noon_of(part.index, interval, part.to_numpy()) for part in parts)
    if winter is None or summer is None or hours_apart(summer, winter) <= SUMMER_TIME_H:
        return
    late = f"{hours_apart(summer, winter):.1f} hours later in summer than in winter"
    raise ValueError(f"{name}: the record has the middle of its light {late}; no clock of summer time is allowed")


def in_numbers(weather: pd.DataFrame, interval: int) -> str:
    """What a record amounts to, by which a wrong unit or a gauge without snow may be noticed."""
    rain, frosty = weather["precipitation"], weather["air_temperature"] < 0.0
    a_year = rain.mean() * DAY / interval * DAYS
    snow = f", {percent(rain[frosty].sum() / rain.sum())} of it below 0 degC" if rain.sum() > 0.0 else ""
    return (
        f"in numbers: air {weather['air_temperature'].mean():.1f} degC, relative humidity "
        f"{percent(weather['humidity'].mean())}, wind {weather['wind_speed'].mean():.1f} m s-1, shortwave "
        f"{weather['shortwave'].mean():.0f} W m-2 in the mean; precipitation {a_year:.0f} mm a year{snow}"
    )


def percent(share: float) -> str:
    """A share in words, of two digits."""
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"


def unusual_lines(
    name: str,
    weather: pd.DataFrame,
    columns: dict[str, Column],
    latitude_deg: float,
    interval: int,
    relative: Callable[[str, np.ndarray, np.ndarray], np.ndarray],
) -> Iterator[str]:
    """What no weather or no sensor gives, though each value is within its limits: a line each, that names the column.

    weather : by local solar time, in our units, NaN where there is a gap; `humidity_measured` is the column as it is
    measured, `humidity` what becomes of it, and so with precipitation. interval : minutes. relative : kind of column,
    its values, air temperature [degC] -> relative humidity, which may be above 1.
    """
    for year, part in weather.groupby(pd.DatetimeIndex(weather.index).year):
        for line in _as_a_whole(part, columns, latitude_deg, interval, relative):
            yield f"{name}, {year}: {line}"
    dates = pd.DatetimeIndex(weather.index).normalize()
    possible = pd.Series(extraterrestrial(dates.unique(), latitude_deg), index=dates.unique())
    for line in _of_sensors(weather, columns, latitude_deg, interval, possible.reindex(dates).to_numpy()):
        yield f"{name}: {line}"


def _as_a_whole(year, columns, latitude_deg, interval, relative) -> Iterator[str]:
    """What a year, or a part of one, has of another unit, or of another quantity."""
    days, seconds = year.groupby(year.index.normalize()).mean(), 60.0 * interval
    possible = extraterrestrial(pd.DatetimeIndex(days.index), latitude_deg)
    sunny = (possible > LEAST_SUN_W_M2) & days["shortwave"].notna().to_numpy()
    if sunny.sum() >= FEWEST_DAYS:
        brightest = float(np.quantile(days["shortwave"].to_numpy()[sunny] / possible[sunny], 0.98))
        least, most = CLEAR_DAY_OF_A_YEAR if len(days) >= DAYS_OF_A_YEAR else CLEAR_DAY
        if not least <= brightest <= most:
            share = (
                f"{100 * brightest:.3g} % of the sunlight above the atmosphere at latitude {latitude_deg:g} on its date"
            )

            def clear(light):
                return brightest > 0.0 and 0.5 <= brightest * np.nanmean(light) / year["shortwave"].mean() <= 0.9

            what = f"a clear day has {share}, where 60 to 85 are usual"
            yield _other_unit(columns["shortwave"], what, year, seconds, clear)
    if place := place_of_sun(year["shortwave"], interval):
        latitude, late = place
        degrees, most = PLACE_WITHIN if interval != DAY else PLACE_WITHIN_OF_DAYS
        if abs(latitude - latitude_deg) > degrees or abs(late) > most:
            what = "hours of daylight" if interval != DAY else "brightest days"
            when = f", {abs(late)} days {'after' if late > 0 else 'before'} their dates there" if late else ""
            yield (
                f"{columns['shortwave'].name} has the {what} of latitude {latitude:.0f}{when}, where latitude_deg is "
                f"{latitude_deg:g}: that, or the dates, may be wrong"
            )
    if days["air_temperature"].count() >= DAYS_OF_A_YEAR:
        warmest = warmest_day(days["air_temperature"])
        if not WARMEST_DAY[0] <= warmest <= WARMEST_DAY[1]:
            yield (
                f"{columns['air_temperature'].name} is highest around day {warmest:.0f} of the year; days "
                f"{WARMEST_DAY[0]} to {WARMEST_DAY[1]} are usual"
            )

    yield from _of_humidity(year, columns["humidity"], seconds, relative)
    rain, few = year["precipitation"], days["precipitation"].count() < DAYS_OF_A_YEAR
    negative = float((year["precipitation_measured"] < -1e-3).sum() / max(rain.count(), 1))
    if negative > MOST_LIMITED:
        yield (
            f"{columns['precipitation'].name} is below 0 in {percent(negative)} of its intervals, which would be set "
            f"to 0 and make rain of noise; sums without noise are usual"
        )

    def a_year(amounts):
        return float(np.nanmean(amounts)) * DAY / interval * DAYS

    least, most = LEAST_MM_A_YEAR, MM_A_YEAR[1]
    if not few and not least <= a_year(rain) <= most:
        what = f"precipitation is {a_year(rain):.3g} mm a year; [{least:g}, {most:g}] is usual"
        yield _other_unit(columns["precipitation"], what, year, seconds, lambda v: least <= a_year(v) <= most)

    snow = rain.groupby(rain.index.normalize()).sum(min_count=1)[days["air_temperature"] < SNOW_C].dropna()
    if len(snow) >= FROSTY_DAYS and snow.mean() < LEAST_SNOW_MM_A_DAY and a_year(rain) >= LEAST_MM_A_YEAR:
        yield (
            f"{columns['precipitation'].name} has {snow.sum():.2g} mm on the {len(snow)} days below {SNOW_C:g} degC, "
            f"where {LEAST_SNOW_MM_A_DAY:g} mm a day are the least that is usual: rain without snow, maybe"
        )

    if len(days) < FEWEST_DAYS:
        return
    wind = float(year["wind_speed"].mean())
    if wind > MOST_WIND_M_S:
        what = f"wind is {wind:.3g} m s-1 in the mean; at most {MOST_WIND_M_S:g} is usual above a forest"
        column = columns.get("wind_speed", columns.get("eastward_wind"))
        yield _other_unit(
            column, what, year, seconds, lambda v: LEAST_WIND_M_S <= np.nanmean(v) <= MOST_WIND_M_S, "wind_speed"
        )
    if "longwave" in columns:
        body = black_body(year["air_temperature"] + FREEZING_POINT_K).where(year["longwave"].notna()).mean()
        emissivity, (least, most) = float(year["longwave"].mean() / body), SKY_EMISSIVITY
        if not (least <= emissivity <= most or np.isnan(emissivity)):
            what = (
                f"the sky gives {100 * emissivity:.3g} % of what a black body at the air's temperature does; "
                f"{100 * least:g} to {100 * most:g} are usual, and about 98 is the ground's, outgoing"
            )
            yield _other_unit(columns["longwave"], what, year, seconds, lambda v: least <= np.nanmean(v) / body <= most)


def place_of_sun(light: pd.Series, interval: int) -> tuple[float, int] | None:
    """Latitude, and the days by which the light is late, that fit the light [W m-2] best; None of less than a year.

    By the hours of daylight; of daily means by the brightest of each half-month, which clear days have in common.
    """
    by_day = pd.DatetimeIndex(light.index).normalize()
    means = light.groupby(by_day).mean()[light.notna().groupby(by_day).all()]
    dates = pd.DatetimeIndex(means.index)
    if len(dates) < DAYS_OF_A_YEAR:
        return None
    if interval != DAY:
        seen = (light > DAYLIGHT_W_M2).groupby(by_day).sum()[dates] * interval / 60.0
    else:
        brightest = means.groupby(np.arange(len(means)) // HALF_MONTH).idxmax()
        dates = pd.DatetimeIndex(brightest)
        seen = means[dates]
    seen, day, fits = seen.to_numpy(), dates.day_of_year.to_numpy() - 1, {}
    for latitude in range(30, 81):
        of_year = day_lengths(latitude) if interval != DAY else extraterrestrial(A_YEAR, latitude)
        for late in range(-60, 61, 3):
            expected = of_year[(day - late) % DAYS]
            if interval == DAY:
                expected = expected * (seen @ expected) / (expected @ expected)
            fits[float(latitude), late] = np.abs(seen - expected).mean()
    return min(fits, key=fits.__getitem__)


def day_lengths(latitude_deg: float) -> np.ndarray:
    """Hours of each day of a year in which the sun is higher than `SUNRISE_DEG`."""
    tilt, latitude = TILT[:DAYS], math.radians(latitude_deg)
    cosine = math.sin(math.radians(SUNRISE_DEG)) - math.sin(latitude) * np.sin(tilt)
    return 24.0 / math.pi * np.arccos(np.clip(cosine / (math.cos(latitude) * np.cos(tilt)), -1.0, 1.0))


def warmest_day(days: pd.Series) -> float:
    """Day of the year at which the cosine of a year through daily means is highest, 1 January being 1."""
    known = days.dropna()
    angle = 2.0 * math.pi * (pd.DatetimeIndex(known.index).day_of_year.to_numpy() - 1) / DAYS
    waves = np.column_stack([np.ones(len(known)), np.cos(angle), np.sin(angle)])
    _, cosine, sine = np.linalg.lstsq(waves, known.to_numpy(), rcond=None)[0]
    return 1.0 + DAYS * (math.atan2(sine, cosine) / (2.0 * math.pi) % 1.0)


def _of_humidity(year, column: Column, seconds: float, relative) -> Iterator[str]:
    air = year["air_temperature"].to_numpy()
    warm = air > WARM_C
    measured = relative(column.kind, year["humidity_measured"].to_numpy(), air)
    limited = (measured < year["humidity"] - 1e-3) | (measured > 1.0 + ABOVE_SATURATION)
    known = ~np.isnan(measured)

    def usual(values):
        moments = relative(column.kind, values, air)
        moments = moments[known & (warm if (known & warm).any() else True)]
        return np.quantile(moments, 0.02) <= DAMPEST and LEAST_HUMIDITY <= np.median(moments) <= 1.0

    def line(what):
        return _other_unit(column, what, year, seconds, usual, "humidity_measured")

    share = float(limited.sum() / max(known.sum(), 1))
    if share > MOST_LIMITED:
        yield line(f"{percent(share)} of it would be set to the limits of relative humidity")
    elif (known & warm).sum() * seconds >= FEWEST_DAYS * 86400.0:
        moments = np.minimum(measured[known & warm], 1.0)
        driest, median = float(np.quantile(moments, 0.02)), float(np.median(moments))
        if driest > DAMPEST:
            yield line(f"relative humidity is above {100 * driest:.0f} % in 98 of 100 warm intervals")
        if median < LEAST_HUMIDITY:
            yield line(f"relative humidity is {percent(median)} in half of all warm intervals")


def _other_unit(column: Column, what: str, year, seconds: float, usual: Callable, quantity: str | None = None) -> str:
    """What is wrong with a column as a whole, and the units in which it would be usual."""
    given = column.as_given(year[quantity or column.kind].to_numpy(), seconds)
    photons = {"kJ m-2"} if column.kind == "shortwave" else set()  # of a half-hour are near as many as umol of photons
    others = [unit for unit in column.units.split(", ") if unit not in {column.unit, *photons}]
    others = [unit for unit in others if usual(replace(column, unit=unit).converted(given, seconds))]
    if others:
        hint = f"it would be usual in {' or '.join(map(repr, others))}: units={{{column.name!r}: {others[0]!r}}}"
    else:
        hint = f"allowed units are {column.units}"
    return f"{column.name} in {column.unit}: {what}; {hint}"


def _of_sensors(weather, columns, latitude_deg, interval, possible) -> Iterator[str]:
    """Stretches of one number, light that is not the sun's, and air that is not of its season.

    possible : the day's mean light above the atmosphere, of each row [W m-2].
    """

    def name_of(quantity):
        return columns[quantity].name if quantity in columns else "wind"

    def at(row):
        return f"{weather.index[row]:%Y-%m-%d}" + ("" if interval == DAY else f"{weather.index[row]: %H:%M} solar time")

    for quantity, most_days in SAME_DAYS.items():
        if quantity == "longwave" and quantity not in columns:
            continue
        values = weather["humidity_measured" if quantity == "humidity" else quantity].to_numpy()
        if quantity == "shortwave":
            values = np.where(possible > LEAST_SUN_W_M2, values, np.nan)  # night may last for months
        first = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]]))  # a gap ends a stretch
        rows = np.diff(np.append(first, len(values)))
        most = np.full(len(first), float(most_days))
        if quantity == "humidity":
            most[weather["humidity"].to_numpy()[first] >= SATURATED] = SATURATED_DAYS
        dead = values[first] == 0.0
        if quantity == "shortwave" or (quantity == "humidity" and columns["humidity"].kind == "relative_humidity"):
            most[dead] = DEAD_DAYS
        long = np.flatnonzero((rows * interval / DAY > most) & ((rows >= FEWEST_SAME) | (most == DEAD_DAYS)))
        if len(long):
            k = long[0]
            unit = LIMITS[columns[quantity].kind if quantity in columns else quantity][0]
            unit = "" if unit == "1" else f" {unit}"
            yield (
                f"{name_of(quantity)} is {values[first[k]]:.6g}{unit} from {at(first[k])} on for "
                f"{rows[k] * interval / DAY:.3g} days without a change; a sensor that works has at most {most[k]:g}"
            )

    light = weather["shortwave"].to_numpy()
    above = possible if interval == DAY else _sun(pd.DatetimeIndex(weather.index), interval, latitude_deg)
    too_bright = np.flatnonzero(light > BRIGHTER * above + BRIGHTER_W_M2)
    if len(too_bright):
        row = int(too_bright[0])
        yield (
            f"{name_of('shortwave')} is {light[row]:.4g} W m-2 at {at(row)}, where the sun above the atmosphere gives "
            f"{above[row]:.3g}; {len(too_bright)} of {len(light)} intervals are brighter than the sky can be"
        )

    air = weather["air_temperature"]
    dates = pd.DatetimeIndex(weather.index).normalize()
    days = air.groupby(dates).median()
    if days.count() < FEWEST_DAYS:
        return
    month = days.rolling(31, center=True, min_periods=5).median()
    spread = 1.4826 * (days - month).abs().rolling(31, center=True, min_periods=5).median()
    usual = month.reindex(dates).to_numpy()
    far = np.abs(air.to_numpy() - usual) > DEVIATIONS * np.maximum(spread.reindex(dates).to_numpy(), LEAST_DEVIATION_K)
    if far.any():
        row = int(np.argmax(far))
        yield (
            f"{name_of('air_temperature')} is {air.iloc[row]:.4g} degC at {at(row)}, where the days around have "
            f"{usual[row]:.3g} in the median; {int(far.sum())} of {len(air)} intervals are not of their season"
        )


def _sun(starts: pd.DatetimeIndex, interval: int, latitude_deg: float) -> np.ndarray:
    """Most shortwave on level ground above the atmosphere [W m-2] in each interval, by a clock that may be off."""
    hour = (starts.hour + starts.minute / 60.0).to_numpy()
    within = SUN_WITHIN_H + 0.5 * interval / 60.0  # solar time is told in whole intervals
    nearest_noon = np.clip(12.0, hour - within, hour + interval / 60.0 + within)
    day = starts.day_of_year.to_numpy()
    tilt = TILT[day - 1]
    distance = np.array([distance_factor(d) for d in range(366)])[day - 1]
    latitude, angle = math.radians(latitude_deg), 2.0 * math.pi * (nearest_noon - 12.0) / 24.0
    height = math.sin(latitude) * np.sin(tilt) + math.cos(latitude) * np.cos(tilt) * np.cos(angle)
    return SOLAR_CONSTANT * distance * np.maximum(height, 0.0)
