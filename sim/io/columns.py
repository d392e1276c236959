"""What the field calls the columns of a record, in which units, and between which limits their values lie."""

import difflib
import re
from dataclasses import dataclass

import numpy as np

#: Unit -> (factor, offset) into ours, by kind of quantity. Per interval: the factor is divided by its seconds.
_TEMPERATURE = {"degC": (1.0, 0.0), "K": (1.0, -273.15), "degF": (5.0 / 9.0, -160.0 / 9.0)}
_SPEED = {"m s-1": (1.0, 0.0), "km h-1": (1.0 / 3.6, 0.0), "knot": (1852.0 / 3600.0, 0.0), "mph": (0.44704, 0.0)}
_PRESSURE = {"hPa": (1.0, 0.0), "kPa": (10.0, 0.0), "Pa": (0.01, 0.0)}
_RADIATION = {"W m-2": (1.0, 0.0), "J m-2": (1.0, 0.0), "kJ m-2": (1e3, 0.0), "MJ m-2": (1e6, 0.0)}
PER_INTERVAL = ("J m-2", "kJ m-2", "MJ m-2")  # to be divided by the seconds of the interval
RATES = {"kg m-2 s-1": 1.0, "mm s-1": 1.0, "mm h-1": 3600.0, "mm d-1": 86400.0}  # seconds of what they are by
_UNITS = {
    "air_temperature": _TEMPERATURE,
    "deficit": _PRESSURE,
    "relative_humidity": {"%": (0.01, 0.0), "1": (1.0, 0.0)},
    "dew_point": _TEMPERATURE,
    "wind_speed": _SPEED,
    "eastward_wind": _SPEED,
    "northward_wind": _SPEED,
    "shortwave": _RADIATION,
    "longwave": _RADIATION,
    "precipitation": {
        "mm": (1.0, 0.0),
        "cm": (10.0, 0.0),
        "m": (1e3, 0.0),
        "in": (25.4, 0.0),
        **dict.fromkeys(RATES, (1.0, 0.0)),
    },
    "air_pressure": _PRESSURE,
}
#: Our unit -> how else files' attributes spell it, in small letters, once `_spelled` has written powers as in m-2.
_SPELLINGS = {
    "degC": ("c", "degc", "deg c", "degree c", "degrees c", "celsius", "degree celsius", "degrees celsius"),
    "K": ("k", "kelvin"),
    "degF": ("f", "degf", "deg f", "fahrenheit", "degrees fahrenheit"),
    "hPa": ("hpa", "mbar"),
    "kPa": ("kpa",),
    "Pa": ("pa",),
    "%": ("percent",),
    "1": ("fraction", "dimensionless"),
    "knot": ("knots", "kt"),
    "mm": ("kg m-2",),
    "m": ("m of water equivalent",),
    "in": ("inch", "inches"),
    "mm d-1": ("mm day-1", "kg m-2 d-1", "kg m-2 day-1"),
    "mm h-1": ("mm hr-1", "mm hour-1", "kg m-2 h-1"),
}

#: Kind -> (our unit, lowest and highest value allowed in it). Shortwave below 0 is a sensor's offset at night.
LIMITS = {
    "air_temperature": ("degC", -75.0, 50.0),
    "deficit": ("hPa", -0.5, 80.0),
    "relative_humidity": ("1", 0.0, 1.1),
    "dew_point": ("degC", -90.0, 40.0),
    "wind_speed": ("m s-1", 0.0, 60.0),
    "eastward_wind": ("m s-1", -60.0, 60.0),
    "northward_wind": ("m s-1", -60.0, 60.0),
    "shortwave": ("W m-2", -10.0, 1500.0),
    "longwave": ("W m-2", 50.0, 600.0),
    "precipitation": ("mm", -0.1, 200.0),
    "air_pressure": ("hPa", 500.0, 1100.0),
}
LEAST_LIGHT_W_M2 = 20.0  # brightest moment of a column of light
MM_A_YEAR = (20.0, 5000.0)

