"""What enters a stand leaves it or stays: carbon, water, heat and stems, in random and extreme stand-years.

The kernel's own residuals are read, and every budget is added up again from the annual record, the daily output and
the state, without the kernel's help.
"""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import sim
from sim.closure import TOLERANCES
from sim.demography import AGES
from sim.physical_constants import ICE_HEAT_CAPACITY, LATENT_HEAT_FUSION, LATENT_HEAT_VAPORISATION
from sim.spin_up import INITIAL_LIMITS
from sim.state import CARBON_BUDGETS, DAILY_NAMES, STATE_NAMES
from sim.task.episodes import BALANCED_WORLD

# Name -> (limits of the parameters, corners or even draws, time step in minutes, stands).
CASES = {
    "sampled-10min": ("sampled", "even", 10, 16),
    "sampled-30min": ("sampled", "even", 30, 48),
    "balanced-30min": ("sampled", "even", 30, 48),
    "sampled-corners-30min": ("sampled", "corners", 30, 48),
    "sampled-corners-120min": ("sampled", "corners", 120, 64),
    "physical-60min": ("physical", "even", 60, 64),
    "physical-corners-10min": ("physical", "corners", 10, 16),
    "physical-corners-30min": ("physical", "corners", 30, 64),
    "physical-corners-120min": ("physical", "corners", 120, 96),
}
YEARS = 3
HEAVY_STORES = (
    "conifer_biomass",
    "deciduous_biomass",
    "soil_carbon",
    "conifer_deadwood",
    "deciduous_deadwood",
    "products",
)
WATER_STORES = ("swe", "canopy_snow", "canopy_rain", "organic_water", "soil_water")
NEVER_NEGATIVE = (*HEAVY_STORES, *WATER_STORES, "organic_depth", "trunk_capacity", "drought", "albedo")
OFTEN_STRUCK = {"fire_base_probability": 0.05, "fire_drought_threshold": 5.0, "insect_base_probability": 1.0}
MAY_BE_NAN = {"summer_albedo", "winter_albedo"}  # where no light arrives in the season


def draw_site(generator, limits, how):
    site = {}
    for name, p in sim.SITE_PARAMETERS.items():
        low, high = (p.low, p.high) if limits == "sampled" else (p.physical_low, p.physical_high)
        site[name] = float(generator.choice([low, high]) if how == "corners" else generator.uniform(low, high))
    return site


def store(state, names):
    return sum(state[:, STATE_NAMES.index(name)] for name in names)


@pytest.fixture(scope="module", params=CASES, ids=str)
def run(request):
    """Years of random actions: per year the record, the daily output, and the state before and after."""
    limits, how, minutes, number = CASES[request.param]
    generator = np.random.default_rng(20260101)
    sites = [draw_site(generator, limits, how) for _ in range(number)]
    for site in sites[1::3]:
        site.update(OFTEN_STRUCK)
    # Every third stand starts from a corner of the physical limits of its first stocks.
    initial = {
        k: {name: float(generator.choice(pair)) for name, pair in INITIAL_LIMITS.items()} for k in range(0, number, 3)
    }
    world = BALANCED_WORLD if request.param.startswith("balanced") else {}
    half_life = 20 if how == "corners" else None
    stands = sim.Stands(number, time_step_minutes=minutes, hwp_half_life_years=half_life, **world)
    stands.start(np.arange(number), sites, [sim.episode_seeds(k) for k in range(number)], initial)
    years = []
    for _ in range(YEARS):
        before = stands.state.copy()
        record, daily = stands.step(generator.integers(0, 25, number), daily=True)
        record = pd.DataFrame(record, columns=sim.RECORD_NAMES)
        daily = SimpleNamespace(**{name: daily[:, :, i] for i, name in enumerate(DAILY_NAMES)})
        capacity = np.array([site["max_water_content_mm"] for site in sites])
        after = stands.state.copy()
        years.append(SimpleNamespace(before=before, after=after, record=record, daily=daily, capacity=capacity))
    return years


