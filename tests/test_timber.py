"""Timber: logs by diameter, the price table and net revenue by hand, the net present value, what is refused."""

import csv
import gzip
import math

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from playing import QUICK, play, quick

import boreal_env
import sim
from sim.assortment import standing_wood, thicker_share
from sim.demography import AGES
from sim.jit import uncompiled
from sim.task.timber import DISCOUNT_RATE, ITEMS, TIMBER_SCALE, Timber, read_prices, shipped_rows

PRICES = {
    "sawlog_conifer": 70.0,
    "sawlog_deciduous": 50.0,
    "pulpwood_conifer": 30.0,
    "pulpwood_deciduous": 20.0,
    "energy_wood": 10.0,
    "harvesting": 12.0,
    "planting": 0.5,
    "roads": 1.0,
}
MATURE = {"density_stems_ha": (900.0, 900.0), "biomass_kgc_m2": (8.0, 8.0), "oldest_age_years": (110.0, 110.0)}


def test_a_cone_is_sorted_by_its_diameter():
    """A stem of 20 cm: thicker than 15 cm over a quarter of its length, 1 - 0.75^3 of its volume."""
    assert uncompiled(thicker_share)(20.0, 15.0) == pytest.approx(1.0 - 0.75**3)
    stems, sizes = np.zeros((AGES, 1)), np.ones((AGES, 1))
    stems[50] = 100.0
    unit = (20.0 / 3.83) ** 2.5  # kgC of a tree of 20 cm
    wood = uncompiled(standing_wood)(stems, sizes, 0, unit, 0.8, 3.83, 2.5, 15.0, 7.0)
    whole = 100.0 * 0.8 * unit / 1e4
    shares = (1.0 - 0.75**3, 0.75**3 - 0.35**3, 0.35**3)
    np.testing.assert_allclose(wood, np.multiply(whole, shares), rtol=1e-12)
    assert unit == pytest.approx(60.0, rel=0.05)  # Lambert et al. 2005: 60 kgC are 19.7 cm
    thin = uncompiled(standing_wood)(stems, sizes, 0, (6.0 / 3.83) ** 2.5, 0.8, 3.83, 2.5, 15.0, 7.0)
    assert thin[:2] == (0.0, 0.0) and thin[2] > 0.0


def test_logs_of_a_thinning_by_hand():
    """Stems of 20 cm, all of the oldest age: 50 of each species are cut, and sawn to tops of 15 and 18 cm."""
    stem = (20.0 / 3.83) ** 2.5
    initial = {"conifer_old_stems_ha": 500.0, "deciduous_old_stems_ha": 500.0, "biomass_kgc_m2": 1000.0 * stem / 1e4}
    year = sim.simulate(None, 2, years=1, time_step_minutes=120, initial=initial).iloc[0]
    assert year.thinned_stems_ha == 100.0
    for species, share, top in (("conifer", 0.80, 15.0), ("deciduous", 0.87, 18.0)):
        logs = [year[f"{species}_{product}_kgc_m2"] for product in ("sawlog", "pulpwood", "energy_wood")]
        sawn, kept = 1.0 - (top / 20.0) ** 3, 1.0 - (7.0 / 20.0) ** 3
        whole = 50.0 * share * stem / 1e4
        np.testing.assert_allclose(logs, np.multiply(whole, (sawn, kept - sawn, 1.0 - kept)), rtol=1e-9)


@pytest.fixture(scope="module")
def episode():
    """Thinned, thinned, planted, planted."""
    env = quick(
        objectives=("carbon", "thaw", "timber"),
        timber=PRICES,
        discount_rate=0.04,
        record_years=True,
        initial_ranges=MATURE,
        mechanisms={"fire": False},
    )
    return play(env, [2, 0, 22, 22], seed=3)


def test_what_is_sold_is_the_stems_of_what_is_cut(episode):
    y = episode[2]["years"]
    stems = [
        sum(y[f"{species}_{product}_kgc_m2"] for product in ("sawlog", "pulpwood", "energy_wood"))
        for species in ("conifer", "deciduous")
    ]
    of_species = [wood / share for wood, share in zip(stems, (0.80, 0.87), strict=True)]
    np.testing.assert_allclose(sum(of_species), y["harvest_kgc_m2"], rtol=1e-9, atol=1e-12)
    assert (y["harvest_kgc_m2"][:2] > 0.0).all() and (y["harvest_kgc_m2"][2:] == 0.0).all()
    volume = 10.0 * stems[0] / (0.51 * 0.40) + 10.0 * stems[1] / (0.48 * 0.43)
    np.testing.assert_allclose(y["timber_m3_ha"], volume, rtol=1e-12)


