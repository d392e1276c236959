"""The scientist's door: the table, observed weather, overrides that change nothing else, refusals, magnitudes."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scripts import ROOT

import sim
from sim import spin_up, stands
from sim.demography import AGES
from sim.parameters import CONSTANTS, SITE_PARAMETERS, check_constants, check_mechanisms, mean_annual_temperature
from sim.simulate import HELD_STAND, check_forcing
from sim.state import DAILY, FORCING

QUICK = {"seed": 1, "years": 1, "time_step_minutes": 240}
SPECIES_AND_CLASSES = [
    f"{species}_{age}_stems_ha"
    for species in ("conifer", "deciduous")
    for age in ("seedling", "sapling", "young", "mature", "old")
]
CONTRACT = """
year density_stems_ha conifer_fraction biomass_kgc_m2 soil_kgc_m2 hwp_kgc_m2 gpp_kgc_m2
autotrophic_respiration_kgc_m2 heterotrophic_respiration_kgc_m2 litterfall_kgc_m2 mortality_kgc_m2 fire_loss_kgc_m2
harvest_kgc_m2 net_carbon_change_kgc_m2 precipitation_mm evapotranspiration_mm runoff_mm sublimation_mm peak_swe_mm
snow_off_doy snow_days latent_heat_mj_m2 ground_shortwave_mj_m2 air_temperature_c surface_soil_temperature_c
deep_soil_temperature_c active_layer_depth_m boundary_warming_mj_m2 boundary_cooling_mj_m2 growing_season_days max_lai
summer_albedo winter_albedo drought_index organic_layer_m fire_mortality insect_mortality energy_residual_w_m2
water_residual_mm carbon_residual_kgc_m2 stems_residual_ha
""".split()


def simulate(site=None, actions=12, **changes):
    """The table by its row, not by its dates."""
    return sim.simulate(site, actions, **{**QUICK, **changes}).reset_index(drop=True)


def observed(days=365, minutes=240, start="2019-01-01", **columns):
    """A plain cosine year in the columns of an observed forcing."""
    index = pd.date_range(start, periods=int(days * 1440 // minutes), freq=f"{minutes}min")
    day, hour = index.day_of_year.to_numpy(), index.hour.to_numpy()
    summer = np.cos(2.0 * np.pi * (day - 194) / 365.0)
    values = {
        "air_temperature_c": -3.0 + 17.0 * summer,
        "relative_humidity": 0.7,
        "wind_speed_m_s": 3.0,
        "shortwave_w_m2": np.maximum(np.sin(np.pi * (hour - 4.0) / 16.0), 0.0) * (180.0 + 160.0 * summer),
        "longwave_w_m2": 260.0 + 60.0 * summer,
        "precipitation_mm": 0.25,
    }
    table = pd.DataFrame({**values, **columns}, index=index)
    table.attrs["site"] = {"latitude_deg": 60.5, "mean_annual_temperature_c": -3.0, "seasonal_amplitude_c": 17.0}
    return table


# --------------------------------------------------------------------------------------------------- the table


def test_annual_record_has_the_contracts_columns():
    table = simulate(years=3)
    assert set(CONTRACT + SPECIES_AND_CLASSES) <= set(table.columns)
    assert table.year.tolist() == [0, 1, 2]
    assert not table.drop(columns=["summer_albedo", "winter_albedo"]).isna().any().any()


def test_daily_output_has_a_row_a_day():
    table = simulate(years=2, output="daily")
    assert tuple(table.columns) == ("year", "doy", *DAILY, "nee_kgc_m2")
    assert table.groupby("year").doy.apply(list).tolist() == [list(range(1, 366))] * 2


def test_annual_and_daily_output_are_of_the_same_run():
    annual, daily = simulate(years=2), simulate(years=2, output="daily")
    by_year = daily.groupby("year")
    np.testing.assert_allclose(by_year.gpp_kgc_m2.sum(), annual.gpp_kgc_m2, rtol=1e-9)
    np.testing.assert_allclose(by_year.swe_mm.max(), annual.peak_swe_mm, rtol=1e-12)
    np.testing.assert_allclose(by_year.air_temperature_c.mean(), annual.air_temperature_c, rtol=1e-9)
    assert ((by_year.air_temperature_c.agg(lambda t: (t > 5.0).sum())) == annual.growing_season_days).all()


def test_snow_is_off_on_the_day_after_its_last():
    """Frost and snow until 30 April, then warmth without rain, and snow again in December."""
    forcing = observed()
    day = forcing.index.day_of_year
    cold = (day <= 120) | (day > 334)
    forcing["air_temperature_c"] = np.where(cold, -8.0, 12.0)
    forcing["precipitation_mm"] = np.where(cold, 0.1, 0.0)
    annual, daily = simulate(forcing=forcing), simulate(forcing=forcing, output="daily")
    snowy = daily.doy[daily.swe_mm > 1.0]
    assert snowy.iloc[-1] == 365 and len(snowy) == annual.snow_days[0]
    last = snowy[snowy < 300].iloc[-1]
    assert 121 <= last < 150
    assert annual.snow_off_doy[0] == last + 1


def test_one_action_for_all_years_or_one_for_each():
    pd.testing.assert_frame_equal(simulate(actions=24, years=3), simulate(actions=[24, 24, 24], years=3))
    planted = simulate(actions=[24, 12, 17], years=3).planted_stems_ha
    assert planted.tolist() == [100.0, 0.0, 50.0]


def test_planting_adds_the_mix_and_thinning_the_rest():
    table = simulate(actions=[20, 24], years=2, initial={"density_stems_ha": 400.0, "conifer_fraction": 0.5})
    assert table.density_after_action[0] == pytest.approx(500.0)
    assert table.conifer_fraction_after_action[0] == pytest.approx(0.4)
    thinned = simulate(
        actions=4, initial={"density_stems_ha": 900.0, "conifer_fraction": 0.5, "oldest_age_years": 120.0}
    )
    assert thinned.density_after_action[0] == pytest.approx(800.0)
    assert thinned.conifer_fraction_after_action[0] == pytest.approx(450.0 / 800.0)
    assert thinned.harvest_kgc_m2[0] > 0.0 and thinned.hwp_kgc_m2[0] == pytest.approx(0.75 * thinned.harvest_kgc_m2[0])


@pytest.mark.parametrize(
    ("youngest", "cut"), [("young", 100.0), ("mature", 100.0), ("old", pytest.approx(62.0, abs=1.0))]
)
def test_the_youngest_class_that_may_be_cut(youngest, cut):
    initial = {"density_stems_ha": 900.0, "conifer_fraction": 0.5, "oldest_age_years": 110.0}
    table = simulate(actions=2, initial=initial, harvest_min_class=youngest)
    first = {"young": 21, "mature": 41, "old": 101}[youngest]
    survival = 0.975 ** np.arange(110)
    harvestable = 900.0 * survival[first - 1 :].sum() / survival.sum()
    assert table.harvestable_stems_ha[0] == pytest.approx(harvestable)
    assert table.thinned_stems_ha[0] == pytest.approx(min(100.0, harvestable))


def test_products_decay_with_their_half_life():
    initial = {"hwp_kgc_m2": 8.0}
    assert simulate(initial=initial, years=2).hwp_kgc_m2.tolist() == [8.0, 8.0]
    assert simulate(initial=initial, years=20, hwp_half_life_years=10.0).hwp_kgc_m2.iloc[-1] == pytest.approx(2.0)


def test_first_stocks_are_as_given():
    given = {"density_stems_ha": 700.0, "conifer_fraction": 0.25, "biomass_kgc_m2": 6.0, "soil_kgc_m2": 9.0}
    still = {
        name: 0.0
        for name in ("recruitment_rate", "natural_mortality", "insect_base_probability", "density_dependent_mortality")
    }
    table = simulate(still, initial={**given, "organic_layer_m": 0.12}, mechanisms={"fire": False})
    assert table.density_stems_ha[0] == pytest.approx(700.0)
    assert table.conifer_fraction[0] == pytest.approx(0.25)
    assert (table.biomass_kgc_m2 - table.biomass_change_kgc_m2)[0] == pytest.approx(6.0)
    assert (table.soil_kgc_m2 - table.soil_change_kgc_m2)[0] == pytest.approx(9.0)
    assert table.organic_layer_m[0] == pytest.approx(0.12, abs=0.01)


def test_the_age_of_a_first_stand_fits_its_carbon():
    """Stems of their ages' sizes hold the drawn biomass, and all came up within twenty years of each other."""
    parameters = {**sim.middle_site(), **check_constants(None), **check_mechanisms(None)}
    sizes, generator = spin_up.stem_sizes(parameters), np.random.default_rng(1)
    assert sizes[:, -1] == pytest.approx(120.0)
    ages, biomass = [], []
    for _ in range(200):
        state = spin_up.first_state(parameters, generator, None, sim.INITIAL_RANGES)
        stems, carbon = state[-2 * AGES :].reshape(2, AGES), state[:2]
        density = stems.sum()
        np.testing.assert_allclose((stems * sizes).sum(axis=1) * 1e-4, carbon, rtol=1e-9)
        assert carbon.sum() <= min(10.0, density * 120.0 * 1e-4) * (1.0 + 1e-12)
        assert carbon.sum() >= min(1.0, density * 120.0 * 1e-4) * (1.0 - 1e-12)
        present = np.flatnonzero(stems.sum(axis=0))
        assert present[-1] - present[0] <= spin_up.COHORT_YEARS
        ages.append(present[-1])
        biomass.append(carbon.sum())
    assert min(ages) < 50 and max(ages) == AGES - 1
    assert min(biomass) < 1.0 and max(biomass) > 5.0


