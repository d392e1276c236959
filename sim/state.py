"""What a block of stands carries: one numpy record, each field an array over the block's lanes.

A lane is one stand. All records nest in one, so that the compiler sees that fields do not overlap and treats
eight lanes at a time. `block_dtype(16)` steps sixteen stands in lockstep, `block_dtype(1)` a single one, with the
same source.
"""

import functools

import numpy as np

from sim.assortment import PRODUCTS
from sim.demography import AGE_CLASSES, AGES
from sim.parameters import CONSTANTS, MECHANISMS, SITE_PARAMETERS
from sim.physical_constants import DAYS_PER_YEAR
from sim.scenario import WITHOUT_SCENARIO

DAYS = DAYS_PER_YEAR

#: State that lasts from year to year: name -> (unit, meaning).
STATE = {
    "conifer_biomass": ("kgC m-2", "carbon of living conifers"),
    "deciduous_biomass": ("kgC m-2", "carbon of living deciduous trees"),
    "soil_carbon": ("kgC m-2", "carbon of litter and soil"),
    "conifer_deadwood": ("kgC m-2", "carbon of dead conifer stems"),
    "deciduous_deadwood": ("kgC m-2", "carbon of dead deciduous stems"),
    "products": ("kgC m-2", "carbon of harvested wood products"),
    "organic_depth": ("m", "depth of moss and organic layer"),
    "canopy": ("degC", "canopy temperature, where Newton starts"),
    "trunk": ("degC", "trunk temperature"),
    "trunk_capacity": ("J m-2 K-1", "heat capacity of the trunks"),
    "ground": ("degC", "temperature of the snow surface, or of the ground's skin"),
    "organic_heat": ("J m-2", "enthalpy of the organic layer"),
    "organic_water": ("mm", "water and ice of the organic layer"),
    "surface_heat": ("J m-2", "enthalpy of the surface soil"),
    "deep_heat": ("J m-2", "enthalpy of the deep soil"),
    "swe": ("mm", "snow on the ground, as water"),
    "snow_density": ("kg m-3", "density of the snow"),
    "albedo": ("1", "albedo of the snow"),
    "canopy_rain": ("mm", "rain held by the canopy"),
    "canopy_snow": ("mm", "snow held by the canopy"),
    "soil_water": ("mm", "water in the soil bucket"),
    "drought": ("mm", "running drought index"),
    "acclimation": ("degC", "temperature that photosynthesis is acclimated to"),
}

#: A year's random numbers, as `sim.draws.draw_years` draws them: name -> (per day?, distribution, stream).
DRAWS = {
    "temperature_noise": (True, "normal", "weather"),
    "wet_dice": (True, "uniform", "weather"),
    "wet_amount": (True, "exponential", "weather"),
    "wind_noise": (True, "normal", "wind"),
    "fire_dice": (True, "uniform", "disturbance"),
    "fire_kill": (False, "uniform", "disturbance"),
    "fire_depth": (False, "uniform", "disturbance"),
    "insect_dice": (False, "uniform", "disturbance"),
    "mortality_dice": (False, "uniform", "disturbance"),
}

