"""Daily and annual output as an xarray Dataset, with the names, units and attributes of ALMA and CF, for NetCDF.

Daily fluxes are means over the day, on `time` (its start, with bounds); stocks of water and snow are those at the
day's end, and say so (`comment`). Soil temperatures have a `depth` below the top of the mineral soil: between nodes,
interpolate. Annual output keeps the names of `sim.state.RECORD`, on `year`. There is no 29 February.
"""

import json

import numpy as np
import pandas as pd

from sim.physical_constants import FREEZING_POINT_K, SECONDS_PER_DAY

_DAY = 1.0 / SECONDS_PER_DAY
_K, _CARBON, _WATER, _HEAT = ("K", 1.0), ("kg m-2 s-1", _DAY), ("kg m-2 s-1", _DAY), ("W m-2", 1e6 * _DAY)
_AMOUNT, _ONE, _METRE = ("kg m-2", 1.0), ("1", 1.0), ("m", 1.0)
MEAN, END = {"cell_methods": "time: mean"}, {"comment": "at the day's end, the second of time_bnds"}
_BY_PLANTS = "surface_upward_mass_flux_of_carbon_dioxide_expressed_as_carbon_due_to_plant_respiration"
_BY_SOIL = "surface_upward_mass_flux_of_carbon_dioxide_expressed_as_carbon_due_to_heterotrophic_respiration"

#: Daily column -> (ALMA's name or one like it, (unit, factor), CF's standard name or "", of what times). To kelvin,
#: `FREEZING_POINT_K` is added.
VARIABLES = {
    "air_temperature_c": ("Tair", _K, "air_temperature", MEAN),
    "precipitation_mm": ("Precip", _WATER, "precipitation_flux", MEAN),
    "gpp_kgc_m2": ("GPP", _CARBON, "gross_primary_productivity_of_biomass_expressed_as_carbon", MEAN),
    "autotrophic_respiration_kgc_m2": ("AutoResp", _CARBON, _BY_PLANTS, MEAN),
    "heterotrophic_respiration_kgc_m2": ("HeteroResp", _CARBON, _BY_SOIL, MEAN),
    "nee_kgc_m2": ("NEE", _CARBON, "", MEAN),
    "shortwave_mj_m2": ("SWdown", _HEAT, "surface_downwelling_shortwave_flux_in_air", MEAN),
    "net_radiation_mj_m2": ("Rnet", _HEAT, "surface_net_downward_radiative_flux", MEAN),
    "sensible_heat_mj_m2": ("Qh", _HEAT, "surface_upward_sensible_heat_flux", MEAN),
    "latent_heat_mj_m2": ("Qle", _HEAT, "surface_upward_latent_heat_flux", MEAN),
    "ground_heat_mj_m2": ("Qg", _HEAT, "downward_heat_flux_at_ground_level_in_soil", MEAN),
    "boundary_heat_mj_m2": ("Qbot", _HEAT, "", MEAN),
    "evapotranspiration_mm": ("Evap", _WATER, "water_evapotranspiration_flux", MEAN),
    "runoff_mm": ("Runoff", _WATER, "runoff_flux", MEAN),
    "swe_mm": ("SWE", _AMOUNT, "surface_snow_amount", END),
    "canopy_snow_mm": ("SWEVeg", _AMOUNT, "canopy_snow_amount", END),
    "soil_water_mm": ("RootMoist", _AMOUNT, "mass_content_of_water_in_soil", END),
    "canopy_temperature_c": ("VegT", _K, "canopy_temperature", MEAN),
    "ground_temperature_c": ("GroundT", _K, "", MEAN),
    "albedo": ("Albedo", _ONE, "surface_albedo", MEAN),
    "lai": ("LAI", _ONE, "leaf_area_index", MEAN),
    "organic_layer_m": ("OrganicDepth", _METRE, "", END),
    "snow_depth_m": ("SnowDepth", _METRE, "surface_snow_thickness", END),
    "organic_water_mm": ("OrganicMoist", _AMOUNT, "", END),
    "organic_temperature_c": ("OrganicTemp", _K, "", MEAN),
}
#: Daily columns of the soil's temperatures, from the top of the mineral soil down.
PROFILE = ("soil_top_temperature_c", "surface_soil_temperature_c", "deep_soil_temperature_c")
#: Units of our tables as UDUNITS spells them.
UDUNITS = {
    "kgC m-2": "kg m-2",
    "stems ha-1": "ha-1",
    "m2 m-2": "1",
    "day of year": "1",
    "mm": "kg m-2",
    "degN": "degrees_north",
    "degE": "degrees_east",
}


