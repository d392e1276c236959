"""Forcing of the simulator from a tower's or a reanalysis' own file."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd

from sim.io import gaps as filling
from sim.io import reanalysis
from sim.io.clock import (
    DAY,
    check_ends,
    hours_apart,
    interval_of,
    is_daily,
    kind_of_times,
    minutes_ahead,
    noon_of,
    read_times,
)
from sim.io.columns import LIMITS, NAMES, Choice, Column, choose
from sim.io.disaggregation import FOREST_CYCLE, DiurnalCycle, climate_of, half_hours, leap_day, saturation_water
from sim.io.longwave import cloud_cover, longwave
from sim.io.plausible import FEWEST_DAYS, check_sun, in_numbers, percent, unusual_lines
from sim.io.table import Table, open_table
from sim.parameters import SITE_PARAMETERS
from sim.state import FORCING

#: What the columns `<name>_flag` of a forcing say of each value.
FLAGS = {
    0: "as given",
    1: "filled by its source",
    2: "filled here: on a straight line, over at most three hours or a day",
    3: "filled here: the mean of the same time of day in the weeks around",
    4: "computed here: longwave from temperature, humidity and sunlight",
    5: "set here to its limit: no negative light or rain, no humidity above saturation",
    6: "repeated here from the day beside it, where the record's first or last day is not whole by solar time",
    7: "filled here: by the reanalysis column that the record has beside it",
}
GIVEN, BY_SOURCE, BY_LINE, BY_MEAN, COMPUTED, LIMITED, REPEATED, BY_REANALYSIS = FLAGS
OURS = dict(
    zip(("air_temperature", "humidity", "wind_speed", "shortwave", "longwave", "precipitation"), FORCING, strict=True)
)
GAPS = ("refuse", "fill")
UNUSUAL = ("refuse", "take")
EDGE_HOURS = 12.5
PLACE_WITHIN_DEG = 1.0  # as `sim.simulate` has it: a cell of a reanalysis is not the site's middle
#: What is no more than a sum's or a sensor's last digit, and not worth a flag.
ROUND_OFF = {"shortwave": 0.1, "precipitation": 1e-3}

_of_each = np.vectorize(saturation_water, otypes=[float])


def read_forcing(
    source,
    *,
    latitude_deg,
    longitude_deg=None,
    utc_offset_h=None,
    years=None,
    gaps="refuse",
    longest_gap_days=14,
    columns=None,
    units=None,
    diurnal_cycle=FOREST_CYCLE,
    unusual="refuse",
):
    """Weather of a record as `sim.simulate(forcing=...)` takes it.

    Parameters
    ----------
    source : CSV file (also .gz), NetCDF file, DataFrame or xarray Dataset of one place, with the columns of FLUXNET,
        ICOS or AmeriFlux (TA_F, VPD_F, SW_IN_F, ..; -9999 is a gap) or of ERA5-Land (t2m, d2m, ssrd, ..; sums since
        midnight UTC, or of each hour). Daily, or every 120 minutes and oftener. `sim.io.columns.NAMES` has all names.
    latitude_deg, longitude_deg : of the place; the longitude, east positive, is needed unless the record is daily. A
        record that has its own is refused at another place.
    utc_offset_h : hours that the record's clock is ahead of UTC, without summer time (Sweden 1, Alaska -9); needed for
        towers, unless they are daily. Times with a time zone are converted by it; days keep their dates.
    years : first and last year to use, or one; all by default. The result has whole years of 365 days, from 1 January
        (29 February is dropped), or a part of one year.
    gaps : "refuse" raises at the first; "fill" fills and flags them: by the reanalysis column that the record has
        beside it, however long; else, up to `longest_gap_days` days, on a straight line over three hours, as the mean
        of the same time of day in the weeks around (Falge et al. 2001); longwave of more than three hours, however
        many, by temperature, humidity and sunlight.
    columns : names of your own: {"air_temperature": "Tair", "time_start": "begin", ..}. Times are "time_start",
        "time_end" or "time_middle" of their intervals, or the "time" of a reanalysis or a day.
    units : of columns whose unit is not the usual one, or not known: {"Tair": "K"}. It overrules the attribute `units`
        of a NetCDF file's or a Dataset's variable, which overrules the usual one.
    diurnal_cycle : `sim.DiurnalCycle` of temperature, of a daily record.
    unusual : "refuse" raises at what no weather or no sensor gives though each value is within its limits, such as a
        column of another unit or a sensor that stands still (`sim.io.plausible`); "take" takes it, and the report says
        what it was.

    Returns
    -------
    pandas.DataFrame, a row an interval (a daily record: a half-hour), indexed by the local solar time at which it
    begins: the columns of `sim.state.FORCING`, and for each a column `<name>_flag` of `FLAGS`. Longwave that the record
    does not have is computed (`sim.io.longwave`). `attrs["report"]` says in lines what is from where and what was done,
    `attrs["site"]` what the record tells of the site: `sim.simulate` takes it from there.

    Raises ValueError for what is missing, unknown, out of its limits or unusual, naming line, time and column.
    """
    _check_arguments(latitude_deg, longitude_deg, utc_offset_h, gaps, longest_gap_days, diurnal_cycle, unusual)
    table = open_table(source)
    _check_place(table, latitude_deg, longitude_deg)
    recognised = _recognised(table.columns, columns, units)
    rows = table.read(recognised)
    if recognised and not len(rows):
        raise ValueError(f"{table.name}: 0 rows; whole days at a regular interval are allowed")
    choice = choose(table.name, table.columns, columns, units, lambda name: _is_empty(rows[name]), table.units)
    times = read_times(table, rows[choice.time], choice.time)
    if choice.time == "TIMESTAMP_START" and "TIMESTAMP_END" in rows and times.tz is None:
        check_ends(table, times, read_times(table, rows["TIMESTAMP_END"], "TIMESTAMP_END"))
    if times.tz is not None:
        if utc_offset_h is not None:
            raise ValueError("utc_offset_h: the record's times have a time zone already; None is allowed")
        dates = read_times(table, rows[choice.time], choice.time, zone=False)
        if is_daily(dates):  # a day is the date that is written, not Greenwich's
            times = dates
        else:
            times, utc_offset_h = times.tz_convert("UTC").tz_localize(None), 0.0
    interval = interval_of(table, times)
    kind = kind_of_times(table, choice, interval, rows[choice.time])
    if kind == "middle":
        times = times - pd.Timedelta(minutes=interval / 2)
    _check_grid(table, times, interval, choice.time)
    report = list(choice.notes)

    record, flags, row_of = _values(table, rows, choice, times, interval)
    if kind == "instant":
        utc_offset_h = 0.0 if utc_offset_h is None else utc_offset_h
        record, flags, row_of, note = _between_times(table, record, flags, row_of, choice, interval)
        report.append(note)
    elif interval == DAY:
        # half a day before its end a day has its date, be the end 24:00 or 23:59
        record.index = (record.index - pd.Timedelta(hours=12 if kind == "end" else 0)).normalize()
    elif kind == "end":
        record.index = record.index - pd.Timedelta(minutes=interval)
    flags.index = row_of.index = record.index
    record = _derived(record, choice, flags)

    if interval != DAY:
        if longitude_deg is None:
            raise ValueError("longitude_deg is needed to tell solar time: degrees east, such as 19.8 or -147.5")
        if utc_offset_h is None:
            raise ValueError(_offset_needed(record, interval, longitude_deg))
        ahead = minutes_ahead(longitude_deg, utc_offset_h)
        late = check_sun(table.name, record, interval, 12.0 - ahead / 60.0, f"utc_offset_h = {utc_offset_h:g}")
        shift = interval * round(ahead / interval)
        for each in (record, flags, row_of):
            each.index = each.index + pd.Timedelta(minutes=shift)
        report.append(
            f"times are moved by {shift:+d} minutes, whole intervals, to local solar time, which is {ahead:+.1f} from "
            f"the record's clock: {ahead - shift:+.1f} are left"
            + ("" if late is None else f"; by its clock the middle of the light is {60.0 * late:+.0f} from solar noon")
        )

    wanted = _whole_days(table, record.index, interval, years)
    record, flags, row_of = record.reindex(wanted), flags.reindex(wanted), row_of.reindex(wanted)
    taken = []
    seen = _completed(record) if gaps == "fill" else record
    for line in unusual_lines(table.name, seen, choice.columns, latitude_deg, interval, _relative_humidity):
        if unusual == "refuse":
            raise ValueError(f"{line}; unusual='take' takes it as it is")
        taken.append(line)
    report += [f"unusual, and taken as it is: {line}" for line in taken]
    _repeat_at_edges(record, flags, row_of, interval)
    _fill(table, record, flags, row_of, choice, interval, gaps, longest_gap_days)
    _add_longwave(record, flags, latitude_deg)
    report.append(in_numbers(record, interval))
    site = {"latitude_deg": float(latitude_deg), **climate_of(record["air_temperature"])}
    flags = flags.fillna(GIVEN).astype("int8")
    if interval == DAY:
        forcing, flags = _in_half_hours(record, flags, choice, latitude_deg, diurnal_cycle)
        report.append(
            "half-hours are made of days (`sim.half_hours`): temperature by a cosine, light by the sun's height"
        )
    else:
        kept = ~leap_day(record.index)
        forcing, flags = record[list(OURS)].rename(columns=OURS)[kept], flags[list(OURS)][kept]
    forcing = forcing.rename_axis("time").join(flags.rename(columns={q: f"{name}_flag" for q, name in OURS.items()}))
    dropped = int(leap_day(wanted).sum() * interval // DAY)
    report += [f"29 February was dropped in {dropped} year{'s' * (dropped > 1)}"] if dropped else []
    if (days := len(wanted) * interval // DAY) < FEWEST_DAYS:
        report.append(f"{days} days are too few to tell wrong units by: it takes {FEWEST_DAYS}, for rain a year")
    pressure = choice.columns.get("air_pressure")
    if pressure:
        report.append(
            f"air pressure is {record['air_pressure'].mean():.0f} hPa ({pressure.name}), which is not used: give it as "
            "constants={'air_pressure_hpa': ..}"
        )
    forcing.attrs = {"report": _sources(forcing, choice) + report, "site": site, "flags": dict(FLAGS), "unusual": taken}
    return forcing


# ------------------------------------------------------------------------------------------------------- arguments


def _check_arguments(latitude_deg, longitude_deg, utc_offset_h, gaps, longest_gap_days, diurnal_cycle, unusual) -> None:
    latitude = SITE_PARAMETERS["latitude_deg"]
    limits = {
        "latitude_deg": (latitude_deg, latitude.physical_low, latitude.physical_high, False),
        "longitude_deg": (longitude_deg, -180.0, 180.0, True),
        "utc_offset_h": (utc_offset_h, -12.0, 14.0, True),
        "longest_gap_days": (longest_gap_days, 0.0, 28.0, False),
    }
    for name, (value, low, high, optional) in limits.items():
        if value is None and optional:
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not low <= value <= high:
            raise ValueError(f"{name} = {value!r}: a number in [{low:g}, {high:g}] is allowed")
    for name, given, allowed in (("gaps", gaps, GAPS), ("unusual", unusual, UNUSUAL)):
        if not isinstance(given, str) or given not in allowed:
            raise ValueError(f"{name} {given!r}: allowed are {', '.join(allowed)}")
    if not isinstance(diurnal_cycle, DiurnalCycle):
        raise ValueError(f"diurnal_cycle: a sim.DiurnalCycle is allowed, got {diurnal_cycle!r}")


def _check_place(table: Table, latitude_deg: float, longitude_deg: float | None) -> None:
    """Refuse a place that is not the record's own: the sun has to be that of its place."""
    for name, given in (("latitude_deg", latitude_deg), ("longitude_deg", longitude_deg)):
        told = table.place.get(name)
        if told is not None and given is not None and abs((given - told + 180.0) % 360.0 - 180.0) > PLACE_WITHIN_DEG:
            raise ValueError(
                f"{name} = {given:g}: {table.name} is of {told:g}; within {PLACE_WITHIN_DEG:g} degree of it is allowed"
            )


