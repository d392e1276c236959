"""What a stand earns: wood sold by product, less harvesting, roads and planting, discounted to the episode's start.

Prices and costs are those of `sim/timber_prices.csv` (country, item, value, currency, unit, year, currency per EUR,
source), or a user's own.
"""

import csv
from importlib.resources import files
from numbers import Real
from pathlib import Path

import numpy as np

from sim.assortment import PRODUCTS
from sim.io.table import check_utf8
from sim.parameters import brief

SPECIES = ("conifer", "deciduous")

#: Prices of wood and costs, EUR per m3 over bark; planting, EUR per seedling.
ITEMS = (
    *(f"{product}_{species}" for product in PRODUCTS[:2] for species in SPECIES),
    "energy_wood",
    "harvesting",
    "planting",
    "roads",
)

SEEDLING = "seedling"  # planting alone is by it
#: m3 under bark in a m3 over bark: bark is an eighth of a stem (Lambert et al. 2005: 12 % of a spruce of 20 cm).
UNITS = {"m3": 1.0, "m3 under bark": 0.88, SEEDLING: 1.0}
READ = ("item", "value", "currency", "unit", "year", "per_eur")  # columns of a table of prices that are read

#: Stem volume of carbon [m3 ha-1 per kgC m-2], from carbon fraction (IPCC 2006, boreal: 0.51 conifers, 0.48 broadleaf)
#: and basic density [t m-3] (IPCC 2006: spruce 0.40; 0.43, between birch 0.51 and aspen 0.35).
VOLUME = {"conifer": 10.0 / (0.51 * 0.40), "deciduous": 10.0 / (0.48 * 0.43)}

#: Discounted net revenue of a year [EUR ha-1] that "timber" counts in. At Finnish prices, the best, plans that cut as
#: much as they may earned up to 2600 in a year on 32 sampled sites; planting costs up to 34. Measured by
#: `analysis/studies/objective_scales.py`.
TIMBER_SCALE = 3000.0

#: Of a year, where none is given.
DISCOUNT_RATE = 0.03

#: Columns that an environment with prices adds to the annual record: name -> (unit, meaning).
TIMBER_COLUMNS = {
    "timber_m3_ha": ("m3 ha-1", "timber cut, over bark"),
    "net_revenue_eur_ha": ("EUR ha-1", "timber sold less harvesting, roads and planting"),
    "discounted_revenue_eur_ha": ("EUR ha-1", "the same, worth so much at the episode's start"),
}


class Timber:
    """Prices and a discount rate. timber : a country of the table, a path to a .csv of one country with the same
    columns, or a dict of `ITEMS` in EUR; discount_rate : a year's, or None. Raises ValueError naming what is wrong."""

    def __init__(self, timber, discount_rate):
        self.discount_rate = DISCOUNT_RATE if discount_rate is None else check_discount_rate(discount_rate)
        self.prices = read_prices(timber)

    def columns(self, record: dict[str, np.ndarray], year) -> dict[str, np.ndarray]:
        """`TIMBER_COLUMNS` of a year, each shape (n,). year : years since the episode's start, (n,), for stands are cut
        and planted on a year's first day."""
        cut, sold = np.zeros(len(year)), np.zeros(len(year))
        for species in SPECIES:
            for product in PRODUCTS:
                volume = VOLUME[species] * record[f"{species}_{product}_kgc_m2"]
                cut = cut + volume
                sold = sold + self.price(species, product) * volume
        costs = (self.prices["harvesting"] + self.prices["roads"]) * cut
        net = sold - costs - self.prices["planting"] * record["planted_stems_ha"]
        return dict(zip(TIMBER_COLUMNS, (cut, net, net / (1.0 + self.discount_rate) ** year), strict=True))

    def price(self, species: str, product: str) -> float:
        """EUR per m3 over bark; energy wood has one price for both species."""
        return self.prices.get(f"{product}_{species}", self.prices["energy_wood"])


def timber_reward(year: dict[str, np.ndarray]) -> np.ndarray:
    """Discounted net revenue of the year over `TIMBER_SCALE`, so that the return is the net present value over it."""
    return year["discounted_revenue_eur_ha"] / TIMBER_SCALE


def check_discount_rate(rate) -> float:
    """A year's discount rate, 0.03 for 3 %."""
    number = isinstance(rate, Real) and not isinstance(rate, (bool, np.bool_))
    if not number or not 0.0 <= rate <= 0.2:
        raise ValueError(f"discount_rate: a number in [0, 0.2] is allowed, got {rate!r}")
    return float(rate)


def shipped_rows() -> list[dict]:
    """Rows of the table that comes with the simulator."""
    return list(csv.DictReader((files("sim") / "timber_prices.csv").read_text(encoding="utf-8").splitlines()))


def countries() -> list[str]:
    """Countries of the table."""
    return list(dict.fromkeys(row["country"] for row in shipped_rows()))


