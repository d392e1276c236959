"""Whether a record's clock can be what it says, and from how much of one that and its units can be told."""

import pandas as pd

from sim.io.clock import hours_apart, noon_of

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