def import_xarray(what: str):
    """xarray, if it is installed. Raises ImportError that says how to install it."""
    try:
        import xarray
    except ImportError as error:
        raise ImportError(f'{what} needs xarray: pip install -e ".[xarray]"') from error
    return xarray


def to_dataset(
    daily: pd.DataFrame, annual: pd.DataFrame, columns: dict, constants: dict, boundary_c: float, about: dict
):
    """The Dataset of a run.

    daily, annual : tables of `sim.simulate`; columns : name -> (unit, meaning) of both; constants : by name;
    boundary_c : temperature of the boundary [degC]; about : attributes of the whole.
    """
    xarray = import_xarray('output="xarray"')
    time = daily.index.to_numpy().astype("datetime64[ns]")
    variables: dict[str, tuple] = {}
    for column, (name, (unit, factor), standard_name, of_times) in VARIABLES.items():
        values = daily[column].to_numpy() * factor + (FREEZING_POINT_K if unit == "K" else 0.0)
        long_name = columns[column][1]
        attributes = {"long_name": long_name, "units": unit, **of_times}
        if standard_name:
            attributes["standard_name"] = standard_name
        variables[name] = ("time", values, attributes)
    profile = np.column_stack([daily[list(PROFILE)], np.full(len(daily), boundary_c)]) + FREEZING_POINT_K
    attributes = {"long_name": "temperature of the mineral soil", "units": "K", "standard_name": "soil_temperature"}
    variables["SoilTemp"] = (("time", "depth"), profile, {**attributes, **MEAN})
    variables["time_bnds"] = (("time", "bnds"), np.stack([time, time + np.timedelta64(1, "D")], axis=1))
    for column in annual.columns.drop("year"):
        unit, meaning = columns[column]
        attributes = {"long_name": f"{meaning}, of the year", "units": UDUNITS.get(unit, unit)}
        variables[f"annual_{column}"] = ("year", annual[column].to_numpy(), attributes)

    depth = [0.0, 0.5 * constants["surface_soil_depth_m"], constants["deep_soil_node_m"], constants["boundary_depth_m"]]
    below = {
        "units": "m",
        "positive": "down",
        "standard_name": "depth",
        "long_name": "below the top of the mineral soil",
    }
    coordinates = {
        "time": ("time", time, {"standard_name": "time", "long_name": "start of the day", "bounds": "time_bnds"}),
        "depth": ("depth", depth, below),
        "year": ("year", annual.index.year.to_numpy(), {"long_name": "year of the annual output", "units": "1"}),
    }
    attributes = {
        "Conventions": "CF-1.10",
        "title": "A boreal stand",
        "source": "BoreaRL simulator (sim.simulate)",
        "references": "https://arxiv.org/abs/2509.19846",
        "comment": "Names as in ALMA. Heat and vapour upward positive, ground heat (Qg), that into the boundary (Qbot) "
        "and net radiation (Rnet) downward; NEE: uptake is negative.",
        **{name: value if isinstance(value, (str, int, float)) else json.dumps(value) for name, value in about.items()},
    }
    dataset = xarray.Dataset(variables, coordinates, attributes)
    for name in ("time", "time_bnds"):
        dataset[name].encoding.update(units=f"days since {time[0].astype('datetime64[D]')}", dtype="int32")
    return dataset