#: Quantity -> column -> unit, the preferred first. Towers: FLUXNET (filled, consolidated `_F` before the rest), ICOS
#: and AmeriFlux; reanalyses: ERA5-Land by its short and long names, and of the Earth Engine; last, our own names.
NAMES = {
    "air_temperature": {
        **dict.fromkeys(("TA_F", "TA_F_MDS", "TA", "TA_PI_F", "TA_ERA"), "degC"),
        **dict.fromkeys(("t2m", "2m_temperature", "temperature_2m"), "K"),
        "air_temperature_c": "degC",
    },
    "humidity": {
        **dict.fromkeys(("VPD_F", "VPD_F_MDS"), "hPa"),
        **dict.fromkeys(("RH_F", "RH", "RH_PI_F"), "%"),
        **dict.fromkeys(("VPD", "VPD_PI", "VPD_ERA"), "hPa"),
        **dict.fromkeys(("d2m", "2m_dewpoint_temperature", "dewpoint_temperature_2m"), "K"),
        "relative_humidity": "1",
    },
    "wind_speed": dict.fromkeys(("WS_F", "WS", "WS_PI_F", "WS_ERA", "si10", "wind_speed_m_s"), "m s-1"),
    "shortwave": {
        **dict.fromkeys(("SW_IN_F", "SW_IN_F_MDS", "SW_IN", "SW_IN_PI_F", "SW_IN_ERA"), "W m-2"),
        **dict.fromkeys(
            (
                "ssrd",
                "surface_solar_radiation_downwards",
                "surface_solar_radiation_downwards_sum",
                "surface_solar_radiation_downwards_hourly",
            ),
            "J m-2",
        ),
        "shortwave_w_m2": "W m-2",
    },
    "longwave": {
        **dict.fromkeys(
            ("LW_IN_F", "LW_IN_F_MDS", "LW_IN", "LW_IN_PI_F", "LW_IN_JSB_F", "LW_IN_JSB", "LW_IN_ERA"), "W m-2"
        ),
        **dict.fromkeys(
            (
                "strd",
                "surface_thermal_radiation_downwards",
                "surface_thermal_radiation_downwards_sum",
                "surface_thermal_radiation_downwards_hourly",
            ),
            "J m-2",
        ),
        "longwave_w_m2": "W m-2",
    },
    "precipitation": {
        **dict.fromkeys(("P_F", "P", "P_PI_F", "P_ERA"), "mm"),
        **dict.fromkeys(("tp", "total_precipitation", "total_precipitation_sum", "total_precipitation_hourly"), "m"),
        "precipitation_mm": "mm",
    },
    "air_pressure": {
        **dict.fromkeys(("PA_F", "PA", "PA_PI_F", "PA_ERA"), "kPa"),
        **dict.fromkeys(("sp", "surface_pressure"), "Pa"),
    },
    "eastward_wind": dict.fromkeys(("u10", "10m_u_component_of_wind", "u_component_of_wind_10m"), "m s-1"),
    "northward_wind": dict.fromkeys(("v10", "10m_v_component_of_wind", "v_component_of_wind_10m"), "m s-1"),
}
TIMES = ("time_start", "time_end", "time_middle", "time")
NEEDED = ("air_temperature", "humidity", "wind_speed", "shortwave", "precipitation")
OF_REANALYSIS = re.compile(r"t2m|d2m|ssrd|strd|tp|sp|[uv]10|si10|.*2m.*|.*10m.*|surface_.*|total_precipitation.*")
_POSITION = re.compile(r"(_\d+){1,3}|_\d+_\d+_A")  # of a sensor: horizontal, vertical, replicate


@dataclass(frozen=True)
class Column:
    """A column of a record that is used: its name, kind (a name of `LIMITS`) and unit, the column that says what was
    filled, if there is one, and one of a reanalysis that the record has beside it."""

    name: str
    kind: str
    unit: str
    quality: str | None = None
    reanalysis: str | None = None

    def converted(self, values, seconds: float):
        """Values of intervals of so many seconds in our unit."""
        return self._into_ours(values, self.unit, seconds)

    def as_given(self, values, seconds: float):
        """The inverse of `converted`."""
        zero, one = self.converted(0.0, seconds), self.converted(1.0, seconds)
        return (values - zero) / (one - zero)

    @property
    def units(self) -> str:
        """The units that it may have, in words."""
        return ", ".join(_UNITS[self.kind])

    def hint(self, values, seconds: float) -> str:
        """What other unit makes all values (as given) plausible, in words; nothing where there is none."""
        for unit in _UNITS[self.kind]:
            photons_too = unit == "kJ m-2"  # of a half-hour are near as many as umol m-2 s-1 of photons
            if (
                unit != self.unit
                and not photons_too
                and self._plausible(self._into_ours(values, unit, seconds), seconds)
            ):
                return f"; if it is in {unit}, say units={{{self.name!r}: {unit!r}}}"
        return ""

    def _plausible(self, ours, seconds: float) -> bool:
        _, low, high = LIMITS[self.kind]
        lowest, highest, mean = np.nanmin(ours), np.nanmax(ours), np.nanmean(ours)
        if self.kind == "shortwave":
            return low <= lowest and LEAST_LIGHT_W_M2 <= highest <= high
        if self.kind == "precipitation":
            return low <= lowest and highest <= high and MM_A_YEAR[0] <= mean * 365 * 86400 / seconds <= MM_A_YEAR[1]
        return low <= lowest and highest <= high

    def _into_ours(self, values, unit: str, seconds: float):
        factor, offset = _UNITS[self.kind][unit]
        if unit in PER_INTERVAL:
            factor = factor / seconds
        elif unit in RATES:
            factor = factor * (seconds / RATES[unit])
        return factor * values + offset


