"""Is the simulator's ground fine enough? Its two soil nodes beside a column of 30 layers, its step of 30 minutes
beside others, and its boundary at other depths.

    python analysis/validation/soil_column.py

Stands of several sites live under three policies. In every step each scheme below sees the organic layer that the
simulator's soil sees, and conducts heat down to the boundary with the simulator's freezing curve, conductivities and
capacities, after a spin-up of its own: what differs between schemes is discretisation. Steps and boundary depths are
compared by running the simulator, on the same weather; snow's density has a step of a day in all of them. Thaw
returns here are sums of the reward before its clip.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import paths
from analysis.validation.conduction import Above, Column, Grid, Ground, layer_mean, spun_up, thawed_depth
from analysis.validation.surface import RecordedStands
from cleanrl_style import protocol
from sim.parameters import CONSTANTS
from sim.stands import available_cores
from sim.state import PARAMETER_NAMES

POLICIES = {"zero change": 12, "+100 conifers": 24, "+100 deciduous": 20}
NO_POLICY = "zero change"  # what the others' effects are differences from
STEP_MINUTES = (5, 30, 60, 120)
BOUNDARY_DEPTHS_M = (10.0, 12.0, 15.0, 20.0)
TALIK_M = 2.0  # mean depth of thaw beyond which a stand is not counted in the active layer's error
LAYER_EDGES_M = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.4, 1.7)
LAYER_EDGES_M += (2.0, 2.5, 3.0, 3.5, *map(float, range(4, 13)))
SURFACE_DEPTH, DEEP_NODE, BOUNDARY = (
    CONSTANTS[name].low for name in ("surface_soil_depth_m", "deep_soil_node_m", "boundary_depth_m")
)

#: Schemes by name; the first is what the others are compared with.
SCHEMES = {
    "30 layers": Grid(LAYER_EDGES_M),
    "15 layers": Grid(LAYER_EDGES_M[::2]),
    "two nodes: the simulator's": Grid((0.0, SURFACE_DEPTH, BOUNDARY), (0.5 * SURFACE_DEPTH, DEEP_NODE), closures=True),
    "two nodes: 0-0.5 m, 0.5-5 m": Grid((0.0, 0.5, 5.0)),
    "two nodes: 0-0.9 m, node at 3 m": Grid((0.0, 0.9, BOUNDARY), (0.45, 3.0)),
}

#: Quantities that time steps are compared by: name and unit -> column.
QUANTITIES = {
    "thaw return": "thaw_return",
    "heat into the boundary [MJ m-2 yr-1]": "boundary_warming_mj_m2",
    "heat out of it [MJ m-2 yr-1]": "boundary_cooling_mj_m2",
    "active layer [m]": "active_layer_depth_m",
    "surface soil [degC]": "surface_soil_temperature_c",
    "GPP [kgC m-2 yr-1]": "gpp_kgc_m2",
    "evapotranspiration [mm yr-1]": "evapotranspiration_mm",
    "peak snow [mm]": "peak_swe_mm",
    "snow-off [day of year]": "snow_off_doy",
}


@dataclass
class Args:
    """Compares the simulator's two soil nodes with a column of layers, its time step and boundary with others."""

    sites: int = 8
    """sites, each under three policies"""
    first_site: int = 100
    """seed of the first site and of its weather; the simulator's nodes were chosen on seeds 0 to 7 and 108 to 123"""
    years: int = 50
    """length of an episode"""
    output_dir: Path = Path("results/soil_column")
    """folder for schemes.csv, time_steps.csv and boundary_depths.csv, one row a stand"""


# --------------------------------------------------------------------------------------------------------- runs


def thaw_return(warming, cooling) -> np.ndarray:
    """Sum over years of the thaw reward; heat into and out of the boundary [MJ m-2 yr-1], (.., years) each."""
    return boreal_env.thaw_reward(cooling, warming, boreal_env.Reward(), "asymmetric").sum(axis=-1)


def start(args: Args, kind=sim.Stands, **options) -> tuple[sim.Stands, pd.MultiIndex, np.ndarray]:
    """Stands of every site and policy at their beginning, their names, and their actions."""
    seeds = [args.first_site + k for k in range(args.sites) for _ in POLICIES]
    stands = kind(len(seeds), **options)
    stands.start(np.arange(len(seeds)), [sim.sample_site(s) for s in seeds], [sim.episode_seeds(s) for s in seeds])
    names = pd.MultiIndex.from_arrays([seeds, list(POLICIES) * args.sites], names=["site", "policy"])
    return stands, names, np.array(list(POLICIES.values()) * args.sites)


