"""What a policy plants over the boreal zone, and what that does to thaw depth and carbon against doing nothing.

    python analysis/studies/boreal_map.py --policy ppo_group-balanced
    python analysis/studies/boreal_map.py --redraw      # the picture only, from the table of before

A stand on every land point of a grid over the latitudes that sites are sampled from, simulated twice by
`sim.simulate_many`, with and without the policy, under the same weather and dice. Climate follows latitude as for
sampled sites, and all else is sampled; `--climate` takes a gridded file instead, which has to span the grid, and of its
land points those that the file has.
Leaves results/studies/boreal_map.csv, a row a point, and docs/images/boreal_map.png. The simulations are kept in
runs/boreal_map, and the same command goes on where it was killed.
"""

import hashlib
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import paths, stored
from analysis.methods import STRATEGIES
from baselines_heuristic import obeying
from cleanrl_style import protocol
from cleanrl_style.protocol.agents import policy_file
from sim.executor import HERE
from sim.management import decode

BALANCED = "boreal-balanced-v0"
LAST = 10  # years that thaw depth is a mean of
FAR = 1.0  # m of change: permafrost gained or lost, without which the depth is the boundary's
LAND = Path(__file__).parents[1] / "observations" / "natural_earth_land_110m.csv.gz"
FIGURE = Path("docs/images/boreal_map.png")
FIRST_SEED = 5_000_000_000  # of the points' sites and dice: beyond those of training and evaluation
VARIABLES = ("planted_stems_ha", "net_carbon_change_kgc_m2", "active_layer_depth_m")
POINT = ["latitude_deg", "longitude_deg"]
WIDEST = 4.0  # spacing [degrees] that the map is still one with
LOWEST_LATITUDE = 48.0  # that is drawn


@dataclass
class Args:
    """Maps what a policy plants, and what that does."""

    policy: str = "ppo_group-balanced"
    """folder of a run, a policy that ships (ppo_group-balanced), or a strategy of baselines_heuristic (plus_100)"""
    preference: float = 0.5
    """weight of carbon"""
    env_id: str | None = None
    """world of the stands (None: the policy's; of a fixed strategy boreal-balanced-v0)"""
    climate: Path | None = None
    """NetCDF file or zarr store of climate over the whole grid (None: by latitude), see sim.sites_on_grid"""
    spacing: float = 0.5
    """of the grid, degrees of latitude; of longitude twice as many"""
    years: int = 50
    """length of the simulations"""
    address: str = HERE
    """where: "none", all cores of this machine; "local", Ray on it; or the address of a Ray cluster"""
    overwrite: bool = False
    """simulate anew what runs/boreal_map keeps, such as of another version of the simulator"""
    redraw: bool = False
    """draw the picture again from results/studies/boreal_map.csv, and simulate nothing"""
    quick: bool = False
    """a spacing of 4 degrees and 3 years, into results/quick/studies"""


def policy_of(args: Args) -> tuple[str, str, Callable]:
    """Name, environment and function of a policy."""
    if args.policy in STRATEGIES:
        module = importlib.import_module(f"baselines_heuristic.{args.policy}")
        return args.policy, args.env_id or BALANCED, obeying(module.policy)
    try:
        policy = protocol.load_policy(args.policy)
    except (FileNotFoundError, ValueError) as error:
        protocol.fail(f"--policy {error}; a fixed strategy is {', '.join(STRATEGIES)}")
    import torch

    torch.set_num_threads(1)  # sums are in one order, whatever the machine; the network is small
    return f"{policy.script}-seed{policy.arguments['seed']}", args.env_id or policy.env_id, policy


def store_of(args: Args, name: str) -> str:
    """Name of a policy's store; trained ones of equal names are told apart by their files."""
    if args.policy in STRATEGIES:
        return name
    return f"{name}-{hashlib.sha256(policy_file(args.policy).read_bytes()).hexdigest()[:8]}"


def outlines() -> list[np.ndarray]:
    """Coastlines, each (points, 2) of longitude and latitude [deg]; one that crosses 180 degrees goes on beyond it."""
    rings = [ring for _, ring in pd.read_csv(LAND).groupby("ring")]
    return [np.column_stack([np.unwrap(ring.longitude_deg, period=360.0), ring.latitude_deg]) for ring in rings]


def on_land(longitude: np.ndarray, latitude: np.ndarray) -> np.ndarray:
    """Whether points are on land: within an odd number of coastlines."""
    from matplotlib.path import Path as Outline

    rings = [Outline(ring) for ring in outlines()]
    inside = np.zeros(len(longitude), dtype=int)
    for turn in (-360.0, 0.0, 360.0):
        points = np.column_stack([longitude + turn, latitude])
        inside += np.sum([ring.contains_points(points) for ring in rings], axis=0)
    return inside % 2 == 1