#: The annual record: name -> (unit, meaning). Sums, means, extremes or end-of-year stocks, as the meaning says.
RECORD = {
    "density_stems_ha": ("stems ha-1", "stems at the year's end"),
    "conifer_fraction": ("1", "conifers among the stems at the year's end"),
    **{
        f"{species}_{age}_stems_ha": ("stems ha-1", f"{species} stems of class {age} at the year's end")
        for species in ("conifer", "deciduous")
        for age in AGE_CLASSES
    },
    "biomass_kgc_m2": ("kgC m-2", "living trees at the year's end"),
    "soil_kgc_m2": ("kgC m-2", "litter and soil at the year's end"),
    "conifer_deadwood_kgc_m2": ("kgC m-2", "dead conifer stems at the year's end"),
    "deciduous_deadwood_kgc_m2": ("kgC m-2", "dead deciduous stems at the year's end"),
    "hwp_kgc_m2": ("kgC m-2", "stock of wood products at the year's end"),
    "gpp_kgc_m2": ("kgC m-2", "gross primary production, of trees and understorey"),
    "autotrophic_respiration_kgc_m2": ("kgC m-2", "respiration of trees and understorey"),
    "heterotrophic_respiration_kgc_m2": ("kgC m-2", "respiration of litter, dead wood and soil"),
    "litterfall_kgc_m2": ("kgC m-2", "litter from living trees to the soil"),
    "understorey_gpp_kgc_m2": ("kgC m-2", "gross primary production of the understorey alone"),
    "understorey_litter_kgc_m2": ("kgC m-2", "net production of the understorey, all of it litter, to the soil"),
    "mortality_kgc_m2": (
        "kgC m-2",
        "carbon of trees that died of age, crowding or insects, or was left when the last stem went",
    ),
    "fire_mortality_kgc_m2": ("kgC m-2", "carbon of trees killed by fire and not burned"),
    "dead_litter_kgc_m2": ("kgC m-2", "leaves and branches of the trees that died or that fire killed, to the soil"),
    "conifer_deadwood_input_kgc_m2": ("kgC m-2", "stems of the conifers that died or that fire killed, to dead wood"),
    "deciduous_deadwood_input_kgc_m2": (
        "kgC m-2",
        "stems of the deciduous trees that died or that fire killed, to dead wood",
    ),
    "conifer_deadwood_decay_kgc_m2": ("kgC m-2", "decay of dead conifer stems, to the soil, which respires most of it"),
    "deciduous_deadwood_decay_kgc_m2": ("kgC m-2", "decay of dead deciduous stems, to the soil"),
    "deadwood_respiration_kgc_m2": ("kgC m-2", "heterotrophic respiration of what dead stems leave"),
    "fire_loss_kgc_m2": ("kgC m-2", "carbon burned, trees, dead wood and organic layer"),
    "burned_trees_kgc_m2": ("kgC m-2", "carbon burned of living trees"),
    "burned_soil_kgc_m2": ("kgC m-2", "carbon burned of litter and soil"),
    "conifer_deadwood_burned_kgc_m2": ("kgC m-2", "carbon burned of dead conifer stems"),
    "deciduous_deadwood_burned_kgc_m2": ("kgC m-2", "carbon burned of dead deciduous stems"),
    "harvest_kgc_m2": ("kgC m-2", "carbon of trees cut"),
    "harvest_emission_kgc_m2": ("kgC m-2", "carbon of trees cut that is lost at harvest"),
    **{
        f"{species}_{product}_kgc_m2": ("kgC m-2", f"{product.replace('_', ' ')} of {species} trees cut")
        for species in ("conifer", "deciduous")
        for product in PRODUCTS
    },
    "hwp_decay_kgc_m2": ("kgC m-2", "carbon lost by decaying products"),
    "net_carbon_change_kgc_m2": ("kgC m-2", "change of biomass, dead wood, soil and products"),
    "precipitation_mm": ("mm", "rain and snow"),
    "snowfall_mm": ("mm", "snowfall, as water"),
    "evapotranspiration_mm": ("mm", "transpiration, evaporation and sublimation"),
    "transpiration_mm": ("mm", "transpiration, through leaves"),
    "floor_evaporation_mm": ("mm", "evaporation of moss and understorey, snow-free"),
    "runoff_mm": ("mm", "water beyond the bucket's capacity"),
    "sublimation_mm": ("mm", "snow sublimated, canopy and ground"),
    "canopy_sublimation_mm": ("mm", "snow sublimated from the canopy"),
    "peak_swe_mm": ("mm", "largest snowpack of a day"),
    "peak_snow_depth_m": ("m", "deepest snow of a day's end"),
    "snow_off_doy": ("day of year", "day after the last snow of spring"),
    "snow_days": ("day", "days with snow"),
    "shortwave_mj_m2": ("MJ m-2", "incoming shortwave"),
    "net_radiation_mj_m2": ("MJ m-2", "net radiation of the stand"),
    "sensible_heat_mj_m2": ("MJ m-2", "sensible heat to the air"),
    "latent_heat_mj_m2": ("MJ m-2", "latent heat to the air"),
    "ground_shortwave_mj_m2": ("MJ m-2", "shortwave absorbed by ground and snow, less what the understorey stores"),
    "air_temperature_c": ("degC", "annual mean of the air"),
    "ground_temperature_c": ("degC", "annual mean of snow surface or skin"),
    "soil_top_temperature_c": ("degC", "annual mean at the top of the mineral soil"),
    "surface_soil_temperature_c": ("degC", "annual mean of the surface soil"),
    "deep_soil_temperature_c": ("degC", "annual mean of the deep soil"),
    "active_layer_depth_m": ("m", "deepest thaw, from the organic surface"),
    "upper_ground_heat_mj_m2": ("MJ m-2", "heat of the upper 3 m, annual mean; 0 is thawed soil of 0 degC"),
    "upper_ground_heat_end_mj_m2": ("MJ m-2", "heat of the upper 3 m at the year's end"),
    "upper_ground_temperature_c": ("degC", "annual mean of the upper 3 m"),
    "permafrost_top_temperature_c": ("degC", "annual mean at the depth of the deepest thaw"),
    "boundary_warming_mj_m2": ("MJ m-2", "heat into the permafrost boundary"),
    "boundary_cooling_mj_m2": ("MJ m-2", "heat out of the permafrost boundary"),
    "advected_heat_mj_m2": ("MJ m-2", "heat that cold snow and warm rain brought, less what vapour and drainage took"),
    "deep_heat_gain_mj_m2": ("MJ m-2", "heat gained by the deep soil"),
    "growing_season_days": ("day", "days with a mean of the air above 5 degC"),
    "crown_cover": ("1", "share of the ground under crowns in the year, after a fire what is left"),
    "max_lai": ("m2 m-2", "largest leaf area"),
    "summer_albedo": ("1", "albedo of June to August"),
    "winter_albedo": ("1", "albedo of December to March"),
    "drought_index": ("mm", "largest drought index of the year"),
    "organic_layer_m": ("m", "depth of moss and organic layer at the year's end"),
    "fire_mortality": ("1", "share of stems killed by fire"),
    "insect_mortality": ("1", "share of stems killed by insects"),
    "planted_stems_ha": ("stems ha-1", "stems planted"),
    "thinned_stems_ha": ("stems ha-1", "stems cut"),
    "dead_stems_ha": ("stems ha-1", "stems that died of age, crowding or insects"),
    "recruited_stems_ha": ("stems ha-1", "seedlings that came by themselves"),
    "density_after_action": ("stems ha-1", "stems after planting and thinning"),
    "conifer_fraction_after_action": ("1", "conifers among the stems after planting and thinning"),
    "harvestable_stems_ha": ("stems ha-1", "stems that could be cut, before the action"),
    "biomass_change_kgc_m2": ("kgC m-2", "change of biomass"),
    "soil_change_kgc_m2": ("kgC m-2", "change of soil carbon"),
    "hwp_stored_kgc_m2": ("kgC m-2", "carbon added to products: a share of all that is cut, whatever it is sold as"),
    "growth_heat_mj_m2": ("MJ m-2", "heat of wood that grew or went, at the trunks' temperature"),
    "energy_residual_w_m2": ("W m-2", "energy: largest failure of a step to close"),
    "canopy_residual_w_m2": ("W m-2", "largest imbalance left by Newton"),
    "water_residual_mm": ("mm", "water: largest failure of a step to close"),
    "carbon_residual_kgc_m2": ("kgC m-2", "carbon: largest failure of a step to close"),
    "annual_carbon_residual_kgc_m2": ("kgC m-2", "carbon: failure of the year to close, all fluxes"),
    "stems_residual_ha": ("stems ha-1", "stems: failure of the year to close"),
}