def record_means(records: list[np.ndarray], names: pd.MultiIndex) -> pd.DataFrame:
    """Means over the years of the annual records, (stands, columns) each, and thaw returns; a row a stand."""
    columns = dict(zip(sim.RECORD_NAMES, np.stack(records).transpose(2, 1, 0), strict=True))
    means = pd.DataFrame({name: values.mean(axis=1) for name, values in columns.items()}, index=names)
    means["thaw_return"] = thaw_return(columns["boundary_warming_mj_m2"], columns["boundary_cooling_mj_m2"])
    return means


def simulate(args: Args, **options) -> pd.DataFrame:
    """The simulator's means over the years, a row a stand."""
    stands, names, actions = start(args, **options)
    return record_means([stands.step(actions) for _ in range(args.years)], names)


def run_year(column: Column, above: Above) -> tuple[float, float, float, np.ndarray]:
    """Heat into the boundary and out of it [MJ m-2], deepest thaw [m], mean temperatures [degC], (layers,)."""
    daily, (_, warming, cooling) = column.run(above)
    thawed = thawed_depth(daily, column.grid.depths)
    return warming, cooling, thawed.max(), daily.mean(axis=0)


def run_schemes(args: Args, schemes: dict[str, Grid]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Every scheme's means over the years, by (scheme, site, policy), and the simulator's that drives them.

    `reference_c` is the temperature of the first scheme at the depths that a row's surface soil has.
    """
    stands, names, actions = start(args, RecordedStands)
    grounds = [Ground.of(dict(zip(PARAMETER_NAMES, row, strict=True))) for row in stands.parameters]
    records, years = [], []
    with ThreadPoolExecutor(available_cores()) as pool:
        surfaces = map(Above, *stands.climate_year())
        columns = list(pool.map(lambda g, s: [spun_up(grid, g, s) for grid in schemes.values()], grounds, surfaces))
        for _ in range(args.years):
            record = stands.step(actions)
            surfaces = map(Above, *stands.surface)
            years.append(list(pool.map(lambda cs, s: [run_year(column, s) for column in cs], columns, surfaces)))
            records.append(record)
    rows = {}
    for k, (name, grid) in enumerate(schemes.items()):
        few = len(grid.depths) == 2
        depth = grid.edges[1] if few else SURFACE_DEPTH
        for stand, (site, policy) in enumerate(names):
            warming, cooling, thawed, profiles = map(np.array, zip(*(year[stand][k] for year in years), strict=True))
            reference = np.array([year[stand][0][-1] for year in years])
            rows[name, site, policy] = {
                "boundary_warming_mj_m2": warming.mean(),
                "boundary_cooling_mj_m2": cooling.mean(),
                "thaw_return": thaw_return(warming, cooling),
                "active_layer_depth_m": np.nan if few else thawed.mean(),
                "surface_soil_temperature_c": layer_mean(profiles, grid.edges, depth).mean(),
                "reference_c": layer_mean(reference, LAYER_EDGES_M, depth).mean(),
            }
    table = pd.DataFrame.from_dict(rows, orient="index").rename_axis(["scheme", *names.names])
    return table, record_means(records, names)


def layers_to(boundary: float) -> Grid:
    """The 15-layer grid, down to another boundary depth."""
    deeper = np.linspace(LAYER_EDGES_M[-1], boundary, int(np.ceil((boundary - LAYER_EDGES_M[-1]) / 2.0)) + 1)[1:]
    return Grid((*(z for z in LAYER_EDGES_M[::2] if z <= boundary), *deeper), boundary=boundary)


# --------------------------------------------------------------------------------------------------- comparison


def rms(x) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


def policy_effects(values: pd.Series) -> np.ndarray:
    """Differences from no policy on the same site; values by (site, policy)."""
    by_policy = values.unstack("policy")
    return by_policy.drop(columns=NO_POLICY).sub(by_policy[NO_POLICY], axis=0).to_numpy().ravel()


def thaw_skill(values: pd.Series, reference: pd.Series) -> dict[str, float]:
    """Errors of thaw returns by (site, policy), and of the policies' effects on them."""
    error, effect, true = values - reference, policy_effects(values), policy_effects(reference)
    return {
        "thaw return": values.mean(),
        "bias": error.mean(),
        "rms": rms(error),
        "median abs": error.abs().median(),
        "policies: slope": effect @ true / (true @ true),
        "policies: rms": rms(effect - true),
    }


def scheme_table(schemes: pd.DataFrame) -> pd.DataFrame:
    """The schemes beside the first, over all stands."""
    reference = schemes.loc[next(iter(SCHEMES))]
    permafrost = reference["active_layer_depth_m"] < TALIK_M
    lines = []
    for name in schemes.index.unique("scheme"):
        rows = schemes.loc[name]
        warmth = rows["surface_soil_temperature_c"] - rows["reference_c"]
        depth = (rows["active_layer_depth_m"] - reference["active_layer_depth_m"])[permafrost]
        lines.append(
            {
                "scheme": name,
                "into boundary": rows["boundary_warming_mj_m2"].mean(),
                "out": rows["boundary_cooling_mj_m2"].mean(),
                **thaw_skill(rows["thaw_return"], reference["thaw_return"]),
                "surface soil [K]": warmth.mean(),
                "rms [K]": rms(warmth),
                "active layer [m]": depth.mean(),
                "rms [m]": rms(depth),
            }
        )
    return pd.DataFrame(lines)


def step_table(steps: pd.DataFrame) -> pd.DataFrame:
    """Bias and rms of every quantity, and of the policies' effects on thaw, beside the finest step's."""
    finest = steps.loc[STEP_MINUTES[0]]
    lines = {name: {f"{STEP_MINUTES[0]} min": f"{finest[column].mean():.4g}"} for name, column in QUANTITIES.items()}
    effects = policy_effects(finest["thaw_return"])
    lines["policies' effect on thaw, rms"] = {f"{STEP_MINUTES[0]} min": f"{rms(effects):.4g}"}
    for minutes in STEP_MINUTES[1:]:
        of = steps.loc[minutes]
        errors = [of[column] - finest[column] for column in QUANTITIES.values()]
        errors.append(policy_effects(of["thaw_return"]) - effects)
        for line, error in zip(lines.values(), errors, strict=True):
            line[f"{minutes} min"] = f"{error.mean():+.2g} ± {rms(error):.2g}"
    return pd.DataFrame.from_dict(lines, orient="index").rename_axis("quantity").reset_index()


def boundary_table(depths: pd.DataFrame) -> pd.DataFrame:
    """Thaw returns with the boundary at every depth beside those with the simulator's; by (depth, site, policy)."""
    lines = []
    for boundary in BOUNDARY_DEPTHS_M:
        line = {"boundary [m]": f"{boundary:g}"}
        for name in depths:
            skill = thaw_skill(depths[name].loc[boundary], depths[name].loc[BOUNDARY])
            line |= {f"{name}: {of}": skill[of] for of in ("thaw return", "rms", "policies: slope", "policies: rms")}
        lines.append(line)
    return pd.DataFrame(lines)


def markdown(table: pd.DataFrame) -> str:
    """The table in Markdown, numbers with two decimals."""
    cells = [[f"{x:.2f}" if isinstance(x, float) else x for x in row] for row in table.to_numpy(dtype=object)]
    return "\n".join("| " + " | ".join(row) + " |" for row in ([*table.columns], ["---"] * table.shape[1], *cells))


def main(args: Args) -> None:
    """Run the three comparisons, print their tables, and write what they are made of."""
    paths.make_writable("--output-dir", args.output_dir)
    deeper = {f"to {boundary:g} m": layers_to(boundary) for boundary in BOUNDARY_DEPTHS_M}
    schemes, simulated = run_schemes(args, SCHEMES | deeper)
    depths = pd.DataFrame(
        {
            "simulator": pd.concat(
                {z: simulate(args, constants={"boundary_depth_m": z}) for z in BOUNDARY_DEPTHS_M},
                names=["boundary_depth_m"],
            )["thaw_return"],
            "15 layers": pd.concat(
                {z: schemes.loc[name] for name, z in zip(deeper, BOUNDARY_DEPTHS_M, strict=True)},
                names=["boundary_depth_m"],
            )["thaw_return"],
        }
    )
    itself = simulated.assign(reference_c=schemes.loc["two nodes: the simulator's"]["reference_c"])[schemes.columns]
    schemes = pd.concat([schemes.loc[list(SCHEMES)], pd.concat({"the simulator itself": itself}, names=["scheme"])])
    steps = pd.concat({m: simulate(args, time_step_minutes=m) for m in STEP_MINUTES}, names=["minutes"])

    effects = policy_effects(simulated["thaw_return"])
    print(
        f"{len(simulated)} stands, {args.years} years; the policies change the simulator's thaw return by "
        f"{effects.mean():+.2f}, rms {rms(effects):.2f}"
    )
    for table in (scheme_table(schemes), step_table(steps), boundary_table(depths)):
        print(f"\n{markdown(table)}")
    steps = steps[[*QUANTITIES.values()]]
    for name, table in {"schemes": schemes, "time_steps": steps, "boundary_depths": depths}.items():
        with protocol.replacing(args.output_dir / f"{name}.csv") as file:
            table.to_csv(file, float_format="%.6g", lineterminator="\n")


if __name__ == "__main__":
    main(protocol.parse(Args))