def test_every_step_closes(run):
    for year in run:
        r = year.record
        assert r.energy_residual_w_m2.max() <= 1e-6
        assert r.canopy_residual_w_m2.max() <= 1e-6
        assert r.water_residual_mm.max() <= 1e-9
        assert r.carbon_residual_kgc_m2.max() <= 1e-12
        assert (r.stems_residual_ha <= 1e-12 * (1.0 + r.density_stems_ha + r.density_after_action)).all()


def test_no_value_is_missing(run):
    for year in run:
        missing = year.record.isna().any()
        assert set(missing[missing].index) <= MAY_BE_NAN
        assert np.isfinite(year.record.drop(columns=list(MAY_BE_NAN)).to_numpy()).all()
        assert np.isfinite(year.after).all()
        for name, values in vars(year.daily).items():
            assert name == "albedo" or np.isfinite(values).all(), name


def test_no_stock_is_negative(run):
    for year in run:
        for name in NEVER_NEGATIVE:
            assert year.after[:, STATE_NAMES.index(name)].min() >= 0.0, name
        assert year.after[:, len(STATE_NAMES) :].min() >= 0.0
        for name in (
            "swe_mm",
            "canopy_snow_mm",
            "soil_water_mm",
            "organic_water_mm",
            "snow_depth_m",
            "runoff_mm",
            "lai",
            "organic_layer_m",
            "gpp_kgc_m2",
            "autotrophic_respiration_kgc_m2",
            "heterotrophic_respiration_kgc_m2",
            "precipitation_mm",
        ):
            assert getattr(year.daily, name).min() >= 0.0, name


def test_carbon_of_the_year(run):
    for year in run:
        r = year.record
        crossed = (
            r.gpp_kgc_m2
            - r.autotrophic_respiration_kgc_m2
            - r.heterotrophic_respiration_kgc_m2
            - r.fire_loss_kgc_m2
            - r.harvest_emission_kgc_m2
            - r.hwp_decay_kgc_m2
        )
        change = store(year.after, HEAVY_STORES) - store(year.before, HEAVY_STORES)
        np.testing.assert_allclose(r.net_carbon_change_kgc_m2, crossed, rtol=0, atol=1e-10)
        np.testing.assert_allclose(change, crossed, rtol=0, atol=1e-10)


def test_carbon_of_each_stock(run):
    for year in run:
        r = year.record
        trees = store(year.after, HEAVY_STORES[:2]) - store(year.before, HEAVY_STORES[:2])
        soil = store(year.after, ["soil_carbon"]) - store(year.before, ["soil_carbon"])
        products = store(year.after, ["products"]) - store(year.before, ["products"])
        dead = r.mortality_kgc_m2 + r.fire_mortality_kgc_m2
        left = r.dead_litter_kgc_m2 + r.conifer_deadwood_input_kgc_m2 + r.deciduous_deadwood_input_kgc_m2
        np.testing.assert_allclose(dead, left, rtol=0, atol=1e-12)
        decayed = r.conifer_deadwood_decay_kgc_m2 + r.deciduous_deadwood_decay_kgc_m2
        burned_wood = r.conifer_deadwood_burned_kgc_m2 + r.deciduous_deadwood_burned_kgc_m2
        wood = store(year.after, HEAVY_STORES[3:5]) - store(year.before, HEAVY_STORES[3:5])
        np.testing.assert_allclose(wood, left - r.dead_litter_kgc_m2 - decayed - burned_wood, atol=1e-10)
        below = r.understorey_litter_kgc_m2  # all that the understorey gains
        grown = r.gpp_kgc_m2 - r.autotrophic_respiration_kgc_m2 - below
        burned_trees = grown - r.litterfall_kgc_m2 - dead - r.harvest_kgc_m2 - trees
        to_soil = r.litterfall_kgc_m2 + r.dead_litter_kgc_m2 + decayed + below
        burned_soil = to_soil - r.heterotrophic_respiration_kgc_m2 - soil
        np.testing.assert_allclose(burned_trees, r.burned_trees_kgc_m2, atol=1e-10)
        np.testing.assert_allclose(burned_soil, r.burned_soil_kgc_m2, atol=1e-10)
        burned = r.burned_trees_kgc_m2 + r.burned_soil_kgc_m2 + burned_wood
        np.testing.assert_allclose(burned, r.fire_loss_kgc_m2, rtol=0, atol=1e-12)
        assert (r.fire_loss_kgc_m2[r.fire_mortality == 0.0] == 0.0).all()
        np.testing.assert_allclose(products, r.hwp_stored_kgc_m2 - r.hwp_decay_kgc_m2, atol=1e-10)
        np.testing.assert_allclose(r.harvest_kgc_m2, r.hwp_stored_kgc_m2 + r.harvest_emission_kgc_m2, atol=1e-12)
        np.testing.assert_allclose(r.biomass_change_kgc_m2, trees, atol=1e-12)
        np.testing.assert_allclose(r.soil_change_kgc_m2, soil, atol=1e-12)
        np.testing.assert_allclose(r.biomass_kgc_m2, store(year.after, HEAVY_STORES[:2]), rtol=1e-15)
        np.testing.assert_array_equal(r.hwp_kgc_m2, store(year.after, ["products"]))