def test_as_much_is_drawn_for_a_first_stand_whatever_is_given():
    parameters = {**sim.middle_site(), **check_constants(None), **check_mechanisms(None)}
    given = (
        None,
        {"biomass_kgc_m2": 5.0, "density_stems_ha": 400.0},
        {"oldest_age_years": 80.0},
        {"conifer_old_stems_ha": 5.0},
    )
    ranges = {**sim.INITIAL_RANGES, "oldest_age_years": (50.0, 60.0)}
    after = []
    for stocks in given:
        for drawn_from in (sim.INITIAL_RANGES, ranges):
            generator = np.random.default_rng(3)
            spin_up.first_state(parameters, generator, stocks, drawn_from)
            after.append(generator.random())
    assert len(set(after)) == 1


def test_stems_out_of_reach_are_the_youngest_or_the_oldest():
    sizes = spin_up.stem_sizes(check_constants(None))[0]
    oldest, youngest = (spin_up.stems_of_size(kgc, sizes) for kgc in (500.0, 0.0))
    assert oldest[-1] == pytest.approx(1.0) and youngest[1] == pytest.approx(1.0)
    between = spin_up.stems_of_size(40.0, sizes)
    assert between @ sizes == pytest.approx(40.0) and between.sum() == pytest.approx(1.0)


def test_the_middle_stand_is_one_that_could_be_drawn():
    middle = spin_up.middle_stocks(sim.INITIAL_RANGES)
    assert middle["density_stems_ha"] == 300.0
    assert middle["biomass_kgc_m2"] == pytest.approx(0.5 * (1.0 + 3.6))  # 3.6 kgC/m2 are 120 kgC a stem


def test_a_site_without_stems_keeps_no_living_carbon():
    table = simulate(initial={"density_stems_ha": 0.0}, years=2)
    assert table.biomass_kgc_m2[0] == table.mortality_kgc_m2[0] == 0.0
    assert table.gpp_kgc_m2[0] == table.understorey_gpp_kgc_m2[0] > 0.0
    assert table.density_stems_ha[0] > 0.0  # recruits


def test_seedlings_on_empty_ground_are_of_both_species():
    table = simulate(initial={"density_stems_ha": 0.0})
    assert table.recruited_stems_ha[0] == table.density_stems_ha[0] > 0.0
    assert table.conifer_fraction[0] == 0.5


@pytest.mark.parametrize("minutes", [10, 15, 60, 120])
def test_any_divisor_of_a_day_is_a_time_step(minutes):
    table = simulate(time_step_minutes=minutes)
    assert table.gpp_kgc_m2[0] == pytest.approx(simulate(time_step_minutes=30).gpp_kgc_m2[0], rel=0.02)


@pytest.mark.parametrize("mechanism", sim.MECHANISMS)
def test_every_mechanism_can_be_switched_off(mechanism):
    burning = {"fire_base_probability": 0.05, "fire_drought_threshold": 0.0, "insect_base_probability": 1.0}
    initial = {"density_stems_ha": 8000.0, "biomass_kgc_m2": 8.0}  # so dense that insects come after the fire, too
    site = {**burning, "mean_annual_temperature_c": -8.0}
    on = simulate(site, initial=initial, years=2, seed=2)
    off = simulate(site, initial=initial, years=2, seed=2, mechanisms={mechanism: False})
    assert not on.equals(off)
    if mechanism in ("fire", "insects"):
        column = {"fire": "fire_mortality", "insects": "insect_mortality"}[mechanism]
        assert on[column].max() > 0.0 and off[column].max() == 0.0
    if mechanism == "interception":
        assert off.canopy_sublimation_mm.max() == 0.0 < on.canopy_sublimation_mm.max()


# --------------------------------------------------------------------------------- worlds in balance, as observed


def test_no_heat_flows_through_a_boundary_in_balance():
    site = {"mean_annual_temperature_c": -10.0, "deep_boundary_temperature_k": 272.0}
    heat = {}
    for boundary in ("sampled", "balanced"):
        table = simulate(site, boundary=boundary, years=10, mechanisms={"fire": False})
        heat[boundary] = (table.boundary_warming_mj_m2 - table.boundary_cooling_mj_m2).mean()
    assert abs(heat["balanced"]) < 1.5 and abs(heat["sampled"]) > 5.0


def test_the_boundary_in_balance_does_not_hang_on_the_sites_own():
    tables = [simulate({"deep_boundary_temperature_k": k}, boundary="balanced") for k in (262.0, 278.0)]
    difference = (tables[0] - tables[1]).deep_soil_temperature_c[0]
    assert abs(difference) < 0.05


def test_a_boundary_that_cannot_be_in_balance_is_told():
    with pytest.warns(UserWarning, match=r"boundary='balanced': stand 0 would need one outside of \[260, 285\] K"):
        simulate({"mean_annual_temperature_c": -20.0, "winter_snow_mm_day": 0.2}, boundary="balanced")


