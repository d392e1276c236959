"""Whether planting still raises or lowers the thaw return, by species, when a constant is 10 % off.

    python analysis/studies/planting_signs.py

Every literature constant at the two levels of `sensitivity.py`, one at a time, on a few sites that span what is
sampled, in the paper's world and in the balanced one: zero change, and planting 100 stems a year of conifers or of
deciduous trees. All else is held, dice included; nothing burns and no insects come, so that no difference is luck.
Leaves results/studies/planting_signs.csv, a row a world and level; until then a group of constants is one table beside
it, and a command that was stopped goes on with the next.
"""

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

import sim
from analysis import paths, stored
from analysis.studies import open_loop, sensitivity
from analysis.studies.sensitivity import DEFAULT, Variant
from analysis.validation.held_stands import UNDISTURBED
from cleanrl_style import protocol
from sim.stands import available_cores
from sim.task.episodes import BALANCED_WORLD

YEARS = 50
SITES = 5  # with three plans they fill a block of sixteen lanes
PLANS = {"zero change": 12, "conifers": 24, "deciduous": 20}
WORLDS = {"boreal-generalist-v0": {}, "boreal-balanced-v0": BALANCED_WORLD}


@dataclass
class Args:
    """Measures the sign of planting's effect on the thaw return with every constant 10 % off."""

    sites: int = SITES
    """sites that span what is sampled"""
    years: int = YEARS
    """length of an episode"""
    names: tuple[str, ...] = ()
    """only these constants, printed and not written"""
    quick: bool = False
    """2 sites, 2 years, the constants of snow: to see that it runs, into results/quick/studies"""


def play(world: str, variant: Variant, sites: int, years: int) -> dict:
    """Mean over sites of the thaw return of zero change and of what planting adds to it, with standard errors."""
    numbers = open_loop.spanning_sites(sites)
    design = [(number, plan) for number in numbers for plan in PLANS.values()]
    episodes = open_loop.play(
        [sim.sample_site(number) for number, _ in design],
        [open_loop.seeds(number, 0) for number, _ in design],
        np.repeat([[plan] for _, plan in design], years, axis=1),
        constants=variant.constants,
        mechanisms=UNDISTURBED,
        threads=1,
        **WORLDS[world],
    )
    returns = episodes.returns()[:, 1].reshape(sites, len(PLANS))
    row = {"world": world, "constant": variant.factor, "level": variant.level, "value": variant.value}
    return row | {"group": variant.group} | effects(returns)


def effects(returns: np.ndarray) -> dict[str, float]:
    """Zero change's return, the planted plans' less it, and their standard errors; returns (sites, plans)."""
    gains = returns[:, 1:] - returns[:, :1]
    found = {"zero_change": float(returns[:, 0].mean())}
    for name, gain in zip(("conifers", "deciduous"), gains.T, strict=True):
        error = gain.std(ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.nan
        found |= {name: float(gain.mean()), f"{name}_se": float(error)}
    return found


def variants() -> list[Variant]:
    """The default, and every constant below and above its value."""
    alone = (variant for variant in sensitivity.variants() if variant.factor in sim.CONSTANTS)
    return [DEFAULT, *alone]


def play_all(chosen: list[Variant], args: Args, played) -> pd.DataFrame:
    """The variants in each world side by side, one a core; `played` is called after each."""
    cases = [(world, variant) for world in WORLDS for variant in chosen]
    with ThreadPoolExecutor(available_cores()) as pool:
        rows = []
        for row in pool.map(lambda case: play(*case, args.sites, args.years), cases):
            rows.append(row)
            played()
    return pd.DataFrame(rows)


def settings(args: Args) -> dict:
    """What a table hangs on; another simulator or step makes it stale."""
    worlds = ", ".join(WORLDS)
    return {"worlds": worlds, "sites": args.sites, "years": args.years, "share": sensitivity.SHARE}


def path(quick: bool = False) -> Path:
    """The table of all levels."""
    return paths.studies(quick) / "planting_signs.csv"


def main(args: Args) -> None:
    """Play every group that is not finished, and join them; or print the constants that were named."""
    everything = variants()
    if args.quick:
        args.sites, args.years = 2, 2
        everything = [v for v in everything if v is DEFAULT or v.factor.startswith("snow_viscosity")]
    if not 1 <= args.sites <= open_loop.CANDIDATES:
        protocol.fail(f"--sites {args.sites}: 1 to {open_loop.CANDIDATES} are allowed")
    if args.names:
        unknown = [name for name in args.names if name not in sim.CONSTANTS]
        if unknown:
            sys.exit(f"error: --names {unknown[0]}: a name in sim/constants.csv is allowed")
        everything = [variant for variant in everything if variant.factor in ("default", *args.names)]
    made_by, table = settings(args), path(args.quick)
    if not args.names and stored.is_finished(table, made_by):
        print(f"{table} is finished")
        return
    total = len(WORLDS) * len(everything)
    progress = protocol.Progress("planting_signs", total, "levels")
    if args.names:
        print(play_all(everything, args, progress.add).to_string(index=False, float_format="%+.2f"))
        return

    groups: dict[str, list[Variant]] = {}
    for variant in everything:
        groups.setdefault(variant.group, []).append(variant)
    parts = {group: table.with_name(f"{table.stem}_{group.replace(' ', '_')}.csv") for group in groups}
    for group, of in groups.items():
        if stored.is_finished(parts[group], made_by):
            progress.add(len(WORLDS) * len(of))
        else:
            stored.write(parts[group], play_all(of, args, progress.add), made_by)
    whole = pd.concat([stored.read(part, text=("value",)) for part in parts.values()], ignore_index=True)
    stored.write(table, whole, made_by)
    for part in parts.values():
        part.unlink()
    print(f"wrote {table}")


if __name__ == "__main__":
    main(protocol.parse(Args))