@dataclass(frozen=True)
class Choice:
    """The columns of a record that are used, by quantity, and what was passed over."""

    columns: dict[str, Column]
    time: str
    time_kind: str
    notes: list[str]


def choose(
    record: str, table: list[str], columns: dict | None, units: dict | None, empty, told: dict[str, str]
) -> Choice:
    """The columns to use of those that a record has.

    record : its name; table : its columns; columns : quantity -> column, in place of what we would take; units :
    column -> unit; empty : function of a column that says whether it has no number; told : column -> unit, as the
    record's own attributes say, which `units` overrule. Raises ValueError naming what is missing, unknown or not clear.
    """
    columns, units = dict(columns or {}), {name: _spelled(unit) for name, unit in (units or {}).items()}
    for quantity, name in columns.items():
        if quantity not in (*NAMES, *TIMES):
            raise ValueError(f"columns: unknown quantity {quantity!r}; allowed: {', '.join((*NAMES, *TIMES))}")
        if name not in table:
            raise ValueError(f"columns: the record has no column {name!r} for {quantity}{_near(name, table)}")
    for name in units:
        if name not in table:
            raise ValueError(f"units: the record has no column {name!r}{_near(name, table)}")

    empties: dict[str, list[str]] = {}
    picked: dict[str, str] = {}
    for quantity, names in NAMES.items():
        name, empties[quantity] = _pick(record, quantity, names, table, columns, empty)
        if name:
            picked[quantity] = name
    own = {
        name: _told_unit(record, quantity, name, told[name])
        for quantity, name in picked.items()
        if name in told and name not in units
    }
    _check_units(record, picked, own | units)
    found = {quantity: _column(quantity, name, table, own | units, told) for quantity, name in picked.items()}
    by_parts = "eastward_wind" in found and "northward_wind" in found
    for quantity in NEEDED:
        if quantity not in found and not (quantity == "wind_speed" and by_parts):
            what, some = quantity.replace("_", " "), ", ".join(list(NAMES[quantity])[:8])
            if empties[quantity]:
                raise ValueError(
                    f"{record}: no number for {what}: {', '.join(empties[quantity])} is empty, or -9999, in every row; "
                    f"another column is named by columns={{{quantity!r}: '..'}}"
                )
            raise ValueError(
                f"{record}: no column for {what}: none of {some}, ..; "
                f"name yours: columns={{{quantity!r}: '..'}}; the record has {_some(table)}"
            )
    if "wind_speed" in found or not by_parts:
        found = {quantity: column for quantity, column in found.items() if not quantity.endswith("ward_wind")}
    used = {column.name for column in found.values()}
    unused = [name for name in units if name not in used]
    if unused:
        raise ValueError(f"units: {unused[0]} is not used; used are {', '.join(sorted(used))}")
    time, kind = _time(record, table, columns, any(OF_REANALYSIS.fullmatch(name) for name in used))
    notes = [f"{name} has no number and was passed over" for names in empties.values() for name in names]
    return Choice(found, time, kind, notes)


def _pick(record, quantity, names, table, columns, empty) -> tuple[str | None, list[str]]:
    """The column of a quantity, if the record has one, and which were passed over because they have no number."""
    if quantity in columns:
        name = columns[quantity]
        if empty(name):
            raise ValueError(f"{record}: column {name}, for {quantity}, has no number")
        return name, []
    passed_over: list[str] = []
    for name in names:
        there = [name] if name in table else _at_positions(record, name, table)
        for column in there:
            if not empty(column):
                return column, passed_over
            passed_over.append(column)
    return None, passed_over


def _at_positions(record: str, name: str, table: list[str]) -> list[str]:
    """Columns of a quantity with the position of their sensor: the first one, or the only one."""
    at = [column for column in table if column.startswith(name) and _POSITION.fullmatch(column[len(name) :])]
    first = [f"{name}_1_1_1", f"{name}_1"]
    best = [column for column in first if column in at] or at
    if len(at) > 1 and best == at:
        quantity = next(quantity for quantity, names in NAMES.items() if name in names)
        raise ValueError(
            f"{record}: {', '.join(at)} could be {quantity}; name one: columns={{{quantity!r}: {at[0]!r}}}"
        )
    return best[:1]


def _unit(quantity: str, name: str, units: dict) -> str | None:
    """The unit of a column, as it is given or known by the column's name."""
    names = NAMES[quantity]
    base = name if name in names else next((n for n in names if _POSITION.fullmatch(name.removeprefix(n))), None)
    return units.get(name, names.get(base) if base else None)