def test_balanced_soil_carbon_keeps_what_it_gets():
    initial = {"conifer_mature_stems_ha": 1500.0, "biomass_kgc_m2": 5.6}
    quiet = {"fire": False, "insects": False}
    drawn, balanced = (
        simulate(initial=initial, soil_carbon=how, mechanisms=quiet, time_step_minutes=120, years=5).mean()
        for how in ("drawn", "balanced")
    )
    assert abs(balanced.soil_change_kgc_m2) < 0.07 * balanced.litterfall_kgc_m2
    assert drawn.soil_change_kgc_m2 > 0.2 * drawn.litterfall_kgc_m2
    given = simulate(initial={**initial, "soil_kgc_m2": 3.0}, soil_carbon="balanced")
    assert given.soil_kgc_m2[0] - given.soil_change_kgc_m2[0] == pytest.approx(3.0)
    treeless = {"density_stems_ha": 0.0}
    pd.testing.assert_frame_equal(simulate(initial=treeless, soil_carbon="balanced"), simulate(initial=treeless))


def test_soil_in_balance_respires_what_it_gets():
    """Soil that gets 0.8 a year and respires a tenth of what it has at each moment is in balance at 8."""
    after = 8.0 - 4.0 * np.exp(-0.1)  # a year after it had 4
    balanced = spin_up.soil_carbon_in_balance(4.0, after - 4.0, 0.8 - (after - 4.0))
    assert balanced == pytest.approx(8.0, rel=2e-3)


def test_the_search_for_the_deep_soils_heat_leaps_no_further_than_15_years():
    no_limits = np.array([[-1e9, 1e9]])

    def leap(gain, gain_before, moved, limits=no_limits):
        """From an enthalpy of 100, to which the last leap moved it."""
        return spin_up.next_deep_heat(
            np.array([100.0]), np.array([gain]), np.array([100.0 - moved]), np.array([gain_before]), limits
        )[0]

    assert leap(2.0, 4.0, 3.0) == pytest.approx(103.0)  # as much again, and nothing is gained
    assert leap(-2.0, -4.0, -3.0) == pytest.approx(97.0)
    assert leap(2.0, 2.1, 3.0) == pytest.approx(130.0)  # the straight line leads to 160
    assert leap(-2.0, -2.1, -3.0) == pytest.approx(70.0)
    assert leap(2.0, 1.0, 3.0) == pytest.approx(130.0)  # no line leads to balance
    assert leap(2.0, 2.1, 3.0, np.array([[90.0, 110.0]])) == 110.0
    assert spin_up.next_deep_heat(np.array([100.0]), np.array([2.0]), None, None, no_limits) == [102.0]


def test_first_biomass_is_within_what_the_stems_hold():
    for initial in ({"conifer_seedling_stems_ha": 2000.0}, {"density_stems_ha": 500.0, "oldest_age_years": 5.0}):
        assert simulate(initial=initial).biomass_kgc_m2[0] < 0.3
    heavy = simulate(initial={"biomass_kgc_m2": 2.0, "oldest_age_years": 10.0})
    assert heavy.density_stems_ha[0] > 1500.0  # as many as it takes at that age: 600 is the most that is drawn


def test_weather_as_observed_varies_more_and_keeps_its_means():
    paper, observed_ = (simulate(years=40, weather=w, output="daily") for w in ("paper", "observed"))
    assert paper.air_temperature_c.mean() == pytest.approx(observed_.air_temperature_c.mean(), abs=0.5)
    for name, error in (("precipitation_mm", 0.1), ("shortwave_mj_m2", 0.03)):
        assert observed_[name].sum() == pytest.approx(paper[name].sum(), rel=error)

    def anomaly(table, days):
        course = table.air_temperature_c.to_numpy().reshape(-1, 365)
        return (course - course.mean(axis=0))[:, days].std()

    january, july = slice(0, 31), slice(181, 212)
    assert anomaly(paper, january) < 2.0 and 7.0 < anomaly(observed_, january) < 11.0
    assert 2.4 < anomaly(observed_, july) < 4.0
    wet_days = [(table.precipitation_mm > 0.0).mean() for table in (paper, observed_)]
    assert wet_days[1] == pytest.approx(3.0 * wet_days[0], rel=0.1)


def test_the_papers_weather_does_not_hang_on_the_draws_of_wind():
    site = {"wind_speed_m_s": 3.0}
    pd.testing.assert_frame_equal(simulate(site, constants={"wind_spread": 0.9}), simulate(site))


# ------------------------------------------------------------------------------ thaw as the field measures it


def test_the_upper_ground_holds_less_heat_where_it_is_frozen():
    table = simulate({"mean_annual_temperature_c": -9.0}, years=2, boundary="balanced")
    water = 3.34e5 * 1000.0 * CONSTANTS["soil_freezing_water"].low * 3.0 * 1e-6
    assert (table.upper_ground_heat_mj_m2 < 0.0).all() and (table.upper_ground_heat_mj_m2 > -1.5 * water).all()
    assert (table.upper_ground_heat_end_mj_m2 < -0.5 * water).all()  # winter
    mean = (table.surface_soil_temperature_c + 2.0 * table.deep_soil_temperature_c) / 3.0
    np.testing.assert_allclose(table.upper_ground_temperature_c, mean, rtol=1e-12)
    assert (table.permafrost_top_temperature_c < 0.0).all()


def test_without_permafrost_its_top_is_as_warm_as_the_boundary():
    warm = {"mean_annual_temperature_c": 5.0, "deep_boundary_temperature_k": 278.0}
    table = simulate(warm, years=2)
    assert (table.upper_ground_heat_mj_m2 > 0.0).all()
    np.testing.assert_allclose(table.permafrost_top_temperature_c, 278.0 - 273.15)


# --------------------------------------------------------------------------- what an override leaves unchanged


def test_a_site_seed_gives_the_same_site_again():
    assert sim.sample_site(5) == sim.sample_site(5) != sim.sample_site(6)
    assert list(sim.sample_site(5)) == list(SITE_PARAMETERS)


def test_a_parameter_that_is_not_observed_changes_no_site(monkeypatch):
    site = sim.sample_site(5)
    hidden = replace(SITE_PARAMETERS["q10"], name="hidden", observed=False)
    monkeypatch.setattr(sim.parameters, "SITE_PARAMETERS", {"hidden": hidden, **SITE_PARAMETERS})
    with_hidden = sim.sample_site(5)
    assert list(with_hidden)[0] == "hidden" and hidden.low <= with_hidden["hidden"] <= hidden.high
    assert all(with_hidden[name] == site[name] for name in sim.OBSERVED_SITE_PARAMETERS)
    assert (sim.scale_site(with_hidden) == sim.scale_site(site)).all()


@pytest.mark.parametrize("name", SITE_PARAMETERS)
def test_an_override_changes_no_other_parameter(name):
    value = 0.5 * (SITE_PARAMETERS[name].physical_low + SITE_PARAMETERS[name].physical_high)
    drawn, overridden = sim.sample_site(5), sim.sample_site(5, {name: value})
    changed = {other for other in drawn if drawn[other] != overridden[other]}
    # The latitude is what the mean annual temperature is drawn around.
    assert changed - {"mean_annual_temperature_c" if name == "latitude_deg" else None} == {name}
    assert overridden[name] == value


def test_an_override_may_be_a_range():
    q10 = [sim.sample_site(seed, {"q10": (3.0, 3.5)})["q10"] for seed in range(50)]
    assert min(q10) >= 3.0 and max(q10) <= 3.5 and max(q10) - min(q10) > 0.3
    assert sim.middle_site({"q10": (3.0, 3.5)})["q10"] == 3.25