def test_some_stands_burn_and_some_are_cut(run):
    """Otherwise the budgets above would not have been put to the test."""
    records = pd.concat([year.record for year in run])
    assert (records.fire_mortality > 0.0).any()
    assert (records.thinned_stems_ha > 0.0).any() and (records.planted_stems_ha > 0.0).any()
    assert (records.runoff_mm > 0.0).any() and (records.sublimation_mm > 0.0).any()


def test_water_of_the_year(run):
    for year in run:
        r = year.record
        change = store(year.after, WATER_STORES) - store(year.before, WATER_STORES)
        crossed = r.precipitation_mm - r.evapotranspiration_mm - r.runoff_mm
        # A year's sums carry the round-off of their terms, which at the physical limits are many metres of rain.
        assert (np.abs(change - crossed) <= 1e-7 + 1e-11 * (r.precipitation_mm + r.evapotranspiration_mm)).all()
        assert (r.snowfall_mm <= r.precipitation_mm + 1e-9).all()
        assert (
            r.canopy_sublimation_mm <= r.snowfall_mm + year.before[:, STATE_NAMES.index("canopy_snow")] + 1e-9
        ).all()


def test_water_of_every_day(run):
    """What the day's budget leaves over is the rain held by the canopy: never negative, and at the end the state's."""
    for year in run:
        d = year.daily
        held = (d.precipitation_mm - d.evapotranspiration_mm - d.runoff_mm).cumsum(axis=1)
        held += store(year.before, WATER_STORES)[:, None] - d.swe_mm - d.canopy_snow_mm
        held -= d.organic_water_mm + d.soil_water_mm
        round_off = 1e-7 + 1e-11 * (d.precipitation_mm + d.evapotranspiration_mm).sum(axis=1)
        assert (held >= -round_off[:, None]).all()
        assert (np.abs(held[:, -1] - store(year.after, ["canopy_rain"])) <= round_off).all()
        # Rain held: at most 0.2 mm (the constant) on each m2 of leaves and wood, of which there are 15.8 at most.
        assert held.max() <= 0.2 * 15.8 + 1e-6


def test_soil_water_stays_within_its_bucket(run):
    for year in run:
        assert (year.daily.soil_water_mm <= year.capacity[:, None] * (1.0 + 1e-12)).all()


def test_latent_heat_is_paid_for_in_water(run):
    for year in run:
        r = year.record
        heat = LATENT_HEAT_VAPORISATION * r.evapotranspiration_mm + LATENT_HEAT_FUSION * r.sublimation_mm
        np.testing.assert_allclose(r.latent_heat_mj_m2, 1e-6 * heat, rtol=1e-10, atol=1e-9)


def test_heat_of_the_deep_soil(run):
    """Its enthalpy changes by what it gained; what left it downward is the boundary's warming less its cooling."""
    deep = STATE_NAMES.index("deep_heat")
    for year in run:
        r = year.record
        change = 1e-6 * (year.after[:, deep] - year.before[:, deep])
        np.testing.assert_allclose(change, r.deep_heat_gain_mj_m2, rtol=1e-9, atol=1e-7)
        net = r.boundary_warming_mj_m2 - r.boundary_cooling_mj_m2
        np.testing.assert_allclose(year.daily.boundary_heat_mj_m2.sum(axis=1), net, rtol=1e-9, atol=1e-7)
        assert r.boundary_warming_mj_m2.min() >= 0.0 and r.boundary_cooling_mj_m2.min() >= 0.0