def _check_grid(table: Table, times: pd.DatetimeIndex, interval: int, name: str) -> None:
    """Refuse intervals that do not begin and end on the full interval: they would lie between those of a day."""
    off = (times[0] - times[0].normalize()) / pd.Timedelta(minutes=1) % interval
    if interval != DAY and off:
        hint = f"; if they are the middles of intervals, say columns={{'time_middle': {name!r}}}"
        raise ValueError(
            f"{table.where(0)}: {name} is {times[0]:%Y-%m-%d %H:%M}, {off:g} minutes off the full interval of "
            f"{interval}; starts or ends at full intervals are allowed{hint if 2 * off == interval else ''}"
        )


def _offset_needed(record: pd.DataFrame, interval: int, longitude_deg: float) -> str:
    noon = noon_of(record.index, interval, record["shortwave"].to_numpy())
    by_sun = (
        "" if noon is None else f"; by the record's sun it is {round(hours_apart(noon, 12.0 - longitude_deg / 15.0)):g}"
    )
    return f"utc_offset_h is needed: hours that the record's clock is ahead of UTC, without summer time{by_sun}"


# ---------------------------------------------------------------------------------------------------------- values


def saturation(air_temperature: np.ndarray) -> np.ndarray:
    """Saturation vapour pressure over water [hPa] at temperatures in degC; NaN where there is none."""
    air_temperature = np.asarray(air_temperature)
    known = ~np.isnan(air_temperature)
    values = np.full(len(air_temperature), np.nan)
    if known.any():
        values[known] = _of_each(air_temperature[known])
    return values