def _spelled(unit: str) -> str:
    """A unit as we spell it, where we know it: m/s, m s**-1 and m.s-1 are m s-1."""
    text = re.sub(r"\*\*|\^", "", unit.translate(str.maketrans("⁻¹²", "-12")).replace("°", "deg"))
    text = re.sub(r"\s*/\s*([a-zA-Z]+)(\d?)", lambda per: f" {per[1]}-{per[2] or 1}", text)
    text = " ".join(re.sub(r"[.*·_]", " ", text).split())
    return next((ours for ours, others in _SPELLINGS.items() if text.lower() in others), text)


def _told_unit(record: str, quantity: str, name: str, told: str) -> str:
    """The unit of a column by the record's own attribute. Raises ValueError for one that is not known, or not of what
    the column's name says."""
    unit, by_name = _spelled(told), _unit(quantity, name, {})
    kinds = [kind for kind in _kinds(quantity) if by_name is None or by_name in _UNITS[kind]]
    if not any(unit in _UNITS[kind] for kind in kinds):
        allowed = ", ".join(each for kind in kinds for each in _UNITS[kind])
        raise ValueError(
            f"{record}: {name} has the attribute units {told!r}; allowed for {quantity}: {allowed}; "
            f"if it is wrong, say units={{{name!r}: '..'}}"
        )
    return unit


def _kinds(quantity: str) -> tuple[str, ...]:
    return ("deficit", "relative_humidity", "dew_point") if quantity == "humidity" else (quantity,)


def _check_units(record: str, picked: dict[str, str], units: dict) -> None:
    """Refuse columns whose unit is not known, all at once, or not one of their quantity."""
    allowed = {quantity: ", ".join(u for kind in _kinds(quantity) for u in _UNITS[kind]) for quantity in picked}
    unknown = [quantity for quantity, name in picked.items() if _unit(quantity, name, units) is None]
    if unknown:
        names = [picked[quantity] for quantity in unknown]
        say = ", ".join(f"{name!r}: .." for name in names)
        each = "; ".join(f"{name} in {allowed[quantity]}" for name, quantity in zip(names, unknown, strict=True))
        raise ValueError(f"{record}: units are not known; say units={{{say}}}: {each}")
    for quantity, name in picked.items():
        unit = _unit(quantity, name, units)
        if not any(unit in _UNITS[kind] for kind in _kinds(quantity)):
            raise ValueError(f"units: {name} in {unit!r}; allowed for {quantity}: {allowed[quantity]}")


def _column(quantity: str, name: str, table: list[str], units: dict, told: dict) -> Column:
    names, unit = NAMES[quantity], str(_unit(quantity, name, units))
    kind = next(kind for kind in _kinds(quantity) if unit in _UNITS[kind])
    quality = f"{name}_QC" if f"{name}_QC" in table else None
    reanalysis = next((n for n in names if n.endswith("_ERA") and n in table and n != name), None)
    same = reanalysis if reanalysis and _spelled(told.get(reanalysis, names[reanalysis])) == unit else None
    return Column(name, kind, unit, quality, same)


def _time(record, table, columns, reanalysis: bool) -> tuple[str, str]:
    """The column of times, and what they are: "start", "end", "middle", "instant" or "day"."""
    given = [quantity for quantity in TIMES if quantity in columns]
    if len(given) > 1:
        raise ValueError(f"columns: one of {', '.join(TIMES)} is allowed, got {', '.join(given)}")
    if given:
        kinds = {
            "time_start": "start",
            "time_end": "end",
            "time_middle": "middle",
            "time": "instant" if reanalysis else "day",
        }
        return columns[given[0]], kinds[given[0]]
    for name, kind in (("TIMESTAMP_START", "start"), ("TIMESTAMP_END", "end"), ("TIMESTAMP", "day")):
        if name in table:
            return name, kind
    for name in ("valid_time", "time", "date", "Date", "datetime"):
        if name in table:
            return name, "instant" if reanalysis else "day"
    raise ValueError(
        f"{record}: no column of times: none of TIMESTAMP_START, TIMESTAMP_END, TIMESTAMP, valid_time, time; name "
        f"yours: columns={{'time_start': '..'}}, 'time_end' or 'time_middle'; the record has {_some(table)}"
    )


def _near(name, table) -> str:
    near = difflib.get_close_matches(str(name), table, n=3, cutoff=0.5)
    return f"; did you mean {', '.join(near)}?" if near else f"; it has {_some(table)}"


def _some(table) -> str:
    return (", ".join(table[:12]) or "none") + (f", .. ({len(table)} columns)" if len(table) > 12 else "")