def test_heat_of_the_year(run):
    """What net radiation brings warms the air, evaporates water, melts snow, is stored as carbon, or stays."""
    skin, per_gram = (sim.CONSTANTS[name].low for name in ("skin_heat_capacity", "photosynthesis_energy"))

    def heat(state):
        trunks = store(state, ["trunk_capacity"]) * store(state, ["trunk"])
        ground = (skin + ICE_HEAT_CAPACITY * store(state, ["swe"])) * store(state, ["ground"])
        return trunks + ground + store(state, ["organic_heat", "surface_heat", "deep_heat"])

    for year in run:
        r = year.record
        snow = store(year.after, WATER_STORES[:2]) - store(year.before, WATER_STORES[:2])
        melted = r.snowfall_mm - r.sublimation_mm - snow
        down = r.boundary_warming_mj_m2 - r.boundary_cooling_mj_m2
        moved = r.advected_heat_mj_m2 + r.growth_heat_mj_m2
        gained = r.net_radiation_mj_m2 - r.sensible_heat_mj_m2 - r.latent_heat_mj_m2 - down + moved
        used = 1e-6 * (LATENT_HEAT_FUSION * melted + 1000.0 * per_gram * r.gpp_kgc_m2)
        change = 1e-6 * (heat(year.after) - heat(year.before))
        np.testing.assert_allclose(change, gained - used, rtol=0, atol=3.2e-5)  # 1e-6 W m-2 all the year


@pytest.mark.parametrize(
    "name",
    [
        "gpp_kgc_m2",
        "autotrophic_respiration_kgc_m2",
        "heterotrophic_respiration_kgc_m2",
        "precipitation_mm",
        "evapotranspiration_mm",
        "runoff_mm",
        "shortwave_mj_m2",
        "net_radiation_mj_m2",
        "sensible_heat_mj_m2",
        "latent_heat_mj_m2",
    ],
)
def test_days_add_up_to_the_year(run, name):
    for year in run:
        np.testing.assert_allclose(getattr(year.daily, name).sum(axis=1), year.record[name], rtol=1e-9, atol=1e-9)


def test_stems_by_class_add_up(run):
    for year in run:
        r = year.record
        conifers = r.filter(regex="^conifer_.*_stems_ha$")
        deciduous = r.filter(regex="^deciduous_.*_stems_ha$")
        assert conifers.shape[1] == deciduous.shape[1] == 5
        density = conifers.sum(axis=1) + deciduous.sum(axis=1)
        np.testing.assert_allclose(density, r.density_stems_ha, rtol=1e-12)
        np.testing.assert_allclose(
            conifers.sum(axis=1), r.conifer_fraction * r.density_stems_ha, rtol=1e-12, atol=1e-12
        )
        np.testing.assert_allclose(year.after[:, len(STATE_NAMES) :].sum(axis=1), density, rtol=1e-12)


def test_stems_of_planting_and_thinning(run):
    for year in run:
        r = year.record
        before = year.before[:, len(STATE_NAMES) :].sum(axis=1)
        after = before + r.planted_stems_ha - r.thinned_stems_ha
        np.testing.assert_allclose(r.density_after_action, after, rtol=1e-12, atol=1e-9)
        assert ((r.planted_stems_ha == 0.0) | (r.density_after_action <= 2000.0 + 1e-9)).all()
        assert ((r.thinned_stems_ha == 0.0) | (r.density_after_action >= 150.0 - 1e-9)).all()
        harvestable = year.before[:, len(STATE_NAMES) :].reshape(-1, 2, AGES)[:, :, 21:].sum(axis=(1, 2))
        np.testing.assert_allclose(r.harvestable_stems_ha, harvestable, rtol=1e-12)
        assert (r.thinned_stems_ha <= harvestable + 1e-9).all()


def test_fire_and_insects_take_shares_of_stems(run):
    for year in run:
        for name in ("fire_mortality", "insect_mortality"):
            assert year.record[name].between(0.0, 1.0).all()