@pytest.mark.parametrize("seed", range(5))
def test_sampled_sites_lie_in_their_ranges(seed):
    site = sim.sample_site(seed)
    for name, p in SITE_PARAMETERS.items():
        assert p.low <= site[name] <= p.high, name
    scaled = sim.scale_site(site)
    assert scaled.shape == (62,) and scaled.min() >= 0.0 and scaled.max() <= 1.0
    assert scaled[sim.OBSERVED_SITE_PARAMETERS.index("q10")] == pytest.approx((site["q10"] - 1.8) / 0.5)


@pytest.mark.parametrize(
    "site, named", [({"q10": 2}, "latitude_deg, .* and 58 more missing"), (3, "a dict .* got int")]
)
def test_shares_of_half_a_site_are_refused(site, named):
    with pytest.raises(ValueError, match=f"site: {named}"):
        sim.scale_site(site)


def test_shares_of_a_site_of_text_are_refused():
    with pytest.raises(ValueError, match="q10: a finite number is allowed, got 'two'"):
        sim.scale_site({**sim.sample_site(5), "q10": "two"})


def test_mean_annual_temperature_follows_latitude():
    assert mean_annual_temperature(60.5, 0.5) == pytest.approx(-7.5, abs=1e-6)
    assert mean_annual_temperature(56.0, 0.5) < -5.0  # the upper half of the normal is cut off
    assert mean_annual_temperature(60.5, 0.8413) == pytest.approx(-7.0, abs=1e-3)  # one standard deviation
    assert mean_annual_temperature(72.0, 0.5) == -10.0 and mean_annual_temperature(45.0, 0.5) == -5.0
    for latitude in np.linspace(45.0, 72.0, 10):
        for uniform in (0.0, 0.3, 0.999999):
            assert -10.0 <= mean_annual_temperature(latitude, uniform) <= -5.0


def test_a_latitude_override_moves_only_the_sun_and_the_mean_temperature():
    name = "mean_annual_temperature_c"
    south, north = (sim.sample_site(5, {"latitude_deg": degrees, name: -7.0}) for degrees in (57.0, 64.0))
    assert {k for k in south if south[k] != north[k]} == {"latitude_deg"}
    a, b = (simulate(site, output="daily") for site in (south, north))
    np.testing.assert_allclose(a.air_temperature_c, b.air_temperature_c, atol=1e-9)
    assert (a.precipitation_mm == b.precipitation_mm).all()
    assert not np.allclose(a.shortwave_mj_m2, b.shortwave_mj_m2)


@pytest.mark.parametrize("action", [0, 4, 20, 24])
def test_weather_does_not_depend_on_the_policy(action):
    idle, busy = (simulate(actions=a, years=3, output="daily") for a in (12, action))
    for name in ("air_temperature_c", "precipitation_mm", "shortwave_mj_m2"):
        assert (idle[name] == busy[name]).all(), name
    assert not idle.equals(busy)


def test_weather_does_not_depend_on_the_first_stocks():
    a, b = (simulate(initial={"density_stems_ha": n}, years=2, output="daily") for n in (100.0, 1500.0))
    for name in ("air_temperature_c", "precipitation_mm", "shortwave_mj_m2"):
        assert (a[name] == b[name]).all(), name


def test_weather_differs_between_seeds_and_years():
    one, other = simulate(years=2), simulate(years=2, seed=2)
    assert one.precipitation_mm.nunique() == 2
    assert (one.precipitation_mm != other.precipitation_mm).all()


def test_a_constant_is_an_argument_not_a_recompilation():
    assert simulate(constants={"light_use_conifer": 2.0}).gpp_kgc_m2[0] > simulate().gpp_kgc_m2[0]
    for name, constant in CONSTANTS.items():
        assert constant.physical_low <= constant.low <= constant.physical_high, name
        assert constant.source and constant.description and constant.unit, name


def test_every_site_parameter_has_limits_around_its_range():
    for name, p in SITE_PARAMETERS.items():
        assert p.physical_low <= p.low < p.high <= p.physical_high, name
        assert p.source and p.description and p.unit, name


# ---------------------------------------------------------------------------------------------- observed weather


def test_observed_weather_is_the_weather():
    forcing = observed()
    table = simulate(forcing=forcing)
    assert table.air_temperature_c[0] == pytest.approx(forcing.air_temperature_c.mean())
    assert table.precipitation_mm[0] == pytest.approx(forcing.precipitation_mm.sum())
    assert table.shortwave_mj_m2[0] == pytest.approx(forcing.shortwave_w_m2.mean() * 365 * 0.0864)


def test_finer_intervals_are_averaged_and_rain_is_summed():
    fine = observed(2, minutes=30)
    (steps,), days = check_forcing(fine, 240, years=1)
    assert days == 2 and steps.shape == (12, len(FORCING))
    for name, values in zip(FORCING, steps.T, strict=True):
        intervals = fine[name].resample("240min")
        expected = intervals.sum() if name == "precipitation_mm" else intervals.mean()
        np.testing.assert_allclose(values, expected, rtol=1e-12, err_msg=name)


def test_observed_years_are_repeated_in_turn():
    forcing = pd.concat([observed(start="2018-01-01"), observed(start="2019-01-01", precipitation_mm=0.1)])
    wet, dry = 0.25 * 365 * 6, 0.1 * 365 * 6
    assert simulate(forcing=forcing, years=5).precipitation_mm.tolist() == pytest.approx([wet, dry, wet, dry, wet])


def test_29_february_is_dropped():
    leap = observed(366, start="2020-01-01")
    days = leap.index.normalize()
    leap.loc[days == "2020-02-29", "precipitation_mm"] = 33.0
    expected = 0.25 * 365 * 6
    assert simulate(forcing=leap).precipitation_mm[0] == pytest.approx(expected)
    assert simulate(forcing=leap[days != "2020-02-29"]).precipitation_mm[0] == pytest.approx(expected)


def test_a_part_of_a_year_is_run_as_such():
    part = simulate(forcing=observed(90), output="daily")
    assert part.doy.tolist() == list(range(1, 91))
    assert part.precipitation_mm.sum() == pytest.approx(0.25 * 6 * 90)
    with pytest.raises(ValueError, match='output "annual": 90 days of forcing are no whole year'):
        simulate(forcing=observed(90))


@pytest.mark.parametrize("climate", ["mean_annual_temperature_c", "seasonal_amplitude_c"])
def test_the_climate_of_a_part_of_a_year_is_asked_for(climate):
    part = observed(90)
    value = part.attrs["site"].pop(climate)
    with pytest.raises(ValueError, match=f"90 days are no whole year.* site= needs {climate}$"):
        simulate(forcing=part, output="daily")
    pd.testing.assert_frame_equal(
        simulate({climate: value}, forcing=part, output="daily"), simulate(forcing=observed(90), output="daily")
    )


def test_a_forcing_that_lost_its_site_knows_its_climate_but_no_place():
    lost = observed()
    told = lost.attrs.pop("site")
    with pytest.raises(ValueError, match="latitude_deg is needed"):
        simulate(forcing=lost)
    place = {"latitude_deg": told["latitude_deg"]}
    np.testing.assert_allclose(simulate(place, forcing=lost), simulate(place, forcing=observed()), rtol=0.02, atol=0.02)


def test_air_without_wind_at_the_melting_point_is_allowed():
    table = simulate(forcing=observed(120, air_temperature_c=0.0, wind_speed_m_s=0.0), output="daily")
    assert np.isfinite(table.drop(columns="albedo").to_numpy()).all()


def without(forcing, first, last):
    """The forcing without the days `first` to `last`, both included."""
    days = forcing.index.normalize()
    return forcing[(days < first) | (days > last)]


