"""The part of the validation on what the thaw return hangs on: the boundary, and every constant."""

import numpy as np
import pandas as pd

import sim
from analysis import stored
from analysis.studies import open_loop, planting_signs, variance
from analysis.validation import balanced_boundary, document, thaw_agreement
from analysis.validation.document import Miss, Part, number, percent
from analysis.validation.scores import IN, Band
from sim.spin_up import BOUNDARY
from sim.task.episodes import BALANCED_WORLD

YEARS, QUICK_YEARS = 50, 10
SPAN = "sites that span the sampled"  # where a constant, not the simulator against what was measured, is looked at
PLANS = {"zero change": 12, "+100 conifers": 24, "+100 deciduous": 20, "−100": 2}
EFFECTS = ["zero_change", "conifers", "deciduous"]
NOTHING = 1e-9  # of a return
ZERO_CHANGE = Band(-3.0, 3.0)  # how far a constant moved by 10 % may move the return of zero change

#: Name -> arguments of `sim.Stands`.
WORLDS = {
    "boundary as sampled": {},
    "boundary in balance": {"boundary": "balanced"},
    "boreal-balanced-v0": BALANCED_WORLD,
}

BALANCE = Band(-5.0, 5.0)  # mean heat into a boundary that is in balance [MJ m-2 yr-1]
BALANCE_YEARS = 10


def report(sites: int, quick: bool = False) -> Part:
    """Variance of the thaw return on `sites` sites; how often measures of thaw agree; the signs that were stored.

    quick : fewer years, and no look at what is stored.
    """
    years = QUICK_YEARS if quick else YEARS
    numbers = [open_loop.FIRST_SITE_SEED + k for k in range(sites)]
    seeds = [open_loop.seeds(seed, k) for k, seed in enumerate(numbers)]
    sampled = [sim.sample_site(seed) for seed in numbers]
    played = {name: _play(sampled, seeds, PLANS, years, **world) for name, world in WORLDS.items()}
    rows, within = zip(*(_variance(name, episodes) for name, episodes in played.items()), strict=True)
    boundary, heat = balanced_boundary.run_held(sampled, seeds, **BALANCED_WORLD)
    shift = np.abs(boundary - [site[BOUNDARY] for site in sampled])
    signs, misses = _signs(quick)
    low, middle, high = (number(value, 1) for value in np.percentile(heat, [5, 50, 95]))
    header = ["world", "zero change", "s.d. over sites", "site", "policy", "site x policy", "years clipped"]
    text = f"""The thaw return over {years} years, as rewarded, on {sites} sampled sites with their own first stands; a
weather for each site, the same for every plan, with fire and insects; an action that cannot be carried out in full is
left out. *Years clipped* are years in which the reward is −1 or 1, on average over the plans. Shares of its variance
are components of a crossed design of sites and four plans ({", ".join(PLANS)} stems/ha a year), of which the
interaction is what is left. In balance, the boundary of each site is at the temperature at which its own first stand,
held, gives it no heat, as the spin-up finds it; in `boreal-balanced-v0` the weather is as observed, too, and the first
soil carbon in balance. There the boundary moved by {number(float(np.median(shift)), 1)} K (median), and what flows
through it in {balanced_boundary.YEARS} years below held stands (without fire and insects) is {middle} MJ/m2/yr ({low}
.. {high}, 5-95 % of sites). In the first {BALANCE_YEARS} years of zero change, when stands are free, it is within
{number(BALANCE.high, 0)} MJ/m2/yr of zero at {percent(within[0])} of the sites with the boundary as sampled, at
{percent(within[1])} with the boundary in balance and at {percent(within[2])} in `boreal-balanced-v0`.

{document.table([*header, *list(PLANS)[1:]], list(rows), left=1)}

Plans are means less zero change ± standard errors over sites.

{thaw_agreement.text({name: episodes.record for name, episodes in played.items()}, list(PLANS))}

{signs}"""
    return Part(text, misses=misses)


def _play(sites: list[dict], seeds: list, plans: dict[str, int], years: int, **arguments) -> open_loop.Episodes:
    """Every plan on every site, the plans of a site one after the other."""
    design = [(site, seed, plan) for site, seed in zip(sites, seeds, strict=True) for plan in plans.values()]
    chosen, dice, actions = zip(*design, strict=True)
    actions = np.repeat([[plan] for plan in actions], years, axis=1)
    return open_loop.play(list(chosen), list(dice), actions, **arguments)


def _thaw_returns(episodes: open_loop.Episodes, plans: dict[str, int]) -> np.ndarray:
    """(sites, plans)."""
    return episodes.returns()[:, 1].reshape(-1, len(plans))