def test_stems_of_the_year(run):
    """All that come and go are in the record: planted, cut, burned, dead of age, crowding or insects, come up."""
    for year in run:
        r = year.record
        left = (1.0 - r.fire_mortality) * r.density_after_action
        np.testing.assert_allclose(
            r.density_stems_ha, left - r.dead_stems_ha + r.recruited_stems_ha, rtol=1e-12, atol=1e-9
        )
        assert (r.dead_stems_ha <= left + 1e-9).all() and (r.recruited_stems_ha >= 0.0).all()


EVENTS = ("fire_mortality", "insect_mortality", "thinned_stems_ha", "planted_stems_ha", "hwp_decay_kgc_m2")


@pytest.fixture(scope="module")
def eventful_years():
    """A stand that burns, is infested, thinned and planted, and whose products decay."""
    site = {
        "fire_base_probability": 0.002,
        "insect_base_probability": 0.6,
        "mean_annual_temperature_c": 0.0,
        "density_dependent_mortality": 0.2,
    }
    actions = np.tile([24, 0, 4, 20, 12, 2], 5)
    initial = {"conifer_mature_stems_ha": 900.0, "deciduous_mature_stems_ha": 900.0, "biomass_kgc_m2": 8.0}
    return sim.simulate(site, actions, seed=5, years=30, time_step_minutes=120, initial=initial, hwp_half_life_years=20)


@pytest.mark.parametrize("stock", CARBON_BUDGETS)
def test_a_stock_closes_from_the_columns_of_the_table(eventful_years, stock):
    """What a user does with the table alone."""
    table = eventful_years
    assert (table[list(EVENTS)] > 0.0).any().all()
    gains, losses = (table[list(names)].sum(axis=1) for names in CARBON_BUDGETS[stock])
    changes = table[stock].diff()[1:]
    np.testing.assert_allclose(changes, (gains - losses)[1:], rtol=0, atol=1e-9)


def test_what_leaves_a_stock_arrives_in_another_or_leaves_the_stand(eventful_years):
    columns = {stock: (set(gains), set(losses)) for stock, (gains, losses) in CARBON_BUDGETS.items()}
    gained, lost = (set.union(*(each[k] for each in columns.values())) for k in range(2))
    wood = {f"{species}_deadwood_{{}}_kgc_m2" for species in ("conifer", "deciduous")}
    of_the_dead = {"dead_litter_kgc_m2", *(name.format("input") for name in wood)}
    assert gained - lost == {"gpp_kgc_m2", "hwp_stored_kgc_m2", *of_the_dead}  # from the air; of the harvest
    assert lost - gained == {
        "autotrophic_respiration_kgc_m2",
        "heterotrophic_respiration_kgc_m2",
        "burned_trees_kgc_m2",
        "burned_soil_kgc_m2",
        *(name.format("burned") for name in wood),
        "mortality_kgc_m2",  # to dead wood and soil
        "fire_mortality_kgc_m2",
        "harvest_kgc_m2",  # to products and air
        "hwp_decay_kgc_m2",
    }
    harvest = eventful_years.hwp_stored_kgc_m2 + eventful_years.harvest_emission_kgc_m2
    np.testing.assert_allclose(eventful_years.harvest_kgc_m2, harvest, rtol=0, atol=1e-12)
    dead = eventful_years.mortality_kgc_m2 + eventful_years.fire_mortality_kgc_m2
    np.testing.assert_allclose(dead, eventful_years[list(of_the_dead)].sum(axis=1), rtol=0, atol=1e-12)


def test_fire_moves_carbon_between_named_fluxes_only():
    """A stand that is certain to burn: its trees' carbon goes to air and soil, and nothing is lost."""
    site = {"fire_base_probability": 0.05, "fire_drought_threshold": 0.0, "summer_rain_prob": 0.0}
    table = sim.simulate(site, 12, seed=3, years=8, time_step_minutes=120, constants={"fire_temperature_c": 0.0})
    table = table.reset_index(drop=True)
    burnt = table[table.fire_mortality > 0.0]
    assert len(burnt) > 0
    assert (burnt.fire_loss_kgc_m2 > 0.0).all() and (burnt.fire_mortality_kgc_m2 > 0.0).all()
    assert burnt.fire_mortality.between(0.65, 1.0).all()
    previous = table.organic_layer_m.shift()
    growth = sim.CONSTANTS["organic_growth_m_yr"].low
    assert (table.organic_layer_m < 0.7 * previous + growth)[burnt.index[burnt.index > 0]].all()
    crossed = (
        table.gpp_kgc_m2
        - table.autotrophic_respiration_kgc_m2
        - table.heterotrophic_respiration_kgc_m2
        - table.fire_loss_kgc_m2
    )
    np.testing.assert_allclose(table.net_carbon_change_kgc_m2, crossed, atol=1e-10)