def with_a_gap(column):
    forcing = observed()
    forcing.iloc[50, forcing.columns.get_loc(column)] = np.nan
    return forcing


FORCINGS = {
    "kelvin": (lambda: observed(air_temperature_c=270.0), r"air_temperature_c is 270 at 2019-01-01.*degC.*kelvin"),
    "percent": (lambda: observed(relative_humidity=70.0), r"relative_humidity is 70 .*\[0, 1.1\].*percent"),
    "negative light": (lambda: observed(shortwave_w_m2=-2.0), r"shortwave_w_m2 is -2 .*\[0, 1500\] W m-2"),
    "longwave of nothing": (lambda: observed(longwave_w_m2=0.0), r"longwave_w_m2 is 0 .*\[50, 600\]"),
    "infinite wind": (lambda: observed(wind_speed_m_s=np.inf), r"wind_speed_m_s is inf .*\[0, 60\] m s-1"),
    "negative rain": (lambda: observed(precipitation_mm=-1.0), r"precipitation_mm is -1 .*\[0, 200\]"),
    "gap in temperature": (lambda: with_a_gap("air_temperature_c"), r"air_temperature_c is a gap at 2019-01-09 08:00"),
    "gap in rain": (lambda: with_a_gap("precipitation_mm"), r"precipitation_mm is a gap at 2019-01-09 08:00"),
    "text": (lambda: observed(wind_speed_m_s="calm"), r"wind_speed_m_s"),
    "missing column": (lambda: observed().drop(columns="longwave_w_m2"), r"longwave_w_m2 is missing; needed: air_temp"),
    "missing row": (lambda: observed().drop(pd.Timestamp("2019-03-05 08:00")), r"not regular at 2019-03-05 12:00"),
    "missing week before March": (
        lambda: without(observed(120), "2019-02-20", "2019-02-28"),
        r"not regular at 2019-03-01",
    ),
    "missing weeks of a leap year": (
        lambda: without(observed(120, start="2020-01-01"), "2020-02-10", "2020-02-29"),
        r"not regular at 2020-03-01",
    ),
    "duplicate times": (lambda: pd.concat([observed().iloc[:1]] * 6), r"2019-01-01 00:00"),
    "descending times": (
        lambda: observed(10).iloc[::-1],
        r"its times are not sorted, or twice: .* of zero-based row 1 ",
    ),
    "shuffled times": (
        lambda: observed(10).iloc[[0, 40, 3, *range(4, 30)]],
        r"not sorted, or twice: 2019-01-01 12:00:00 of zero-based row 2 follows 2019-01-07 16:00:00$",
    ),
    "a time missing": (
        lambda: observed(10).set_axis(observed(10).index.where(np.arange(60) != 1)),
        r"^forcing: the time of zero-based row 1 is missing$",
    ),
    "a column twice": (
        lambda: pd.concat([observed(), observed()[["wind_speed_m_s"]]], axis=1),
        r"^forcing: column wind_speed_m_s is there twice$",
    ),
    "light in MJ": (
        lambda: observed().assign(shortwave_w_m2=lambda table: 0.0036 * table.shortwave_w_m2),
        r"shortwave_w_m2 is 0.\d+ W m-2 on a clear summer day in 2019; at least 50 is allowed \(is it in MJ m-2\?\)",
    ),
    "no light": (lambda: observed(shortwave_w_m2=0.0), r"shortwave_w_m2 is 0 W m-2 on a clear summer day in 2019"),
    "rain in m": (
        lambda: observed(precipitation_mm=0.00025),
        r"precipitation_mm is 0.\d+ mm a year in 2019; \[20, 5000\] is allowed \(each row has the mm of its 240",
    ),
    "no rain in the second year": (
        lambda: pd.concat([observed(), observed(366, start="2020-01-01", precipitation_mm=0.0)]),
        r"precipitation_mm is 0 mm a year in 2020",
    ),
    "no humidity": (
        lambda: observed(relative_humidity=0.0),
        r"relative_humidity is 0 in half of all intervals in 2019",
    ),
    "truth": (lambda: observed(relative_humidity=True), r"relative_humidity has type bool; numbers are allowed"),
    "complex": (lambda: observed(wind_speed_m_s=1 + 1j), r"wind_speed_m_s has type complex128; numbers are allowed"),
    "starts in February": (lambda: observed(30, start="2019-02-01"), r"starts at 2019-02-01 00:00.*1 January"),
    "starts at noon": (lambda: observed(30, start="2019-01-01 12:00"), r"starts at 2019-01-01 12:00.*00:00"),
    "a year and a bit": (lambda: observed(400), r"forcing of 400 days: whole years of 365 days"),
    "half a day": (lambda: observed(10.5), r"forcing of 10.5 days.*whole days"),
    "one row": (lambda: observed().iloc[:1], r"1 row"),
    "no rows": (lambda: observed().iloc[:0], r"0 rows"),
    "an array": (lambda: observed().to_numpy(), r"DataFrame with a DatetimeIndex"),
    "no times": (lambda: observed().reset_index(drop=True), r"DataFrame with a DatetimeIndex"),
    "a time zone": (
        lambda: observed().tz_localize("UTC"),
        r"its times have the time zone UTC; local solar time without one is allowed, which sim.read_forcing makes",
    ),
    "days": (
        lambda: observed(minutes=1440),
        r"it is daily; sim.half_hours\(forcing, latitude_deg\) makes half-hours of it",
    ),
    "a sun at midnight": (
        lambda: observed(shortwave_w_m2=np.roll(observed().shortwave_w_m2, 3)),
        r"its sun is highest at \d\d:\d\d; times of local solar time, highest at 12:00, are allowed",
    ),
}


@pytest.mark.parametrize(("make", "message"), FORCINGS.values(), ids=FORCINGS)
def test_forcing_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        simulate(forcing=make())


@pytest.mark.parametrize("minutes", [180, 7])
def test_a_forcing_of_another_interval_is_named_for_what_it_is(monkeypatch, minutes):
    monkeypatch.setattr(stands, "LONGEST_STEP_MINUTES", 120)
    message = f"^forcing: it comes every {minutes} minutes; a divisor of a day of at most 120 is allowed$"
    with pytest.raises(ValueError, match=message):
        simulate(forcing=observed(minutes=minutes))


def test_by_default_the_step_is_one_that_the_forcing_fills():
    forcing = observed(minutes=20, precipitation_mm=0.02)
    pd.testing.assert_frame_equal(sim.simulate(forcing=forcing), sim.simulate(forcing=forcing, time_step_minutes=40))


@pytest.mark.parametrize("minutes", [120, 360])
def test_a_time_step_that_the_forcing_does_not_fill_is_refused(minutes):
    with pytest.raises(ValueError, match=rf"time_step_minutes = {minutes}: the forcing comes every 240 minutes"):
        simulate(forcing=observed(), time_step_minutes=minutes)


def test_a_part_of_a_year_is_not_repeated():
    with pytest.raises(ValueError, match=r"forcing of 90 days.*years=1"):
        simulate(forcing=observed(90), years=2)


# ------------------------------------------------------------------------------------------- doors of a scientist


def test_nothing_has_to_be_given():
    table = sim.simulate(years=2, time_step_minutes=240)
    pd.testing.assert_frame_equal(table, sim.simulate(None, 12, seed=0, years=2, time_step_minutes=240))