#: What every stock of carbon gains and loses in a year, as columns of the record: stock -> (gains, losses). Nothing
#: else moves it: its change from a row to the next is the gains less the losses. Recruits and seedlings bring none.
CARBON_BUDGETS = {
    "biomass_kgc_m2": (
        ("gpp_kgc_m2",),
        (
            "autotrophic_respiration_kgc_m2",
            "understorey_litter_kgc_m2",
            "litterfall_kgc_m2",
            "mortality_kgc_m2",
            "fire_mortality_kgc_m2",
            "burned_trees_kgc_m2",
            "harvest_kgc_m2",
        ),
    ),
    "soil_kgc_m2": (
        (
            "litterfall_kgc_m2",
            "understorey_litter_kgc_m2",
            "dead_litter_kgc_m2",
            "conifer_deadwood_decay_kgc_m2",
            "deciduous_deadwood_decay_kgc_m2",
        ),
        ("heterotrophic_respiration_kgc_m2", "burned_soil_kgc_m2"),
    ),
    **{
        f"{species}_deadwood_kgc_m2": (
            (f"{species}_deadwood_input_kgc_m2",),
            (f"{species}_deadwood_decay_kgc_m2", f"{species}_deadwood_burned_kgc_m2"),
        )
        for species in ("conifer", "deciduous")
    },
    "hwp_kgc_m2": (("hwp_stored_kgc_m2",), ("hwp_decay_kgc_m2",)),
}