def test_no_more_soil_burns_than_is_there():
    """A thick layer of moss on poor soil: the fire takes half of the layer's depth, and half of the soil's carbon."""
    site = {"fire_base_probability": 0.05, "fire_drought_threshold": 0.0, "summer_rain_prob": 0.0}
    certain = {f"flammability_{cover}": 20.0 for cover in ("conifer", "deciduous", "open")}
    half = {"fire_organic_low": 0.5, "fire_organic_high": 0.51}
    initial = {"organic_layer_m": 2.0, "soil_kgc_m2": 2.0}
    table = sim.simulate(
        site, 12, seed=3, years=1, time_step_minutes=120, initial=initial, constants={**certain, **half}
    )
    assert table.fire_mortality.iloc[0] > 0.0
    assert table.burned_soil_kgc_m2.iloc[0] == pytest.approx(0.5 * 2.0, rel=0.05)
    assert table.soil_kgc_m2.iloc[0] > 0.0


def test_insects_kill_the_share_they_are_given():
    site = {"insect_base_probability": 1.0, "insect_mortality_rate": 0.4, "mean_annual_temperature_c": 5.0}
    initial = {"density_stems_ha": 1500.0, "conifer_fraction": 1.0}
    table = sim.simulate(site, 12, seed=1, years=1, time_step_minutes=120, initial=initial)
    assert table.insect_mortality.iloc[0] == pytest.approx(0.4)


def test_insects_kill_fewer_deciduous_trees():
    """A quarter as many as of the conifers: of a stand that is half and half, 0.4 and 0.1 of the halves."""
    site = {"insect_base_probability": 1.0, "insect_mortality_rate": 0.4, "mean_annual_temperature_c": 5.0}
    initial = {"density_stems_ha": 1500.0, "conifer_fraction": 0.5}
    quiet = {"constants": {"insect_deciduous": 0.25}, "mechanisms": {"fire": False}}
    table = sim.simulate(site, 12, seed=1, years=1, time_step_minutes=120, initial=initial, **quiet)
    assert table.insect_mortality.iloc[0] == pytest.approx(0.25)


def test_snow_that_sublimates_away_within_a_step_does_not_heat_the_ground():
    """Rough ground in a strong wind takes the last snow within a step; the ground must not run away from the air."""
    stands = sim.Stands(32, time_step_minutes=120)
    site = sim.middle_site({"wind_speed_m_s": 15.0, "soil_roughness_m": 0.1})
    stands.start(np.arange(32), [site] * 32, [sim.episode_seeds(k) for k in range(32)])
    _, daily = stands.step(np.full(32, 12), daily=True)
    difference = (
        daily[:, :, DAILY_NAMES.index("ground_temperature_c")] - daily[:, :, DAILY_NAMES.index("air_temperature_c")]
    )
    assert np.abs(difference).max() < 15.0


def test_a_trace_of_snow_does_not_pump_heat_into_the_soil():
    """Sleet in a humid gale: the ground is held at 0 degC only as long as there is snow to melt."""
    site = {
        "relative_humidity": 1.0,
        "wind_speed_m_s": 15.0,
        "soil_roughness_m": 0.1,
        "shoulder_rain_prob": 1.0,
        "min_diurnal_amplitude_c": 5.0,
    }
    daily = sim.simulate(site, 12, seed=1, years=2, time_step_minutes=30, output="daily")
    assert daily.surface_soil_temperature_c.max() < daily.air_temperature_c.max() + 5.0
    assert daily.ground_temperature_c.max() < daily.air_temperature_c.max() + 15.0