def axes(spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Latitudes and longitudes of the grid's points."""
    sampled = sim.SITE_PARAMETERS["latitude_deg"]
    return (
        np.arange(sampled.low + spacing / 2, sampled.high, spacing),
        np.arange(-180.0 + spacing, 180.0, 2.0 * spacing),
    )


def sites(args: Args) -> pd.DataFrame:
    """The stands of the map."""
    table = sim.sites_on_grid(*axes(args.spacing), climate=args.climate)
    return table[on_land(table.longitude_deg, table.latitude_deg)].reset_index(drop=True)


def study(args: Args, store: str, env_id: str, world: dict, policy: Callable, folder: Path) -> pd.DataFrame:
    """A row a point: what was planted there [stems ha-1 yr-1], the share of conifers in it, and, less those without the
    policy, thaw depth [m], mean of the last years, and carbon [kgC m-2], sum of all."""
    shared = {
        "years": args.years,
        "seed": FIRST_SEED,
        "others": "sampled",
        "preference": args.preference,
        "variables": VARIABLES,
        "address": args.address,
        "overwrite": args.overwrite,
        **world,
    }
    climate = args.climate.stem if args.climate else "latitude"
    where = f"{args.spacing:g}deg-{args.years}years-{env_id}-{climate}.zarr"
    places = sites(args)
    print(f"{len(places):,} stands, with the policy and without", flush=True)
    acted = sim.simulate_many(places, policy, path=folder / f"{store}-{args.preference:g}-{where}", **shared)
    left = sim.simulate_many(places, path=folder / f"nothing-{args.preference:g}-{where}", **shared)
    planted = acted.planted_stems_ha.to_numpy().astype(float)
    conifers = (planted * decode(acted.action.to_numpy())[1]).sum(axis=1)
    thaw, carbon = (
        (acted[variable] - left[variable]).to_numpy().astype(float)
        for variable in ("active_layer_depth_m", "net_carbon_change_kgc_m2")
    )
    table = places[POINT].assign(
        planted_stems_ha_yr=planted.mean(axis=1),
        conifer_share=np.divide(
            conifers, planted.sum(axis=1), where=planted.any(axis=1), out=np.full(len(planted), np.nan)
        ),
        thaw_depth_change_m=thaw[:, -LAST:].mean(axis=1),
        carbon_change_kgc_m2=carbon.sum(axis=1),
    )
    return table.round(4)


def sentences(table: pd.DataFrame, preference: float, years: int) -> str:
    """The answer."""
    planted, mean = table.planted_stems_ha_yr, table.mean()
    far = table.thaw_depth_change_m.abs() > FAR
    conifers = (planted * table.conifer_share).sum() / max(planted.sum(), 1e-9)
    thaw, carbon = table.thaw_depth_change_m, mean.carbon_change_kgc_m2

    def change(metres):
        return f"{abs(metres):.2f} m {'shallower' if metres < 0 else 'deeper'}"

    most = (
        f" {thaw[far].sum() / thaw.sum():.0%} of that is of the {far.sum():,} stands where it changes by more than "
        f"{FAR:g} m: the depth leaps by metres in years in which the deep soil passes 0 °C."
    )
    return (
        f"At a carbon weight of {preference:g} the policy plants {planted.mean():.0f} stems/ha a year, {conifers:.0%} "
        f"of them conifers. In the last {min(LAST, years)} of {years} years thaw is {change(thaw.median())} than "
        f"without it in the middle one of {len(table):,} stands ({(thaw < 0).mean():.0%} thaw less deep), "
        f"{change(thaw.mean())} in the mean.{most if far.any() else ''} At their end a stand has {abs(carbon):.1f} "
        f"kgC/m2 {'more' if carbon > 0 else 'less'}."
    )


def title(table: pd.DataFrame, settings: dict) -> str:
    """The picture's title."""
    thaw, years = table.thaw_depth_change_m, settings["years"]
    return (
        f"{settings['policy']} of {settings['env_id']}, carbon weight {settings['preference']:g}: "
        f"thaw in the last {min(LAST, years)} of {years} years {thaw.mean():+.2f} m in the mean of {len(table):,} "
        f"stands, {thaw.median():+.2f} m in the middle one"
    )


PANELS = (
    ("planted_stems_ha_yr", "planted, stems/ha a year", "YlGn", False),
    ("conifer_share", "conifers, share of the planted", "BrBG", False),
    ("thaw_depth_change_m", "thaw depth, m against doing nothing", "RdBu_r", True),
    ("carbon_change_kgc_m2", "carbon, kgC/m2 against doing nothing", "PuOr_r", True),
)


def finer(ring: np.ndarray, times: int = 30) -> np.ndarray:
    """The same line of more points: what is straight on a plane of longitude and latitude is not from above."""
    places = np.linspace(0, len(ring) - 1, times * (len(ring) - 1) + 1)
    return np.column_stack([np.interp(places, np.arange(len(ring)), column) for column in ring.T])


def projected(longitude, latitude) -> tuple[np.ndarray, np.ndarray]:
    """The world from above the pole, distances from it as they are [deg]; Greenwich is below."""
    radius, angle = 90.0 - np.asarray(latitude), np.deg2rad(longitude)
    return radius * np.sin(angle), -radius * np.cos(angle)


def draw(table: pd.DataFrame, spacing: float, title: str, path: Path) -> None:
    """A map of each column from above the pole, and below it the same by latitude."""
    import matplotlib.pyplot as plt

    figure, grid = plt.subplots(2, len(PANELS), figsize=(13, 5.2), layout="constrained", height_ratios=(2.6, 1))
    latitudes = np.unique(table.latitude_deg)
    for number, (column, label, colours, signed) in enumerate(PANELS):
        above, below = grid[:, number]
        most = np.nanpercentile(np.abs(table[column]), 97) or 1.0
        low, high = (-most, most) if signed else (0.0, 1.0 if column == "conifer_share" else most)
        outline = plt.Circle((0.0, 0.0), 90.0 - LOWEST_LATITUDE, transform=above.transData)
        for ring in outlines():
            (land,) = above.fill(*projected(*finer(ring).T), color="#e9e6e0", linewidth=0)
            land.set_clip_path(outline)
        cells = cell_values(table, column, spacing)
        image = above.pcolormesh(*cells, cmap=colours, vmin=low, vmax=high, rasterized=True)
        beyond = "both" if signed else "neither"  # 3 % of the stands
        look = {"orientation": "horizontal", "shrink": 0.8, "pad": 0.02, "extend": beyond}
        figure.colorbar(image, ax=above, label=label, **look)
        reach = 90.0 - LOWEST_LATITUDE
        above.set(aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach))
        above.axis("off")
        by_latitude = table.groupby("latitude_deg")[column]
        bands = [by_latitude.quantile(share) for share in (0.1, 0.5, 0.9)]
        below.fill_between(latitudes, bands[0], bands[2], color="#777777", alpha=0.25, linewidth=0)
        below.plot(latitudes, bands[1], color="#222222", lw=1.5)
        if signed:
            below.axhline(0.0, color="#999999", lw=0.8)
        below.set(xlabel="latitude, degN", xlim=(latitudes[0], latitudes[-1]))
        below.spines[["top", "right"]].set_visible(False)
    grid[1, 0].set_ylabel("median, and\n80 % of the stands")
    figure.suptitle(title, fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    with protocol.replacing(path) as file:
        figure.savefig(file, format="png", dpi=150, metadata={"Software": None})
    plt.close(figure)


def cell_values(table: pd.DataFrame, column: str, spacing: float):
    """A column on the whole grid: projected corners of the cells, and their values, missing where no stand is."""
    latitudes, longitudes = axes(spacing)
    values = np.full((len(latitudes), len(longitudes)), np.nan)
    rows = np.searchsorted(latitudes, table.latitude_deg - 1e-6)
    values[rows, np.searchsorted(longitudes, table.longitude_deg - 1e-6)] = table[column]
    corners = (
        np.append(axis - step / 2, axis[-1] + step / 2)
        for axis, step in ((longitudes, 2.0 * spacing), (latitudes, spacing))
    )
    return *projected(*np.meshgrid(*corners)), np.ma.masked_invalid(values)


def main(args: Args) -> None:
    """Simulate, and write table and figure."""
    path = paths.studies(args.quick) / "boreal_map.csv"
    figure = path.with_suffix(".png") if args.quick else FIGURE
    if args.redraw:
        if not path.exists():
            protocol.fail(f"--redraw: no {path} yet; without --redraw it is made")
        table, settings = stored.read(path), stored.settings(path)
        draw(table, settings["spacing"], title(table, settings), figure)
        print(f"wrote {figure}")
        return
    if args.quick:
        args.spacing, args.years = 4.0, 3
    if not 0.0 < args.spacing <= WIDEST:
        protocol.fail(f"--spacing {args.spacing:g}: above 0 to {WIDEST:g} degrees is allowed")
    if args.climate is not None and not args.climate.exists():
        protocol.fail(f"--climate {args.climate}: there is no such file")
    name, env_id, policy = policy_of(args)
    if env_id not in boreal_env.REGISTERED:
        protocol.fail(f"--env-id {env_id}: allowed are {', '.join(boreal_env.REGISTERED)}")
    if boreal_env.REGISTERED[env_id]["mode"] != "generalist":
        protocol.fail(f"--env-id {env_id}: it is of one site; a generalist's is allowed")
    if len(boreal_env.REGISTERED[env_id].get("objectives", ("carbon", "thaw"))) > 2:
        protocol.fail(f"--env-id {env_id}: it has more than two objectives, and --preference is one number")
    world = {key: value for key, value in gym.spec(env_id).kwargs.items() if key != "mode"}
    try:
        folder = paths.runs(args.quick) / "boreal_map"
        table = study(args, store_of(args, name), env_id, world, policy, folder)
    except ValueError as error:  # of a climate file, or of an address
        protocol.fail(str(error))
    settings = {
        "policy": name,
        "env_id": env_id,
        "preference": args.preference,
        "climate": None if args.climate is None else args.climate.name,
        "spacing": args.spacing,
        "years": args.years,
    }
    stored.write(path, table, settings)
    print(sentences(table, args.preference, args.years))
    draw(table, args.spacing, title(table, settings), figure)
    print(f"wrote {path} and {figure}")


if __name__ == "__main__":
    main(protocol.parse(Args))