#: Daily output: name -> (unit, meaning).
DAILY = {
    "air_temperature_c": ("degC", "mean of the air"),
    "precipitation_mm": ("mm", "rain and snow"),
    "gpp_kgc_m2": ("kgC m-2", "gross primary production, of trees and understorey"),
    "autotrophic_respiration_kgc_m2": ("kgC m-2", "respiration of trees and understorey"),
    "heterotrophic_respiration_kgc_m2": ("kgC m-2", "respiration of litter, dead wood and soil"),
    "shortwave_mj_m2": ("MJ m-2", "incoming shortwave"),
    "net_radiation_mj_m2": ("MJ m-2", "net radiation of the stand"),
    "sensible_heat_mj_m2": ("MJ m-2", "sensible heat to the air"),
    "latent_heat_mj_m2": ("MJ m-2", "latent heat to the air"),
    "ground_heat_mj_m2": ("MJ m-2", "heat from the ground's surface into the soil"),
    "boundary_heat_mj_m2": ("MJ m-2", "heat into the permafrost boundary, less heat out of it"),
    "evapotranspiration_mm": ("mm", "transpiration, evaporation and sublimation"),
    "runoff_mm": ("mm", "water beyond the bucket's capacity"),
    "swe_mm": ("mm", "snow on the ground at the day's end, as water"),
    "canopy_snow_mm": ("mm", "snow held by the canopy at the day's end"),
    "soil_water_mm": ("mm", "water in the soil bucket at the day's end"),
    "canopy_temperature_c": ("degC", "mean of the canopy"),
    "ground_temperature_c": ("degC", "mean of snow surface or skin"),
    "surface_soil_temperature_c": ("degC", "mean of the surface soil"),
    "deep_soil_temperature_c": ("degC", "mean of the deep soil"),
    "albedo": ("1", "reflected over incoming shortwave; no number without light"),
    "lai": ("m2 m-2", "leaf area of both species"),
    "organic_layer_m": ("m", "depth of moss and organic layer"),
    "soil_top_temperature_c": ("degC", "mean at the top of the mineral soil"),
    "snow_depth_m": ("m", "depth of the snow at the day's end"),
    "organic_water_mm": ("mm", "water and ice of the organic layer at the day's end"),
    "organic_temperature_c": ("degC", "mean in the middle of the organic layer"),
}

#: Columns of an observed forcing, in order.
FORCING = (
    "air_temperature_c",
    "relative_humidity",
    "wind_speed_m_s",
    "shortwave_w_m2",
    "longwave_w_m2",
    "precipitation_mm",
)