def read_prices(timber) -> dict[str, float]:
    """Prices and costs by `ITEMS`, in EUR per m3 over bark or per seedling; see `Timber`."""
    if isinstance(timber, dict):
        return check_prices("timber", timber)
    if isinstance(timber, str) and timber in countries():
        return prices_of(f"timber {timber!r}", [row for row in shipped_rows() if row["country"] == timber])
    if isinstance(timber, (str, Path)) and str(timber).endswith(".csv"):
        return prices_of(f"timber {str(timber)!r}", rows_of(Path(timber)))
    raise ValueError(
        f"timber {brief(timber)}: allowed are {', '.join(countries())}, a path to a .csv, a dict of {', '.join(ITEMS)}"
    )


def rows_of(path: Path) -> list[dict]:
    """Rows of a table of one's own, each with the `line` that it ends on; those without a text are left out."""
    what = f"timber {str(path)!r}"
    try:
        check_utf8(what, path)
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:  # packed
        raise ValueError(f"{what}: a table as text is allowed, and it is packed") from None
    except OSError as error:
        raise ValueError(f"{what}: cannot be read ({error.strerror})") from None
    reader = csv.DictReader(text.splitlines(keepends=True))
    names = list(reader.fieldnames or ())
    for name in READ:
        if names.count(name) > 1:
            raise ValueError(f"{what}, line 1: column {name} is there twice")
    missing = [name for name in READ if name not in names]
    if missing:
        raise ValueError(
            f"{what}, line 1: column {missing[0]} is missing; {', '.join(READ)} are needed, separated by commas"
        )
    rows = [{**row, "line": reader.line_num} for row in reader]
    for row in rows:
        if None in row:  # more fields than names: of a decimal comma
            raise ValueError(f"{what}, line {row['line']}: it has more fields than line 1 has names")
    return [row for row in rows if any(row[name] for name in READ)]


def prices_of(what: str, rows: list[dict]) -> dict[str, float]:
    """Checked prices of a table's rows."""
    prices: dict[str, float] = {}
    rates: dict[tuple, str] = {}
    for row in rows:
        where, item = f"{what}, line {row['line']}" if "line" in row else what, row["item"]
        if item not in ITEMS:
            raise ValueError(f"{where}: unknown item {item!r}; allowed are {', '.join(ITEMS)}")
        if item in prices:
            raise ValueError(f"{where}: {item} comes twice; each item once, of one country, is allowed")
        for name, is_right, example in (("currency", str.isalpha, "EUR"), ("year", str.isdigit, "2023")):
            if not is_right(row[name] or ""):
                raise ValueError(f"{where}: {item} has the {name} {row[name]!r}; one such as {example} is allowed")
        prices[item] = in_eur(where, row)
        money = row["currency"], row["year"]
        if rates.setdefault(money, row["per_eur"]) != row["per_eur"]:
            raise ValueError(
                f"{where}: per_eur is {row['per_eur']} for {' of '.join(money)}, and {rates[money]} above; one rate is "
                "allowed"
            )
    return check_prices(what, prices)


def in_eur(where: str, row: dict) -> float:
    """A row's value in EUR per m3 over bark, or per seedling."""
    item, unit = row["item"], row["unit"]
    units = [name for name in UNITS if (name == SEEDLING) == (item == "planting")]
    if unit not in units:
        raise ValueError(f"{where}: {item} has the unit {unit!r}; allowed: {', '.join(units)}")
    numbers = {}
    for name in ("value", "per_eur"):
        try:
            numbers[name] = float(row[name] or "")
        except ValueError:
            raise ValueError(f"{where}: {item} has the {name} {row[name]!r}; a number is allowed") from None
    if not 0.0 <= numbers["value"] < np.inf:
        raise ValueError(f"{where}: {item} has the value {row['value']}; a finite number, not negative, is allowed")
    if not 0.0 < numbers["per_eur"] < np.inf:
        raise ValueError(f"{where}: {item} has the per_eur {row['per_eur']}; a positive number is allowed")
    if row["currency"].upper() == "EUR" and numbers["per_eur"] != 1.0:
        raise ValueError(f"{where}: {item} is in EUR and has the per_eur {row['per_eur']}; 1 is allowed")
    return numbers["value"] * UNITS[unit] / numbers["per_eur"]


def check_prices(what: str, prices: dict) -> dict[str, float]:
    """All `ITEMS`, none negative."""
    for item, value in prices.items():
        if item not in ITEMS:
            raise ValueError(f"{what}: unknown item {item!r}; allowed are {', '.join(ITEMS)}")
        number = isinstance(value, Real) and not isinstance(value, (bool, np.bool_))
        if not number or not np.isfinite(value) or value < 0.0:
            raise ValueError(f"{what}: {item} = {value!r}; a finite number, not negative, is allowed")
    missing = [item for item in ITEMS if item not in prices]
    if missing:
        raise ValueError(f"{what}: {', '.join(missing)} missing; all of {', '.join(ITEMS)} are needed")
    return {item: float(prices[item]) for item in ITEMS}