def _recognised(names: list[str], columns: dict | None, units: dict | None) -> list[str]:
    """Columns that may be of use, with their quality flags."""
    for what, mapping in (("columns", columns), ("units", units)):
        if mapping is not None and not isinstance(mapping, dict):
            raise ValueError(f"{what}: a dict of names is allowed, got {type(mapping).__name__}")
        for key, name in (mapping or {}).items():
            if not isinstance(name, str):
                raise ValueError(f"{what}: a text for {key!r} is allowed, got {name!r}")
    known = {name for quantity in NAMES.values() for name in quantity}
    own = set((columns or {}).values())
    wanted = own | {f"{name}_QC" for name in own} | {"TIMESTAMP_START", "TIMESTAMP_END", "TIMESTAMP"}
    wanted |= {"valid_time", "time", "date", "Date", "datetime"}
    stems = tuple(f"{name}_" for name in known)
    return [name for name in names if name in wanted or name in known or name.startswith(stems)]


def _is_empty(texts: pd.Series) -> bool:
    values = pd.to_numeric(texts, errors="coerce")
    return bool((texts.isna() | (values <= -9990.0)).all())


def _relative_humidity(kind: str, values: np.ndarray, air_temperature: np.ndarray) -> np.ndarray:
    """Relative humidity of a column of a kind, at air temperatures in degC; it may be above 1."""
    if kind == "relative_humidity":
        return values
    saturated = saturation(air_temperature)
    return saturation(values) / saturated if kind == "dew_point" else 1.0 - np.maximum(values, 0.0) / saturated