def test_net_revenue_and_its_present_value_by_hand(episode):
    _, rewards, info = episode
    y = info["years"]
    assert (y["planted_stems_ha"][2:] > 0.0).all()
    conifer, deciduous = 10.0 / (0.51 * 0.40), 10.0 / (0.48 * 0.43)
    net = -0.5 * y["planted_stems_ha"]
    for product, prices in {"sawlog": (70.0, 50.0), "pulpwood": (30.0, 20.0), "energy_wood": (10.0, 10.0)}.items():
        net = net + (prices[0] - 13.0) * conifer * y[f"conifer_{product}_kgc_m2"]
        net = net + (prices[1] - 13.0) * deciduous * y[f"deciduous_{product}_kgc_m2"]
    np.testing.assert_allclose(y["net_revenue_eur_ha"], net, rtol=1e-12)
    assert net[0] > 0.0 > net[2]
    discounted = net / 1.04 ** np.arange(4)
    assert info["net_present_value_eur_ha"] == pytest.approx(discounted.sum())
    np.testing.assert_allclose(rewards[:, 2], discounted / TIMBER_SCALE, rtol=1e-6)
    assert info["timber_return"] * TIMBER_SCALE == pytest.approx(info["net_present_value_eur_ha"], rel=1e-6)
    assert (y["timber_clipped"] == 0.0).all()


def test_the_table_in_euros_over_bark_by_hand():
    """Finnish prices as printed; a Swedish m3 under bark is 0.88 of one over bark."""
    assert read_prices("finland")["sawlog_conifer"] == pytest.approx((74.8 + 70.7) / 2.0, abs=0.06)
    sweden = read_prices("sweden")
    assert sweden["sawlog_conifer"] == pytest.approx(506.0 * 0.88 / 10.63)
    assert sweden["planting"] == pytest.approx(5455.0 / 2200.0 / 10.63, rel=1e-3)
    canada = read_prices("canada")
    dues = canada["sawlog_conifer"] - canada["harvesting"] - canada["roads"]
    assert dues == pytest.approx(12.32 * 0.88 / 1.4855)  # what Quebec asks for its trees
    royalty = canada["pulpwood_conifer"] - canada["harvesting"] - canada["roads"]
    assert royalty == pytest.approx(7.59 * 0.88 / 1.4855)  # what New Brunswick asked
    assert read_prices("finland")["harvesting"] == 0.0  # sold standing


def test_every_row_of_the_table_says_where_it_is_from():
    rows = shipped_rows()
    assert {row["country"] for row in rows} == {"finland", "sweden", "canada"} and len(rows) == 3 * len(ITEMS)
    for row in rows:
        assert row["source"] and 2000 < int(row["year"]) < 2030
        assert (row["currency"] == "EUR") == (float(row["per_eur"]) == 1.0)


def test_a_table_of_ones_own(tmp_path):
    path = tmp_path / "prices.csv"
    rows = [row for row in shipped_rows() if row["country"] == "sweden"]

    def write(rows):
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)

    write(rows)
    assert read_prices(str(path)) == read_prices("sweden")
    write(rows[1:])
    with pytest.raises(ValueError, match="sawlog_conifer missing; all of"):
        read_prices(path)
    text = path.read_text()
    for change, message in (
        (lambda text: text.replace("value", "value,value", 1), "line 1: column value is there twice"),
        (lambda text: text.rstrip() + ",8\n", "it has more fields than line 1 has names"),
    ):
        path.write_text(change(text))
        with pytest.raises(ValueError, match=message):
            read_prices(path)
    path.write_bytes(gzip.compress(text.encode()))
    with pytest.raises(ValueError, match="prices.csv': a table as text is allowed, and it is packed"):
        read_prices(path)
    write([*rows, rows[0]])
    with pytest.raises(ValueError, match="sawlog_conifer comes twice"):
        read_prices(path)
    for column, value, message in (
        ("value", "", "line 2: sawlog_conifer has the value ''; a number"),
        ("value", "-3", "line 2: sawlog_conifer has the value -3; a finite number, not negative"),
        ("value", "nan", "sawlog_conifer has the value nan"),
        ("unit", "cord", "sawlog_conifer has the unit 'cord'; allowed: m3, m3 under bark$"),
        ("unit", "seedling", "line 2: sawlog_conifer has the unit 'seedling'; allowed: m3, m3 under bark$"),
        ("per_eur", "9", "line 3: per_eur is 10.63 for SEK of 2022, and 9 above; one rate is allowed"),
        ("per_eur", "0", "sawlog_conifer has the per_eur 0; a positive number"),
        ("year", "", "line 2: sawlog_conifer has the year ''; one such as 2023 is allowed"),
        ("currency", "", "line 2: sawlog_conifer has the currency ''; one such as EUR is allowed"),
        ("currency", "EUR", "line 2: sawlog_conifer is in EUR and has the per_eur 10.63; 1 is allowed"),
        ("item", "sawlogs", "unknown item 'sawlogs'; allowed are sawlog_conifer"),
    ):
        write([{**rows[0], column: value}, *rows[1:]])
        with pytest.raises(ValueError, match=message):
            read_prices(path)
    write([{**row, "unit": "m3"} for row in rows])
    with pytest.raises(ValueError, match="line 8: planting has the unit 'm3'; allowed: seedling"):
        read_prices(path)
    write([rows[0], dict.fromkeys(rows[0], ""), *rows[1:]])
    assert read_prices(path) == read_prices("sweden")
    text = path.read_text()
    path.write_text(text.replace(",", ";"))
    with pytest.raises(ValueError, match="line 1: column item is missing; item, value, .* separated by commas"):
        read_prices(path)
    path.write_bytes(text.replace("Vägkostnaderna", "V\xe4g").encode("latin-1"))
    with pytest.raises(ValueError, match="prices.csv', line 10: byte 0xe4 is not UTF-8"):
        read_prices(path)