def test_tables_have_dates_units_and_net_exchange():
    annual, daily = (sim.simulate(years=4, output=output, time_step_minutes=240) for output in ("annual", "daily"))
    assert annual.index.equals(pd.DatetimeIndex([f"{y}-01-01" for y in range(2025, 2029)], name="time"))
    assert len(daily) == 4 * 365 and pd.Timestamp("2028-02-29") not in daily.index
    assert (daily.index[[0, -1]] == pd.DatetimeIndex(["2025-01-01", "2028-12-31"])).all()
    np.testing.assert_array_equal(daily.index.year, 2025 + daily.year)
    np.testing.assert_allclose(daily.nee_kgc_m2.groupby(daily.index.year).sum(), annual.nee_kgc_m2, rtol=1e-9)
    respired = annual.autotrophic_respiration_kgc_m2 + annual.heterotrophic_respiration_kgc_m2
    np.testing.assert_allclose(annual.nee_kgc_m2, respired - annual.gpp_kgc_m2, rtol=1e-12)
    for table in (annual, daily):
        assert set(table.attrs["units"]) == set(table)
    assert daily.attrs["units"]["nee_kgc_m2"] == "kgC m-2" and daily.attrs["units"]["snow_depth_m"] == "m"


def test_dates_and_years_are_the_forcings():
    two = pd.concat([observed(start="2015-01-01"), observed(366, start="2016-01-01")])
    table = sim.simulate(forcing=two, output="daily", time_step_minutes=240)
    dates = pd.date_range("2015-01-01", "2016-12-31").drop("2016-02-29")
    np.testing.assert_array_equal(table.index, dates)
    again = sim.simulate(forcing=two, years=3, time_step_minutes=240)
    assert again.index.year.tolist() == [2015, 2016, 2017]
    part = sim.simulate(forcing=observed(40, start="2015-01-01"), output="daily", time_step_minutes=240)
    np.testing.assert_array_equal(part.index, dates[:40])
    assert len(sim.simulate(forcing=observed())) == 1  # its steps are the forcing's, where they are longer than 30 min


def test_the_latitude_is_the_forcings_where_it_is_not_given():
    forcing = observed()
    forcing.attrs["site"] = {"latitude_deg": 66.0}
    told = simulate(forcing=forcing)
    plain = observed()
    assert not told.equals(simulate(forcing=plain))
    plain.attrs.clear()
    pd.testing.assert_frame_equal(told, simulate(forcing.attrs["site"], forcing=plain))
    with pytest.raises(
        ValueError, match=r"latitude_deg = 60: the forcing is of 66, and the sun has to be that of its place"
    ):
        simulate({"latitude_deg": 60.0}, forcing=forcing)


def test_below_whole_years_no_other_climate_has_a_part():
    forcing = observed(air_temperature_c=observed().air_temperature_c - 2.0)  # near 0 degC balance comes late
    ground = [
        simulate({"mean_annual_temperature_c": mean}, forcing=forcing).deep_soil_temperature_c[0]
        for mean in (-9.0, 3.0)
    ]
    assert ground[0] == pytest.approx(ground[1], abs=0.01)
    forcing.attrs["site"] = {"latitude_deg": 60.5, "mean_annual_temperature_c": -3.0, "seasonal_amplitude_c": 17.0}
    warmer = simulate(forcing=forcing)
    forcing.attrs["site"] = {"latitude_deg": 60.5}
    pd.testing.assert_frame_equal(simulate(forcing=forcing), warmer)
    mild = observed(air_temperature_c=12.0)
    assert simulate(forcing=mild).air_temperature_c[0] == pytest.approx(12.0)


def test_arguments_stay_as_they_are():
    site, initial = {"latitude_deg": 62.0}, {"density_stems_ha": 500.0}
    simulate(site, None, hold_stand=True, initial=initial)
    assert site == {"latitude_deg": 62.0} and initial == {"density_stems_ha": 500.0}


def test_one_day_has_daily_values():
    day = simulate(forcing=observed(1), output="daily")
    assert len(day) == 1 and day.doy[0] == 1 and np.isfinite(day.gpp_kgc_m2[0])


@pytest.mark.parametrize("initial", [{}, {"conifer_mature_stems_ha": 600.0, "deciduous_young_stems_ha": 500.0}])
def test_a_stand_that_is_held_is_every_year_the_same(initial):
    site = {"fire_base_probability": 0.05, "insect_base_probability": 1.0, "natural_mortality": 0.2}
    table = simulate(site, None, hold_stand=True, years=5, initial=initial)
    for name in ("density_stems_ha", "conifer_fraction", "max_lai", "crown_cover"):
        assert table[name].nunique() == 1, name
    starts = table.biomass_kgc_m2 - table.biomass_change_kgc_m2
    np.testing.assert_allclose(starts, starts[0], rtol=1e-12)
    assert table.gpp_kgc_m2.nunique() == 5 and table.dead_stems_ha.max() == 0.0
    free = simulate({**site, **HELD_STAND}, years=5, initial=initial)
    pd.testing.assert_frame_equal(free[:1], table[:1])  # the first year is that of a stand where nobody dies
    assert free.max_lai.nunique() > 1


@pytest.mark.parametrize("initial", [{"conifer_mature_stems_ha": 900.0}, {"density_stems_ha": 1200.0}])
def test_leaf_area_is_the_one_that_is_given(initial):
    initial = {"biomass_kgc_m2": 6.0, **initial}
    for lai in (0.7, 2.0):
        table = simulate(initial=initial, lai=lai, seed=3)
        assert table.max_lai[0] == pytest.approx(lai, rel=1e-9)
    as_it_is = simulate(initial=initial, seed=3)
    pd.testing.assert_frame_equal(simulate(initial=initial, seed=3, lai=as_it_is.max_lai[0]), as_it_is, rtol=1e-6)


def test_below_observed_weather_the_boundary_is_in_balance_unless_the_site_has_one():
    warm = observed(air_temperature_c=5.0)
    pd.testing.assert_frame_equal(simulate(forcing=warm), simulate(forcing=warm, boundary="balanced"))
    cold = {"deep_boundary_temperature_k": 270.0}
    pd.testing.assert_frame_equal(simulate(cold, forcing=warm), simulate(cold, forcing=warm, boundary="sampled"))


def test_a_boundary_in_degrees_is_the_sites():
    by_number = simulate(boundary=-2.0)
    pd.testing.assert_frame_equal(by_number, simulate({"deep_boundary_temperature_k": 273.15 - 2.0}))


def test_a_step_of_more_than_two_hours_is_refused():
    code = "import sim; sim.simulate(years=1, time_step_minutes=180)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    message = (
        "ValueError: time_step_minutes = 180: a divisor of 1440 is allowed, such as 10, 15, 30, 60, and at most 120"
    )
    assert result.stderr.splitlines()[-1] == message


# ------------------------------------------------------------------------------------------------------ refusals