def _values(table: Table, rows: pd.DataFrame, choice: Choice, times: pd.DatetimeIndex, interval: int):
    """The record's quantities in our units, their flags, and each one's row of the table (NaN where there is none), on
    the record's own regular times. Raises ValueError for what is beyond its limits."""
    index = pd.date_range(times[0], times[-1], freq=f"{interval}min")
    seconds = 60.0 * interval
    record, flags = pd.DataFrame(index=index), pd.DataFrame(index=index)
    summed = choice.time_kind == "instant" and interval != DAY
    for quantity, column in choice.columns.items():
        values = column.converted(table.numbers(rows[column.name], column.name), seconds)
        flag = np.zeros(len(values))
        if column.quality:
            quality = table.numbers(rows[column.quality], column.quality)
            filled = quality < 1.0 if interval == DAY else quality >= 1.0
            flag = np.where(filled, BY_SOURCE, flag)
        if column.reanalysis:
            beside = column.converted(table.numbers(rows[column.reanalysis], column.reanalysis), seconds)
            used = np.where(np.isnan(values), beside, np.nan)
            _check_limits(table, times, replace(column, name=column.reanalysis), used, seconds)
            record[f"{quantity}_beside"] = pd.Series(beside, index=times).reindex(index)
        if not (summed and quantity in reanalysis.ACCUMULATED):
            _check_limits(table, times, column, values, seconds)
        record[quantity] = pd.Series(values, index=times).reindex(index)
        flags[quantity] = pd.Series(flag, index=times).reindex(index).fillna(0)
    if "longwave" not in record:
        record["longwave"], flags["longwave"] = np.nan, 0
    return record, flags, pd.Series(np.arange(len(times), dtype=float), index=times).reindex(index)