def _variance(name: str, episodes: open_loop.Episodes) -> tuple[list[str], float]:
    """A row: spread, shares and the plans' effects; and the share of sites whose boundary takes nearly no heat in the
    first years of zero change."""
    returns = _thaw_returns(episodes, PLANS)
    shares = variance.shares(variance.variance_components(returns[:, None]))
    heat = boundary_heat(episodes.record[:: len(PLANS), :BALANCE_YEARS])
    row = [
        name,
        number(float(returns[:, 0].mean()), 1),
        number(float(returns[:, 0].std(ddof=1)), 1),
        *(f"{number(100.0 * shares[term], 1)} %" for term in ("site", "policy", "site x policy")),
        number(float(episodes.clipped_years()[:, 1].mean()), 1),
        *_effects(returns),
    ]
    return row, BALANCE.share_within(heat)


def boundary_heat(record: np.ndarray) -> np.ndarray:
    """Mean heat into the boundary [MJ m-2 yr-1], (sites,); record (sites, years, its columns)."""
    column = sim.RECORD_NAMES.index
    return (record[:, :, column("boundary_warming_mj_m2")] - record[:, :, column("boundary_cooling_mj_m2")]).mean(
        axis=1
    )


def _effects(returns: np.ndarray) -> list[str]:
    """What each plan adds to zero change, the first column: mean and standard error over sites."""
    gains = returns[:, 1:] - returns[:, :1]
    errors = gains.std(axis=0, ddof=1) / np.sqrt(len(gains))
    means = gains.mean(axis=0)
    return [f"{number(mean, 2, sign=True)} ± {number(error, 2)}" for mean, error in zip(means, errors, strict=True)]


def problems(before: tuple[float, float, float], after: tuple[float, float, float]) -> list[str]:
    """What a change did that it should not; returns of zero change and gains of conifers and deciduous trees."""
    moved = after[0] - before[0]
    found = [] if ZERO_CHANGE.verdict(moved) == IN else [f"zero change moves by {number(moved, 1, sign=True)}"]
    for species, old, new in zip(("conifers", "deciduous"), before[1:], after[1:], strict=True):
        if old * new < 0.0:
            found.append(f"{species} turn from {number(old, 2, sign=True)} to {number(new, 2, sign=True)}")
    return found


def _signs(quick: bool) -> tuple[str, list[Miss]]:
    """What `planting_signs.py` found, if it ran on this simulator."""
    args, path = planting_signs.Args(), planting_signs.path()
    if quick or not stored.is_finished(path, planting_signs.settings(args)):
        command = "python analysis/studies/planting_signs.py"
        return f"Signs with every constant 10 % off are not there for this simulator; `{command}` finds them.", []
    return signs_found(stored.read(path, text=("value",)), args.sites)


def signs_found(table: pd.DataFrame, sites: int) -> tuple[str, list[Miss]]:
    """Text and misses: constants that turn the sign of planting's effect, or move zero change too far.

    table : of `planting_signs.py`, a row a world, constant and level, the first of each world the default.
    """
    rows, misses, of_worlds = [], [], []
    for world, of_world in table.groupby("world", sort=False):
        default = of_world[of_world.constant == "default"].iloc[0]
        before = tuple(default[EFFECTS])
        levels = of_world[of_world.constant != "default"]
        of_worlds.append(f"In `{world}` {_of_world(default, levels)}")
        for level in levels.itertuples():
            after = (level.zero_change, level.conifers, level.deciduous)
            found = problems(before, after)
            if not found:
                continue
            values = [number(value, 2, sign=True) for value in after]
            rows.append([f"`{world}`", f"`{level.constant}`", level.value, *values, ", ".join(found)])
            misses.append(
                Miss(
                    SPAN,
                    f"`{level.constant}` = {level.value}, `{world}`: {', '.join(found)}",
                    level.group.removeprefix("constants "),
                )
            )
    header = ["world", "constant", "value", "zero change", "conifers", "deciduous", "what turns or moves"]
    listed = document.table(header, rows, left=7) if rows else "No constant does either."
    count = table[table.constant != "default"].constant.nunique()
    text = f"""Every constant 10 % below and above its value ({count} constants; steps as in
[sensitivity.md](sensitivity.md)), one at a time, in `boreal-generalist-v0` and
`boreal-balanced-v0`, on {sites} sites that span what is sampled, without
fire and insects. {" ".join(of_worlds)} Listed are constants that turn a sign, and those that move zero change by more
than {number(ZERO_CHANGE.high, 0)}.

{listed}"""
    return text, misses


def _of_world(default: pd.Series, levels: pd.DataFrame) -> str:
    """What planting does there, and how many constants turn it or change nothing."""
    added = [
        f"{number(default[name], 2, sign=True)} ± {number(default[f'{name}_se'], 2)} ({name})"
        for name in ("conifers", "deciduous")
    ]
    turned = {name: levels[levels[name] * default[name] < 0.0].constant.nunique() for name in ("conifers", "deciduous")}
    alike = (levels[EFFECTS] - default[EFFECTS].astype(float)).abs().max(axis=1) < NOTHING
    inert = int(alike.groupby(levels.constant).all().sum())
    return (
        f"zero change returns {number(default.zero_change, 2, sign=True)}, and planting adds {' and '.join(added)}. "
        f"Constants that turn the sign of this mean: {turned['conifers']} of conifers, {turned['deciduous']} of "
        f"deciduous trees; {inert} change nothing there, so that nothing is said of them."
    )