BAD = {
    "unknown parameter": ({"site": {"q11": 2.0}}, r"unknown site parameter 'q11'; did you mean q10"),
    "parameter beyond its limits": ({"site": {"q10": 9.0}}, r"q10 = 9 is outside its physical limits \[1, 4\]"),
    "parameter of text": ({"site": {"q10": "2"}}, r"q10: a finite number is allowed, got '2'"),
    "parameter of nothing": ({"site": {"q10": None}}, r"q10: a finite number"),
    "parameter not a number": ({"site": {"q10": float("nan")}}, r"q10: a finite number is allowed, got nan"),
    "range": ({"site": {"q10": (1.8, 2.2)}}, r"site: q10 = \(1.8, 2.2\): one number is allowed for one stand"),
    "site of another type": ({"site": [1]}, r"site parameters: a dict .* got list"),
    "action 25": ({"actions": 25}, r"action 25: integers in \[0, 25\)"),
    "action -1": ({"actions": -1}, r"action -1: integers in \[0, 25\)"),
    "action of float": ({"actions": 12.0}, r"action 12.0 of type float64: integers"),
    "action of bool": ({"actions": True}, r"action True of type bool: integers"),
    "action of text": ({"actions": "plant"}, r"integers in \[0, 25\)"),
    "too many actions": ({"actions": [12, 12]}, r"actions of shape \(2,\): one integer for each of 1 years is allowed"),
    "years 0": ({"years": 0}, r"years: a positive integer is allowed, got 0"),
    "more water than pores": (
        {"constants": {"moss_water_held": 0.6, "organic_porosity": 0.5}},
        r"moss_water_held = 0.6 has to be less than organic_porosity = 0.5",
    ),
    "half a year of age": ({"constants": {"mature_age_limit": 61.5}}, r"mature_age_limit = 61.5: a whole number"),
    "years without end": ({"years": 10**9}, r"years = 1000000000: at most 5000 are allowed"),
    "years of float": ({"years": 2.0}, r"years: a positive integer is allowed, got 2.0"),
    "seed -1": ({"seed": -1}, r"seed.*-1"),
    "seed of float": ({"seed": 1.5}, r"seed.*1.5"),
    "seed of nothing": ({"seed": None}, r"seed.*None"),
    "time step 7": ({"time_step_minutes": 7}, r"time_step_minutes = 7: a divisor of 1440"),
    "time step 0": ({"time_step_minutes": 0}, r"time_step_minutes: a positive integer is allowed, got 0"),
    "time step of float": ({"time_step_minutes": 30.0}, r"time_step_minutes: .*30.0"),
    "unknown backend": ({"backend": "gpu"}, r"backend 'gpu': allowed are numba, python, cuda"),
    "unknown output": ({"output": "weekly"}, r"output 'weekly': allowed are annual, daily, xarray"),
    "held by a number": ({"hold_stand": 1}, r"hold_stand: True or False is allowed, got 1"),
    "held and planted": ({"hold_stand": True, "actions": 24}, r"hold_stand: .* neither planted nor cut; actions=None"),
    "leaf area of text": ({"lai": "high"}, r"lai = 'high': a number in \(0, 15\]"),
    "leaf area of none": ({"lai": 0.0}, r"lai = 0.0: a number in \(0, 15\]"),
    "leaf area without trees": (
        {"lai": 2.0, "initial": {"density_stems_ha": 0.0}},
        r"lai = 2: the first stand has no crowns; give stems by initial=",
    ),
    "more leaves than crowns can have": (
        {"lai": 9.0, "initial": {"density_stems_ha": 200.0}},
        r"lai = 9: crowns cover 0.21 of the ground, so \[0.045, 1.8\] m2 m-2 is allowed; more or older",
    ),
    "unknown boundary": ({"boundary": "warm"}, r"boundary 'warm': allowed are sampled, balanced, and a temp"),
    "boundary in kelvin": ({"boundary": 270.0}, r"boundary = 270: a temperature in \[-13.15, 11.85\] degC, or a name"),
    "two boundaries": (
        {"boundary": -1.0, "site": {"deep_boundary_temperature_k": 270.0}},
        r"boundary = -1: the site has deep_boundary_temperature_k too",
    ),
    "noise of another planet": (
        {"weather": "observed", "site": {"daily_noise_std_c": 5.0}},
        r"daily_noise_std_c = 5: with weather as observed, .* noise_factor_winter = 5.9 multiplies it, at most 2.54",
    ),
    "carbon of no stems": (
        {"initial": {"density_stems_ha": 0.0, "biomass_kgc_m2": 5.0}},
        r"initial biomass_kgc_m2 = 5: without stems, 0 is allowed",
    ),
    "carbon of no stems of a class": (
        {"initial": {"conifer_old_stems_ha": 0, "biomass_kgc_m2": 5.0}},
        r"initial biomass_kgc_m2 = 5: without stems, 0 is allowed",
    ),
    "more carbon than stems hold": (
        {"initial": {"density_stems_ha": 10.0, "biomass_kgc_m2": 6.0}},
        r"initial biomass_kgc_m2 = 6: of 10 stems/ha at most 0.12 is allowed, 120 kgC a stem",
    ),
    "seedlings as heavy as trees": (
        {"initial": {"conifer_seedling_stems_ha": 1000.0, "biomass_kgc_m2": 10.0}},
        r"biomass_kgc_m2 = 10: of 1000 stems/ha at most 0.0\d+ is allowed, 0.481 kgC a stem of that age",
    ),
    "trees of five years as heavy as old ones": (
        {"initial": {"density_stems_ha": 900.0, "oldest_age_years": 5, "biomass_kgc_m2": 10.0}},
        r"of 900 stems/ha at most 0.2\d+ is allowed, 3.28 kgC a stem of that age",
    ),
    "unknown stock": ({"initial": {"carbon": 1}}, r"unknown initial stock 'carbon'; allowed: density_stems_ha"),
    "negative stock": ({"initial": {"soil_kgc_m2": -1}}, r"initial soil_kgc_m2 = -1: a number in \[0, 100\]"),
    "stock not a number": ({"initial": {"soil_kgc_m2": float("nan")}}, r"initial soil_kgc_m2 = nan"),
    "stocks of another type": ({"initial": [1]}, r"initial: a dict .* got list"),
    "unknown constant": ({"constants": {"par": 1}}, r"unknown constant 'par'"),
    "constant beyond its limits": ({"constants": {"reference_lai": 99}}, r"reference_lai = 99 .*\[0.5, 10\]"),
    "soil nodes upside down": (
        {"constants": {"surface_soil_depth_m": 2.0, "deep_soil_node_m": 1.0}},
        r"surface_soil_depth_m.*deep_soil_node_m",
    ),
    "boundary within the soil": ({"constants": {"deep_soil_node_m": 12.0}}, r"deep_soil_node_m.*boundary_depth_m"),
    "unknown mechanism": ({"mechanisms": {"browsing": False}}, r"unknown mechanism 'browsing'; allowed: moss"),
    "mechanism half on": ({"mechanisms": {"fire": 0.5}}, r"mechanism 'fire': True or False is allowed, got 0.5"),
    "half-life 0": ({"hwp_half_life_years": 0}, r"hwp_half_life_years: .*number.* is allowed, got 0"),
    "half-life of text": ({"hwp_half_life_years": "long"}, r"hwp_half_life_years: .*number.* is allowed, got 'long'"),
    "class of saplings": ({"harvest_min_class": "sapling"}, r"harvest_min_class 'sapling': allowed are young"),
}


def test_years_beyond_the_dates_of_xarray_are_refused():
    pytest.importorskip("xarray")
    with pytest.raises(
        ValueError, match=r'^output "xarray": years in \[1678, 2261\] are allowed, got 2025 to 2264; "dai'
    ):
        simulate(years=240, output="xarray")


@pytest.mark.parametrize(("arguments", "message"), BAD.values(), ids=BAD)
def test_bad_input_is_refused_with_the_value_and_what_is_allowed(arguments, message):
    with pytest.raises(ValueError, match=message) as refusal:
        simulate(**arguments)
    assert "\n" not in str(refusal.value)