def _check_limits(table, times, column: Column, values, seconds, rows=None, verb="is") -> None:
    unit, low, high = LIMITS[column.kind]
    wrong = (values < low) | (values > high)
    if wrong.any():
        k = int(np.argmax(wrong))
        where = table.where(k if rows is None else int(rows[k]))
        given = column.as_given(values, seconds)
        of_record = f"{given[k]:.6g} {column.unit}, which is " if column.unit != unit else ""
        unit = "" if unit == "1" else f" {unit}"
        raise ValueError(
            f"{where} ({times[k]:%Y-%m-%d %H:%M}): {column.name} {verb} {of_record}{values[k]:.6g}{unit}; "
            f"[{low:g}, {high:g}]{unit} is allowed{column.hint(given, seconds)}"
        )


def _between_times(table, record, flags, row_of, choice, interval):
    """Means and sums of the intervals between the times of a reanalysis."""
    seconds, times = 60.0 * interval, pd.DatetimeIndex(record.index)
    sums = {q: record[q].to_numpy() for q in reanalysis.ACCUMULATED if q in choice.columns}
    since_midnight = reanalysis.since_midnight(times, sums, seconds)
    between = pd.DataFrame(index=times[:-1])
    for quantity in record:
        values = record[quantity].to_numpy()
        if quantity not in reanalysis.ACCUMULATED:
            between[quantity] = reanalysis.between(values)
        else:
            between[quantity] = reanalysis.of_intervals(times, values, seconds) if since_midnight else values[1:]
    rows = row_of.to_numpy()[1:]
    for quantity in sums:
        values = between[quantity].to_numpy()
        verb = "grows by" if since_midnight else "is"
        _check_limits(table, times[1:], choice.columns[quantity], values, seconds, np.nan_to_num(rows), verb)
    what = "since midnight UTC" if since_midnight else "of each interval"
    note = f"light and precipitation are sums {what}; the rest are values at the times, averaged over each interval"
    return between, flags.iloc[1:].copy(), pd.Series(rows, index=between.index), note


def _derived(record: pd.DataFrame, choice: Choice, flags: pd.DataFrame) -> pd.DataFrame:
    """Relative humidity as `humidity` (and the deficit, where that is what was measured), the wind from its parts, and
    nothing below 0 or above saturation."""
    record = record.copy()
    if "eastward_wind" in record:
        record["wind_speed"] = np.hypot(record.pop("eastward_wind"), record.pop("northward_wind"))
        flags["wind_speed"] = 0
    kind = choice.columns["humidity"].kind
    for name in ("humidity", "precipitation"):
        record[f"{name}_measured"] = record[name]
    for name in [name for name in ("humidity", "humidity_beside") if name in record]:
        humidity = _relative_humidity(kind, record[name].to_numpy(), record["air_temperature"].to_numpy())
        limited = np.where(np.isnan(humidity), np.nan, np.clip(humidity, 0.05 if kind == "deficit" else 0.01, 1.0))
        record[name] = limited
        if name == "humidity":
            flags.loc[np.abs(limited - humidity) > 1e-3, name] = LIMITED
    for name in ("shortwave", "precipitation"):
        flags.loc[record[name] < -ROUND_OFF[name], name] = LIMITED
        for one in (name, f"{name}_beside"):
            if one in record:
                record[one] = record[one].clip(lower=0.0)
    return record


def _completed(record: pd.DataFrame) -> pd.DataFrame:
    """The record with its gaps filled by what a reanalysis has beside it."""
    beside = {name: record[f"{name}_beside"] for name in OURS if f"{name}_beside" in record}
    return record.assign(**{name: record[name].fillna(values) for name, values in beside.items()})


# ------------------------------------------------------------------------------------------------- years and gaps