#: What a step, a day or a year computes and hands on; nothing here lasts beyond the year. The process that sets a name
#: says what it is: grep "w.NAME" sim/*.py. *_sum: over the day's steps. *_before: a stock at the start of the year, of
#: energy and water at that of the step. winter_up and winter_down: December to March; winter_air and winter_days: to
#: February.
_WORK = """
above_deep_node advected air air_density air_emission air_sum amplitude anomaly bare_gain biomass_before
boundary_conductance canopy_air canopy_log canopy_melt canopy_sublimation canopy_sum canopy_sw cos_latitude cos_peak
cos_warmest cos_zenith cover_conifer cover_deciduous crown_area deep deep_base deep_by_surface deep_conductance
deep_frozen deep_latent deep_sum deep_thawed deficit density_change diffuse dry_coefficient
emissivity energy_before energy_gain extraterrestrial first_cut_age fixed frozen_ratio gpp_conifer
gpp_deciduous ground_base ground_by_canopy ground_by_emission ground_conductance ground_exchange ground_latent
ground_log ground_new ground_sum ground_sw ground_velocity ground_wind half_surface high humidity infiltration
lai_conifer lai_deciduous latent_slope leaf_coefficient leaf_conifer leaf_deciduous leaf_rate light_use_conifer
light_use_deciduous log_q10 longwave_cover low mean_temperature melt_span mix net optical_conifer
optical_deciduous per_below_deep_node per_rain_capacity precipitation precipitation_step products_before products_decay
rain rain_capacity reflected reflected_sum residual saturation_slope share_conifer shortwave shortwave_sum sin_latitude
sin_peak sin_warmest sky sky_conifer sky_deciduous snow snow_area snow_efficiency snow_hiding
snow_log snow_resistance snow_wind soil_before soil_heat_sum soil_rate soil_top stems_before stems_gain summer_down
summer_up sun_a sun_b surface surface_base surface_conductance surface_frozen surface_latent
surface_sum surface_thawed thaw_seconds thaw_warmth
top_of_canopy top_sum transpiration_conifer transpiration_deciduous trial trunk_air trunk_base trunk_by_canopy
trunk_by_ground trunk_canopy trunk_ground unloading_rate upper_soil vapour vapour_density water_before water_gain
water_stress wet_coefficient wet_limit wind_below winter_air winter_days winter_down winter_up wood_rate
floor_water layer_share organic organic_base organic_by_ground organic_conductance organic_sum surface_by_organic
snow_optical_deciduous surface_new thaw_water wind
co2_growth co2_stomata dry_air_conifer dry_air_deciduous efficiency_conifer efficiency_deciduous efficiency_understorey
deadwood_before gpp_understorey mean_deficit photons ready_conifer ready_deciduous
""".split()


PARAMETER_NAMES = (*SITE_PARAMETERS, *CONSTANTS, *MECHANISMS, "weather_as_observed", *WITHOUT_SCENARIO)
STATE_NAMES = tuple(STATE)
#: Columns of the annual record, in order.
RECORD_NAMES = tuple(RECORD)
DAILY_NAMES = tuple(DAILY)
STATE_SIZE = len(STATE) + 2 * AGES
DRAWS_SIZE = sum(DAYS if daily else 1 for daily, *_ in DRAWS.values())


@functools.cache
def block_dtype(lanes: int) -> np.dtype:
    """dtype of a block of stands: records `p` (parameters), `s` (state), `d` (draws), `r` (record), `w` (work)."""
    lane, by_age, by_day = (lanes,), (AGES, lanes), (DAYS, lanes)
    parameters = [(name, "f8", lane) for name in PARAMETER_NAMES]
    stems = [(f"{species}_stems", "f8", by_age) for species in ("conifer", "deciduous")]
    state = [*((name, "f8", lane) for name in STATE), *stems]
    draws = [(name, "f8", by_day if daily else lane) for name, (daily, *_) in DRAWS.items()]
    sizes = [(f"{species}_size", "f8", by_age) for species in ("conifer", "deciduous")]
    return np.dtype(
        [
            ("p", parameters),
            ("s", state),
            ("d", draws),
            ("r", [(name, "f8", lane) for name in RECORD]),
            ("w", [*((name, "f8", lane) for name in _WORK), *sizes]),
        ]
    )


@functools.cache
def daily_dtype(lanes: int) -> np.dtype:
    """dtype of a day's output of a block of stands."""
    return np.dtype([(name, "f8", (lanes,)) for name in DAILY])
