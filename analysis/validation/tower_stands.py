"""The stands that grow at the towers, from inventories and literature; nothing here is fitted to a flux."""

from dataclasses import dataclass, field

from sim.simulate import HELD_STAND


@dataclass(frozen=True)
class TowerStand:
    """What grows at a tower: overrides of site parameters and constants, the stocks to start from, and the leaf area of
    its trees per ground (within crowns it is what site and crowns make of it)."""

    site: dict[str, float]
    initial: dict[str, float]
    lai: float
    constants: dict[str, float] = field(default_factory=dict)


SE_SVB = TowerStand(
    # Inventory of 2018 (ICOS Sweden, station page of Svartberget): 535 spruces, 415 pines and 112 birches per hectare,
    # about 100 years old, basal area 29.3 m2/ha, top height 20 m.
    site={
        "latitude_deg": 64.256,
        # The record's own annual wave; no permafrost: the boundary has the mean of the soil at 5 cm, 4.2 degC, November
        # and December filled.
        "mean_annual_temperature_c": 2.5,
        "seasonal_amplitude_c": 11.3,
        "deep_boundary_temperature_k": 277.4,
        **HELD_STAND,
    },
    # Needles of the mean stem of each species, 17-21 cm thick and 17 m tall (Marklund 1988), with the specific leaf
    # areas of Harkonen et al. (2015), give the conifers 5; the birches add about 0.4.
    lai=5.4,
    initial={
        "conifer_mature_stems_ha": 950.0,
        "deciduous_mature_stems_ha": 112.0,
        # Marklund (1988), roots by Petersson and Stahl (2006), at the same stems; half of it is carbon.
        "biomass_kgc_m2": 8.7,
        # Assumed: organic layer and mineral soil of a podzol on till, 6-10. Respiration hangs on it, nothing else.
        "soil_kgc_m2": 8.0,
    },
)

US_PRR = TowerStand(
    # Leaf area and height of the 16 felled trees (log-log regression, corrected for its bias) over the 350 spruces of
    # the 0.09 ha census of 2010. Crowns of 0.44 m radius (20 trees) cover 0.21 of the ground, 0.17 with their overlap.
    lai=0.475,
    site={
        "latitude_deg": 65.124,
        "mean_annual_temperature_c": -2.7,  # of 2011-14
        "seasonal_amplitude_c": 19.6,  # first harmonic of ERA-Interim 1989-2014
        "deep_boundary_temperature_k": 272.15,  # permafrost at about -1 degC
        "canopy_roughness_m": 0.37,  # Chu et al. 2021, as used by Ikawa et al. 2024
        **HELD_STAND,
    },
    constants={
        "crown_area_conifer_m2": 0.60,
        "canopy_reference_height_m": 9.5,  # wind at 11 m over a displacement height of 1.46 m (Ikawa et al. 2024)
        # Moss 0.14 m above the sensors' zero (Ikawa et al. 2024) and organic soil to 0.35 m below the surface
        # (Launiainen's set-up of pyAPES for US-Prr): 0.30 by choice; kept there.
        **dict.fromkeys(("organic_depth_conifer_m", "organic_depth_deciduous_m", "organic_depth_open_m"), 0.30),
        # Mean of 16 quadrats: cloudberry, Labrador tea, lingonberry, cottongrass, bog birch.
        "understorey_lai": 0.784,
    },
    initial={
        "conifer_mature_stems_ha": 3889.0,  # 350 spruces on 0.09 ha, 2.4 m tall
        # 0.92 kg/m2 of dry wood and needles above ground, from the same trees; roots 0.222 of it; half is carbon.
        "biomass_kgc_m2": 0.56,
        "soil_kgc_m2": 4.2,  # fibric and deep organic horizons of black spruce (targets of DVM-DOS-TEM)
        "organic_layer_m": 0.30,
    },
)

#: The same without the understorey.
US_PRR_TREES_ALONE = TowerStand(
    site=US_PRR.site, constants={**US_PRR.constants, "understorey_lai": 0.0}, initial=US_PRR.initial, lai=US_PRR.lai
)