def _whole_days(table: Table, index: pd.DatetimeIndex, interval: int, years) -> pd.DatetimeIndex:
    """Times of the whole years that are wanted, or of the whole days of a part of the only one."""
    edge, step = pd.Timedelta(hours=EDGE_HOURS if interval != DAY else 0), pd.Timedelta(minutes=interval)
    first, end = index[0], index[-1] + step

    def begins(year):
        return pd.Timestamp(year, 1, 1)

    whole = [y for y in range(first.year, end.year + 2) if first - edge <= begins(y) and begins(y + 1) <= end + edge]
    have = f"the record is from {first:%Y-%m-%d} to {index[-1]:%Y-%m-%d}"
    have += f"; whole years are {whole[0]} to {whole[-1]}" if whole else "; it has no whole year"
    if years is not None:
        pair = (years, years) if isinstance(years, (int, np.integer)) else tuple(years) if np.ndim(years) == 1 else ()
        if len(pair) != 2 or isinstance(years, bool) or not all(isinstance(y, (int, np.integer)) for y in pair):
            raise ValueError(f"years: a year or (first, last) is allowed, got {years!r}")
        if pair[0] > pair[1]:
            raise ValueError(f"years = {years!r}: the first year has to come first")
        if pair[0] not in whole or pair[1] not in whole:
            raise ValueError(f"years = {years!r}: {have}")
        start, stop = begins(pair[0]), begins(pair[1] + 1)
    else:
        start = begins((first + edge).year)
        if abs(first - start) > edge:
            say = (
                f"; say years=({whole[0]}, {whole[-1]})"
                if whole
                else ", if need be with a reanalysis before it (dates of solar time)"
            )
            raise ValueError(f"{table.name}: {have}; it has to start on 1 January{say}")
        days = math.floor((end + edge - start) / pd.Timedelta(days=1))
        stop = start + pd.Timedelta(days=days)
        if whole and stop != begins(whole[-1] + 1):
            raise ValueError(f"{table.name}: {have}, and a part of another; say years=({whole[0]}, {whole[-1]})")
        if days < 1:
            raise ValueError(f"{table.name}: {have}; whole days are allowed")
    return pd.date_range(start, stop - step, freq=f"{interval}min")