MIDDLE = sim.middle_site()
SEED = sim.episode_seeds(0)


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda s: s.step([12], stands=[0.9]), r"stands: indices in \[0, 2\), each once, are allowed, got \[0.9\]"),
        (lambda s: s.step([12, 12], stands=np.array([True, False])), "stands: indices in"),
        (lambda s: s.step([12, 12], stands=[0, 0]), "stands: indices in"),
        (lambda s: s.step([12], stands=[2]), "stands: indices in"),
        (lambda s: s.step([12, 12], days=0), "days: a positive integer is allowed, got 0"),
        (lambda s: s.step([12, 12], days=366), "days = 366: at most 365 are allowed"),
        (lambda s: s.step([12, 12], observed=np.zeros((4380, 5))), r"observed: .* got shape \(4380, 5\)"),
        (lambda s: s.step([12, 12], observed=np.full((4380, 6), np.nan)), "observed: finite floats"),
        (lambda s: s.step([12, 12], observed=np.ones((4380, 6), int)), "observed: finite floats .* of type int64"),
        (lambda s: s.start(0, [{**MIDDLE, "latitude_deg": 640.0}], [SEED]), "latitude_deg = 640 is outside"),
        (lambda s: s.start(0, [{**MIDDLE, "latitude_deg": "64"}], [SEED]), "latitude_deg: a finite number is allowed"),
        (lambda s: s.start(0, [{**MIDDLE, "latitude": 64.0}], [SEED]), "unknown site parameter 'latitude'"),
        (lambda s: s.start(0, [{"latitude_deg": 64.0}], [SEED]), "site: mean_annual_temperature_c is missing"),
        (lambda s: s.start(0, [MIDDLE], [0]), "seeds: sim.Seeds are allowed, as sim.episode_seeds gives them, got 0"),
        (
            lambda s: s.start(0, [MIDDLE], [sim.Seeds(1, None, 1)]),
            r"seeds: weather: an integer in \[0, 2\^63\) .* None",
        ),
        (lambda s: s.start(0, [MIDDLE], [sim.Seeds(-1, 1, 1)]), "seeds: start: an integer in .* got -1"),
        (
            lambda s: s.start(0, [{**MIDDLE, "latitude_deg": (60, 64)}], [SEED]),
            "latitude_deg: a finite number is allowed",
        ),
        (lambda s: s.start(0, [{**MIDDLE, "relative_humidity": True}], [SEED]), "relative_humidity: .* got True"),
        (lambda s: s.start(0, [None], [SEED]), "site: latitude_deg is missing"),
        (lambda s: s.start(0, None, [SEED]), "sites: a list of one for each of 1 stands is allowed, got 0"),
        (lambda s: s.start(0, [MIDDLE], [SEED], observed=5), r"observed: numbers of shape \(0, \d\) are allowed"),
        (lambda s: s.start([0, 1], [MIDDLE], [SEED]), "sites: a list of one for each of 2 stands is allowed, got 1"),
        (lambda s: s.start(0, [MIDDLE], [SEED], {0: {"density": 3}}), "unknown initial stock 'density'"),
        (lambda s: s.start(0, [MIDDLE], [SEED], {5: {}}), r"initial: positions in \[0, 1\) are allowed, got 5"),
    ],
)
def test_stands_are_asked_for_what_there_is(call, message):
    stands = sim.Stands(2, time_step_minutes=120)
    stands.seeds[:] = [SEED, SEED]
    with pytest.raises(ValueError, match=message):
        call(stands)
    assert not stands.years.any() and not stands.state.any()


def test_more_stands_than_any_memory_holds_are_refused():
    with pytest.raises(ValueError, match="at most 10,000,000 are allowed at once, got 1,000,000,000,000"):
        sim.Stands(10**12)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("biomass", [0.5, 5.0, 20.0])
def test_stems_that_are_drawn_hold_the_biomass_that_is_given(seed, biomass):
    first = simulate(seed=seed, initial={"biomass_kgc_m2": biomass}, hold_stand=True)
    assert first.biomass_kgc_m2[0] / first.density_stems_ha[0] * 1e4 < 1.1 * spin_up.LARGEST_STEM_KGC


@pytest.mark.parametrize("seed", [-1, 1.5, True, None])
def test_a_bad_site_seed_is_refused(seed):
    with pytest.raises(ValueError, match="site_seed"):
        sim.sample_site(seed)


@pytest.mark.parametrize("limits", [(25, 61), (50, 100), (60, 61)])
def test_the_last_ages_of_the_classes(limits):
    """The record, and what the observation is made of, agree on the classes."""
    constants = dict(zip(("young_age_limit", "mature_age_limit"), limits, strict=True))
    stands = sim.Stands(1, time_step_minutes=240, constants=constants)
    stands.start([0], [sim.middle_site()], [sim.episode_seeds(1)], {0: {"oldest_age_years": 150.0}})
    record = dict(zip(sim.RECORD_NAMES, stands.step([12])[0], strict=True))
    stems = stands.state[0, -2 * AGES :].reshape(2, AGES)
    edges = [0, 6, 21, limits[0] + 1, limits[1] + 1, AGES]
    expected = [species[low:high].sum() for species in stems for low, high in zip(edges[:-1], edges[1:], strict=True)]
    np.testing.assert_allclose([record[name] for name in SPECIES_AND_CLASSES], expected, rtol=1e-12)
    np.testing.assert_allclose(stands.stocks([0])["age_classes"][0], expected, rtol=1e-12)


# ---------------------------------------------------------------------------------------------------- magnitudes

# Bands of mature stands in the generalist climate: ecosystem respiration and GPP [kgC m-2 yr-1], water [mm], ...
BANDS = {
    "gpp_kgc_m2": (0.4, 0.8),
    "respiration": (0.35, 0.75),
    "evapotranspiration_mm": (150.0, 280.0),
    "peak_swe_mm": (40.0, 120.0),
    "snow_off_doy": (98.0, 145.0),
}


@pytest.fixture(scope="module")
def mature_stands():
    number = 32
    stands = sim.Stands(number, time_step_minutes=60, mechanisms={"fire": False})
    mature = {
        "density_stems_ha": 1000.0,
        "conifer_fraction": 0.6,
        "biomass_kgc_m2": 7.0,
        "soil_kgc_m2": 8.0,
        "oldest_age_years": 110.0,
    }
    sites = [sim.sample_site(k) for k in range(number)]
    stands.start(
        np.arange(number), sites, [sim.episode_seeds(k) for k in range(number)], dict.fromkeys(range(number), mature)
    )
    years = [pd.DataFrame(stands.step(np.full(number, 12)), columns=sim.RECORD_NAMES) for _ in range(3)]
    mean = sum(years) / len(years)
    return mean.assign(respiration=mean.autotrophic_respiration_kgc_m2 + mean.heterotrophic_respiration_kgc_m2)


@pytest.mark.parametrize(("name", "band"), BANDS.items(), ids=BANDS)
def test_the_median_of_mature_stands_is_boreal(mature_stands, name, band):
    low, high = band
    assert low <= mature_stands[name].median() <= high


def test_mature_stands_are_ordered_as_in_nature(mature_stands):
    m = mature_stands
    assert (m.summer_albedo < m.winter_albedo).all()
    assert m.surface_soil_temperature_c.mean() > m.air_temperature_c.mean()
    efficiency = 1.0 - m.autotrophic_respiration_kgc_m2 / m.gpp_kgc_m2
    assert 0.35 / 2.0 <= efficiency.median() <= 0.8
    assert (m.evapotranspiration_mm < m.precipitation_mm + 150.0).all()
    assert m.air_temperature_c.between(-11.5, -3.5).all()
