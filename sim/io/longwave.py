"""Longwave from the sky where a record has none: emissivity of clear air, and of the clouds that the sunlight tells of.

Clear air is Prata's (1996, Eq. 16), as in the weather generator. Clouds close the share of the rest by which the day's
sunlight falls short of a clear day's (Crawford and Duchon 1999, Eqs. 8 and 11), which is 0.75 of the extraterrestrial
(Allen et al. 1998, FAO-56, Eq. 37). Days with hardly any sun have clouds between those of the days before and after.
"""

import numpy as np
import pandas as pd

from sim import radiation
from sim.io.disaggregation import sun_height
from sim.jit import uncompiled
from sim.physical_constants import FREEZING_POINT_K, SOLAR_CONSTANT
from sim.weather import sky_emissivity, solar_distance_factor

black_body, emissivity = uncompiled(radiation.black_body), np.vectorize(uncompiled(sky_emissivity), otypes=[float])
distance_factor = uncompiled(solar_distance_factor)

CLEAR_SKY = 0.75
LEAST_SUN_W_M2 = 20.0  # extraterrestrial, of a day that tells of its clouds


def extraterrestrial(days: pd.DatetimeIndex, latitude_deg: float) -> np.ndarray:
    """Daily mean shortwave at the top of the atmosphere [W m-2]."""
    distance = np.array([distance_factor(day - 1) for day in days.day_of_year])
    return SOLAR_CONSTANT * distance * sun_height(days, latitude_deg).mean(axis=1)


def cloud_cover(days: pd.DatetimeIndex, shortwave: np.ndarray, latitude_deg: float) -> np.ndarray:
    """Share of the sky's missing emissivity that clouds close, by day, from the day's mean shortwave [W m-2]."""
    possible = extraterrestrial(days, latitude_deg)
    sunny = possible >= LEAST_SUN_W_M2
    clear = np.clip(shortwave / (CLEAR_SKY * np.where(sunny, possible, 1.0)), 0.0, 1.0)
    known = pd.Series(np.where(sunny, 1.0 - clear, np.nan), index=days)
    if known.isna().all():
        raise ValueError(
            f"forcing: no day has sun enough to tell its clouds by, from {days[0]:%Y-%m-%d} on; longwave is needed"
        )
    return known.interpolate(method="time", limit_direction="both").to_numpy()


def longwave(air_temperature: np.ndarray, vapour_hpa: np.ndarray, cloud: np.ndarray) -> np.ndarray:
    """Longwave from the sky [W m-2] at air temperatures [degC] and vapour pressures [hPa]."""
    return emissivity(air_temperature, vapour_hpa, cloud) * black_body(air_temperature + FREEZING_POINT_K)