def _repeat_at_edges(record, flags, row_of, interval: int) -> None:
    """Fill what solar time leaves of the first and the last day from the day beside it, in place."""
    there, per_day = np.flatnonzero(row_of.notna()), DAY // interval
    if not len(there) or interval == DAY:
        return
    before, after = int(there[0]), len(row_of) - 1 - int(there[-1])
    most = int(EDGE_HOURS * 60 // interval)
    for places, away in ((range(before), per_day), (range(len(row_of) - after, len(row_of)), -per_day)):
        if 0 < len(places) <= most and len(row_of) > 2 * per_day:
            place = np.array(places)
            record.iloc[place] = record.iloc[place + away].to_numpy()
            flags.iloc[place] = REPEATED
            row_of.iloc[place] = row_of.iloc[place + away].to_numpy()


def _fill(table, record, flags, row_of, choice: Choice, interval: int, gaps: str, longest_gap_days: float) -> None:
    """Refuse gaps or fill them, in place; longwave of more than three hours is left to `_add_longwave`."""
    per_day = DAY // interval
    kept = ~leap_day(record.index)  # a record may lack the day that is dropped anyway
    for quantity in OURS:
        empty = record[quantity].isna().to_numpy() & kept
        if not empty.any() or (quantity == "longwave" and "longwave" not in choice.columns):
            continue
        if gaps == "refuse":
            raise ValueError(_first_gap(table, record, row_of, choice, quantity, empty, interval))
        if f"{quantity}_beside" in record:
            _put(record, flags, quantity, record[f"{quantity}_beside"], BY_REANALYSIS)
        if quantity == "longwave":
            _put(record, flags, quantity, filling.interpolated(record[quantity], interval), BY_LINE)
            continue
        first, length = filling.longest(record[quantity].isna().to_numpy()[kept])
        if length > longest_gap_days * per_day:
            begin = record.index[kept][first]
            raise ValueError(
                f"{table.name}: {_name(choice, quantity)} is missing from {begin:%Y-%m-%d %H:%M} on for "
                f"{length / per_day:.3g} days; gaps of up to longest_gap_days = {longest_gap_days:g} are filled"
            )
        if quantity != "precipitation":
            _put(record, flags, quantity, filling.interpolated(record[quantity], interval), BY_LINE)
        _put(record, flags, quantity, filling.mean_course(record[quantity], per_day), BY_MEAN)
        left = record[quantity].isna() & kept
        if left.any():
            raise ValueError(
                f"{table.name}: {_name(choice, quantity)} is missing at {left.idxmax():%Y-%m-%d %H:%M}, and too little "
                "is known of that time of day in the weeks around; choose other years"
            )


def _moment(time, interval: int) -> str:
    return f"{time:%Y-%m-%d}" if interval == DAY else f"{time:%Y-%m-%d %H:%M} solar time"


def _put(record, flags, quantity: str, values, flag: int) -> None:
    here = record[quantity].isna() & values.notna()
    record.loc[here, quantity] = values[here]
    flags.loc[here, quantity] = flag


def _first_gap(table, record, row_of, choice, quantity, empty, interval: int) -> str:
    k = int(np.argmax(empty))
    time, count = record.index[k], int(empty.sum())
    asks = f"({count} of {len(empty)} in all); gaps='fill' fills gaps and flags them"
    row = row_of.iloc[k]
    if np.isnan(row):
        known = row_of.iloc[:k].dropna()
        after = f" after {table.where(int(known.iloc[-1]))}" if len(known) else ""
        return f"{table.name}: no row for {_moment(time, interval)}{after} {asks}"
    return f"{table.where(int(row))} ({_moment(time, interval)}): {_name(choice, quantity)} is missing {asks}"


def _name(choice: Choice, quantity: str) -> str:
    column = choice.columns.get(quantity)
    return column.name if column else "wind"


def _add_longwave(record, flags, latitude_deg: float) -> None:
    """Compute the longwave that is missing, in place."""
    lacking = record[record["longwave"].isna() & record["air_temperature"].notna() & record["humidity"].notna()]
    if lacking.empty:
        return
    dates = record.index.normalize()
    mean = record["shortwave"].groupby(dates).mean()
    cloud = pd.Series(cloud_cover(pd.DatetimeIndex(mean.index), mean.to_numpy(), latitude_deg), index=mean.index)
    air = lacking["air_temperature"].to_numpy()
    vapour = lacking["humidity"].to_numpy() * saturation(air)
    values = longwave(air, vapour, cloud.reindex(lacking.index.normalize()).to_numpy())
    _put(record, flags, "longwave", pd.Series(values, index=lacking.index).reindex(record.index), COMPUTED)


def _in_half_hours(record, flags, choice: Choice, latitude_deg: float, cycle: DiurnalCycle):
    """Half-hours of days, and each one's flags, those of its day."""
    daily = record[list(OURS)].rename(columns=OURS)
    humidity, saturated = daily.pop("relative_humidity"), saturation(record["air_temperature"].to_numpy())
    if choice.columns["humidity"].kind == "deficit":
        daily["vapour_pressure_deficit_hpa"] = (1.0 - humidity) * saturated
    else:
        daily["vapour_pressure_hpa"] = humidity * saturated
    forcing = half_hours(daily, latitude_deg, cycle)
    each = flags[list(OURS)].reindex(forcing.index.normalize())
    return forcing, each.set_axis(forcing.index)


def _sources(forcing: pd.DataFrame, choice: Choice) -> list[str]:
    lines = []
    for quantity, name in OURS.items():
        column = choice.columns.get(quantity)
        of = f"{column.name} [{column.unit}]" if column else "eastward and northward wind"
        if quantity == "longwave" and column is None:
            of = "computed (Prata 1996; Crawford and Duchon 1999)"
        shares = forcing[f"{name}_flag"].value_counts(normalize=True).sort_index()
        flagged = [f"{percent(share)} {FLAGS[flag]}" for flag, share in shares.items() if flag != GIVEN]
        if quantity == "longwave" and column is None:
            flagged = []
        lines.append(f"{name}: {of}" + "".join(f"; {each}" for each in flagged))
    return lines