@pytest.mark.parametrize("corner", ["physical_low", "physical_high"])
def test_all_parameters_at_one_limit(corner):
    site = {name: getattr(p, corner) for name, p in sim.SITE_PARAMETERS.items()}
    table = sim.simulate(site, 24, seed=2, years=5, time_step_minutes=60)
    assert np.isfinite(table.gpp_kgc_m2).all()
    assert table.surface_soil_temperature_c.between(-60.0, 60.0).all()


HARD_SITES = {
    "hot wet canopy in still air": (
        {
            "mean_annual_temperature_c": 10.0,
            "seasonal_amplitude_c": 35.0,
            "daily_noise_std_c": 10.0,
            "wind_speed_m_s": 0.3,
            "summer_rain_prob": 1.0,
            "canopy_roughness_m": 0.1,
        },
        [15, 4, 9],
        45,
    ),
    "cloudbursts in a dry gale": (
        {
            "mean_annual_temperature_c": 10.0,
            "seasonal_amplitude_c": 5.0,
            "diurnal_amplitude_c": 15.0,
            "relative_humidity": 0.2,
            "wind_speed_m_s": 15.0,
            "summer_rain_mm_day": 60.0,
            "summer_precip_temp_sensitivity": 0.2,
            "summer_precip_base_temp_c": 0.0,
            "rain_diurnal_sensitivity": 0.0,
            "soil_roughness_m": 0.1,
        },
        [2, 16, 2],
        7140,
    ),
    "dark canopy in still air": (
        {
            "diurnal_amplitude_c": 15.0,
            "peak_diurnal_hour": 0.0,
            "wind_speed_m_s": 0.3,
            "summer_precip_temp_sensitivity": 0.2,
            "summer_precip_base_temp_c": 0.0,
            "max_diurnal_reduction": 0.0,
            "canopy_roughness_m": 0.1,
            "albedo_conifer": 0.03,
            "albedo_deciduous": 0.05,
        },
        [13, 2, 21],
        21017,
    ),
    "tropical rain": (
        {
            "mean_annual_temperature_c": 10.0,
            "seasonal_amplitude_c": 35.0,
            "daily_noise_std_c": 10.0,
            "summer_rain_prob": 1.0,
            "summer_rain_mm_day": 60.0,
            "summer_precip_temp_sensitivity": 0.2,
            "summer_precip_base_temp_c": 0.0,
        },
        [12, 12, 12],
        1,
    ),
}


@pytest.mark.parametrize("minutes", [30, 120])
@pytest.mark.parametrize(("site", "actions", "seed"), HARD_SITES.values(), ids=HARD_SITES)
def test_sites_that_were_hard(site, actions, seed, minutes):
    """Corners of the physical limits where a balance once had no solution, or sums lost their digits."""
    table = sim.simulate(site, actions, seed=seed, years=3, time_step_minutes=minutes)
    assert table.energy_residual_w_m2.max() <= 1e-6
    assert table.water_residual_mm.max() <= 1e-9


@pytest.mark.parametrize("column", TOLERANCES)
def test_a_year_that_does_not_close_raises_with_what_is_needed_to_replay_it(monkeypatch, column):
    monkeypatch.setitem(TOLERANCES, column, -1.0)
    seeds = sim.episode_seeds(5)
    with pytest.raises(sim.PhysicsError) as failure:
        sim.simulate({"q10": 2.123}, 12, seed=5, years=1, time_step_minutes=240)
    message = str(failure.value)
    for term in (column, str(seeds.weather), "gpp_kgc_m2=", "q10=2.123"):
        assert term in message


# The trunks' capacity and the drought index of winter are computed anew, whatever they were.
@pytest.mark.parametrize("name", sorted({*STATE_NAMES, "conifer_stems"} - {"trunk_capacity", "drought"}))
def test_a_state_that_is_not_a_number_raises(name):
    stands = sim.Stands(1, time_step_minutes=240)
    stands.start([0], [sim.middle_site()], [sim.episode_seeds(1)])
    stands.state[0, STATE_NAMES.index(name) if name in STATE_NAMES else len(STATE_NAMES) + 30] = np.nan
    with pytest.raises(sim.PhysicsError):
        stands.step(np.array([12]))
