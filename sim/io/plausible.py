"""Whether a record's values can be what they say: the units that limits cannot tell, and the clock."""

import numpy as np
import pandas as pd

from sim.io.clock import hours_apart, noon_of
from sim.io.columns import MM_A_YEAR, Column
from sim.io.longwave import extraterrestrial

FEWEST_DAYS = 20  # that tell
NOON_WITHIN_H = 0.75
LEAST_SUN_W_M2 = 50.0  # extraterrestrial, of a day whose clearness tells
WARM_C = 5.0
LEAST_HUMIDITY = 0.15  # relative, in half of all intervals
DAYS_OF_A_YEAR = 300  # at least, that a year's precipitation is told by


def check_sun(name: str, weather: pd.DataFrame, interval: int, expected_h: float, clock: str) -> None:
    """Refuse sunlight whose middle is not at noon. expected_h : the hour of the index at which the sun is highest."""
    days = weather["shortwave"].groupby(weather.index.normalize()).mean()
    if (days > 20.0).sum() < FEWEST_DAYS:
        return
    noon = noon_of(weather.index, interval, weather["shortwave"].to_numpy())
    if noon is None:
        return
    late = hours_apart(noon, expected_h)
    if abs(late) > NOON_WITHIN_H:
        when = "after" if late > 0 else "before"
        raise ValueError(
            f"{name}: the record has the middle of its light {abs(late):.1f} hours {when} solar noon; {clock}, "
            "longitude_deg, or starts that are ends of the intervals may be wrong"
        )


def check_units(
    name: str, weather: pd.DataFrame, columns: dict[str, Column], latitude_deg: float, interval: int
) -> None:
    """Refuse values within their limits that must be of another unit, in all of the record or in a year. Dry air, damp
    air and little rain pass where the caller gave the unit; light that no sky gives, and rain of no climate, do not.

    weather : by local solar time, the record's quantities, relative humidity and precipitation of an interval.
    """
    _check_units(name, weather, columns, latitude_deg, interval)
    for year, part in weather.groupby(pd.DatetimeIndex(weather.index).year):
        if DAYS_OF_A_YEAR * 1440 <= len(part) * interval < len(weather) * interval:
            _check_units(f"{name}, {year}", part, columns, latitude_deg, interval)


def _check_units(name, weather, columns, latitude_deg, interval) -> None:
    days = weather.groupby(weather.index.normalize()).mean()
    dates = pd.DatetimeIndex(days.index)

    def refuse(column, what, possible=True):
        if not (possible and column.unit_given):
            again = f"; {column.unit} again takes it as it is" if possible else ""
            raise ValueError(
                f"{name}: {column.name} in {column.unit}: {what}; say its unit: units={{{column.name!r}: ..}}, of "
                f"{column.units}{again}"
            )

    possible = extraterrestrial(dates, latitude_deg)
    sunny = (possible > LEAST_SUN_W_M2) & days["shortwave"].notna().to_numpy()
    if sunny.sum() >= FEWEST_DAYS:
        brightest = float(np.quantile(days["shortwave"].to_numpy()[sunny] / possible[sunny], 0.98))
        if not 0.3 <= brightest <= 1.1:
            share = f"{100 * brightest:.3g} % of the sunlight above the atmosphere"
            refuse(columns["shortwave"], f"a clear day has {share}, where 60 to 85 are usual", possible=False)
    humidity = columns["humidity"]
    warm = (days["air_temperature"] > WARM_C) & days["humidity"].notna()
    if warm.sum() >= FEWEST_DAYS:
        moments = weather.loc[weather["air_temperature"] > WARM_C, "humidity"].dropna()
        driest, median = float(moments.quantile(0.02)), float(moments.median())
        if driest > 0.85:
            refuse(humidity, f"relative humidity is above {100 * driest:.0f} % in 98 of 100 warm intervals")
        if median < LEAST_HUMIDITY:
            refuse(humidity, f"relative humidity is {100 * median:.2g} % in half of all warm intervals")
    if len(days) >= DAYS_OF_A_YEAR:
        yearly, (least, most) = float(weather["precipitation"].mean() * 1440 / interval * 365), MM_A_YEAR
        if not least <= yearly <= most:
            what = f"precipitation is {yearly:.3g} mm a year; [{least:g}, {most:g}] is usual"
            refuse(columns["precipitation"], what, possible=yearly < least)