REFUSED = {
    "country": ({"timber": "norway"}, "timber 'norway': allowed are finland, sweden, canada, a path to a .csv"),
    "a table": (
        {"timber": pd.DataFrame({"item": ["roads"]})},
        "timber of type DataFrame: allowed are finland, sweden, canada",
    ),
    "file": ({"timber": "none.csv"}, "timber 'none.csv': cannot be read"),
    "gap": ({"timber": {"roads": 1.0}}, "timber: sawlog_conifer, .* missing"),
    "negative": ({"timber": {**PRICES, "roads": -1.0}}, "timber: roads = -1.0; a finite number, not negative"),
    "infinite": ({"timber": {**PRICES, "roads": math.inf}}, "timber: roads = inf"),
    "name": ({"timber": {**PRICES, "road": 1.0}}, "timber: unknown item 'road'"),
    "no prices": ({"objectives": ("timber",)}, "objective 'timber' needs prices: timber=, such as finland"),
    "discount": ({"timber": "finland", "discount_rate": -0.1}, r"discount_rate: a number in \[0, 0.2\]"),
    "discount without prices": ({"discount_rate": 0.05}, "discount_rate = 0.05: it needs prices, timber=, such as fin"),
}


@pytest.mark.parametrize("arguments, message", REFUSED.values(), ids=REFUSED)
def test_bad_prices_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message) as error:
        boreal_env.BorealEnv(**QUICK, **arguments)
    assert "\n" not in str(error.value)


def test_prices_add_columns_and_leave_the_rest_as_it_is():
    _, plain, without = play(quick(record_years=True), [2, 12, 22, 4], seed=5)
    _, priced, with_prices = play(quick(record_years=True, timber="canada"), [2, 12, 22, 4], seed=5)
    np.testing.assert_array_equal(plain, priced)
    assert set(with_prices["years"]) - set(without["years"]) == {
        "timber_m3_ha",
        "net_revenue_eur_ha",
        "discounted_revenue_eur_ha",
    }
    assert set(with_prices) - set(without) == {"net_present_value_eur_ha"}


@pytest.mark.parametrize(
    "env_id, more", [("boreal-timber-v0", ("timber",)), ("boreal-four-v0", ("timber", "biodiversity"))]
)
def test_the_ids_are_the_balanced_task_with_more_objectives(env_id, more):
    env = gym.make(env_id, **QUICK).unwrapped
    assert env.objective_names == ("carbon", "thaw", *more)
    balanced = gym.make("boreal-balanced-v0", **QUICK).unwrapped
    assert env.observation_space.shape == (105 + len(more),) and balanced.observation_space.shape == (105,)
    assert set(balanced.observation_names[1:]) < set(env.observation_names)
    weights = np.full(2 + len(more), 1.0 / (2 + len(more)))
    _, rewards, info = play(env, [2, 12, 22, 4], seed=4, options={"preference": weights})
    _, two, _ = play(balanced, [2, 12, 22, 4], seed=4, options={"preference": 0.5})
    assert rewards.shape == (4, 2 + len(more)) and (np.abs(rewards) <= 1.0).all()
    assert np.isfinite(info["net_present_value_eur_ha"]) and rewards[0, 2] > 0.0 > rewards[2, 2]
    np.testing.assert_array_equal(rewards[:, :2], two)
    together = env.lockstep(2)
    assert together.reset(seed=1)[0].shape == (2, 105 + len(more)) and together.reward_dim == 2 + len(more)


def test_a_planted_seedling_costs_its_price():
    record = {name: np.zeros(1) for name in sim.RECORD_NAMES} | {"planted_stems_ha": np.array([100.0])}
    columns = Timber(PRICES, 0.0).columns(record, np.array([7]))
    assert columns["net_revenue_eur_ha"] == columns["discounted_revenue_eur_ha"] == -50.0


def test_the_scale_of_timber_and_its_discount_are_those_that_results_have():
    assert (TIMBER_SCALE, DISCOUNT_RATE) == (3000.0, 0.03)
