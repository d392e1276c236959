"""What is kept of a run: the numbers that tables, figures, claims and studies read, a twentieth of what it logged.

The archive holds these tables and nothing else. A run of runs/ is reduced in the same way when it is read, to the same
digits, so that tables of either are the same bytes. What a new table or figure reads has to be kept here first.

evaluation   every episode of both policies: weights, seeds, returns; what else is known of it of the primary policy
years        means of the annual record over the episodes of a weight, the columns of ANNUAL; a row a weight and year
last_year    percentiles of the columns of SPREAD in the last year; a row a weight and column
learning     the training in BINS equal parts: how many episodes, their means and standard deviations
validation   gains on validation sites in the course of the training, as the run has them
composition  the last fifth of the training: episodes by their last year's conifer fraction, in BINS classes
sample       every EVERY-th round of a curriculum's training episodes, one by one
selection    what a curriculum accepted, and how its threshold moved
timing       seconds by phase
cost         of another library's run: steps, of training and of its own evaluations, and its largest memory
"""

import io

import numpy as np
import pandas as pd

from cleanrl_style.protocol import EPISODE_INFO, fronts
from cleanrl_style.protocol.evaluation import EVALUATION_INFO, PRIMARY
from sim.demography import AGE_CLASSES

BINS = 40
EVERY, FEWEST_ROUNDS = 8, 16  # of fewer rounds all are kept
SPECIES = ("conifer", "deciduous")
SPREAD = ("density_stems_ha", "conifer_fraction")
ANNUAL = (
    *SPREAD,
    "planted_stems_ha",
    "thinned_stems_ha",
    "max_lai",
    "winter_albedo",
    "boundary_warming_mj_m2",
    "boundary_cooling_mj_m2",
    *(f"{species}_{age}_stems_ha" for species in SPECIES for age in AGE_CLASSES),
)
#: Columns that a run's own tables have in any case, besides weights and returns.
NEEDED = {
    "evaluation": ("policy", "episode"),
    "timing": ("phase", "global_step", "seconds"),
    "evaluation_years": ("policy", "year", "variable", "mean", "sd"),
    "episodes": ("global_step", "env", "scalarized_return", *EPISODE_INFO),
}
FLOAT_FORMAT = "%.6g"
FLOAT_FORMATS = {"timing": "%.12g", "learning": "%.12g"}  # differences of statistics need more digits


def reduce(tables: dict[str, pd.DataFrame], steps: int | None) -> dict[str, pd.DataFrame]:
    """A run's own tables by name, those that it has, as the tables that are kept of it.

    steps : of its training; None for a fixed strategy.
    """
    kept = {"evaluation": evaluation(tables["evaluation"]), "timing": timing(tables["timing"])}
    if "cost" in tables:
        kept["cost"] = tables["cost"]
    if "evaluation_years" in tables:
        record = tables["evaluation_years"]
        record = record[record.policy == PRIMARY].drop(columns="policy")
        kept |= {"years": years(record), "last_year": last_year(record)}
    if "episodes" in tables:
        episodes = tables["episodes"]
        kept["learning"] = learning(episodes, steps)
        if "validation" in tables:
            kept["validation"] = tables["validation"]
        if episodes[list(EPISODE_INFO)].notna().all(axis=None):
            kept["composition"] = composition(episodes)
        if "selected" in episodes:
            kept |= {"sample": sample(episodes), "selection": selection(episodes)}
    return {name: parse(as_text(name, table)) for name, table in kept.items()}


def as_text(name: str, table: pd.DataFrame) -> str:
    """A kept table as CSV, with as many digits as are kept."""
    return table.to_csv(index=False, float_format=FLOAT_FORMATS.get(name, FLOAT_FORMAT), lineterminator="\n")


def parse(text: str) -> pd.DataFrame:
    """A table of its CSV."""
    return pd.read_csv(io.StringIO(text))


# ---------------------------------------------------------------------------------------------- evaluation


def evaluation(table: pd.DataFrame) -> pd.DataFrame:
    """All episodes, without their number, which their seed gives; EVALUATION_INFO of the primary policy alone."""
    info = [name for name in EVALUATION_INFO if name in table]
    table = table.drop(columns="episode")
    table[info] = table[info].where(table.policy == PRIMARY)
    return table


def kept_weights(record: pd.DataFrame) -> pd.DataFrame:
    """The annual record of a policy at one objective's weights alone, and at equal ones."""
    weights = [name for name in record if name == "preference" or name.startswith("weight_")]
    values = record[weights].to_numpy()
    number = 2 if weights == ["preference"] else len(weights)
    corner, centre = np.isin(values, (0, 1)).all(axis=1), np.isclose(values, 1 / number).all(axis=1)
    return record[corner | centre]


def years(record: pd.DataFrame) -> pd.DataFrame:
    """Means over the episodes of the columns of ANNUAL, at the kept weights."""
    record = kept_weights(record)
    weights = list(record.columns[: record.columns.get_loc("year")])
    table = record.pivot(index=[*weights, "year"], columns="variable", values="mean")
    return table[[name for name in ANNUAL if name in table]].reset_index()


def last_year(record: pd.DataFrame) -> pd.DataFrame:
    """Percentiles over the episodes of the columns of SPREAD in the last year, at the kept weights."""
    record = kept_weights(record)
    chosen = (record.year == record.year.max()) & record.variable.isin(SPREAD)
    return record[chosen].drop(columns=["year", "mean", "sd"])


# ------------------------------------------------------------------------------------------------ training


def learning(episodes: pd.DataFrame, steps: int) -> pd.DataFrame:
    """The episodes that ended in each of BINS equal parts of the training: their number, means, deviations."""
    columns = [*fronts.return_columns(fronts.objectives_of(episodes.columns)), "scalarized_return", *EPISODE_INFO]
    parts = episodes[columns].groupby(np.minimum((episodes.global_step - 1) * BINS // steps, BINS - 1))
    table = pd.DataFrame({"episodes": parts.size()})
    for name in columns:
        table[f"{name}_mean"], table[f"{name}_sd"] = parts[name].mean(), parts[name].std()
    table = table.reindex(range(BINS)).rename_axis("part")
    return table.astype({"episodes": "Int64"}).fillna({"episodes": 0}).reset_index()


def course(table: pd.DataFrame, column: str, statistic: str = "mean", parts: int = BINS) -> np.ndarray:
    """Mean or standard deviation ("std") of a column in equal parts of the training, (parts,); NaN without episodes.

    table : of `learning`; parts : a divisor of BINS
    """
    if BINS % parts:
        raise ValueError(f"parts of a training: a divisor of {BINS}, not {parts}")
    if statistic not in ("mean", "std"):
        raise ValueError(f"statistic {statistic!r}: mean or std is allowed")
    number, mean, deviation = (
        table[name].to_numpy(dtype=float, na_value=0.0).reshape(parts, -1)
        for name in ("episodes", f"{column}_mean", f"{column}_sd")
    )
    total = number.sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        whole = (number * mean).sum(axis=1) / total
        if statistic == "mean":
            return whole
        within, between = np.maximum(number - 1, 0) * deviation**2, number * (mean - whole[:, None]) ** 2
        return np.sqrt((within + between).sum(axis=1) / np.where(total > 1, total - 1, np.nan))


def composition(episodes: pd.DataFrame) -> pd.DataFrame:
    """Episodes of the last fifth of the training by their last year's conifer fraction, in BINS classes of 0 to 1."""
    last = episodes.final_conifer_fraction[episodes.global_step > 0.8 * episodes.global_step.max()]
    number, edges = np.histogram(last, np.linspace(0, 1, BINS + 1))
    return pd.DataFrame({"conifer_fraction": edges[:-1], "episodes": number})


def sample(episodes: pd.DataFrame) -> pd.DataFrame:
    """The episodes of every EVERY-th round, an episode in each environment: whose site it was, and whether selected."""
    number = episodes.groupby("env").cumcount() + 1
    every = EVERY if number.max() >= FEWEST_ROUNDS else 1
    objectives = fronts.objectives_of(episodes.columns)
    columns = [*fronts.weight_columns(objectives), *fronts.return_columns(objectives), "site_seed", "selected"]
    return episodes.loc[number % every == 0, ["global_step", "env", *columns]]


def selection(episodes: pd.DataFrame) -> pd.DataFrame:
    """Episodes: all, selected, with a score between the lowest and the highest threshold; moves of the threshold."""
    moves, threshold = np.diff(episodes.threshold), episodes.threshold
    between = (episodes.score > threshold.min()) & (episodes.score <= threshold.max())
    row = {
        "episodes": len(episodes),
        "selected": episodes.selected.sum(),
        "between": between.sum(),
        "lowest_threshold": threshold.min(),
        "highest_threshold": threshold.max(),
        "moves": (moves != 0).sum(),
        "moves_up": (moves > 0).sum(),
    }
    return pd.DataFrame([row])


def timing(table: pd.DataFrame) -> pd.DataFrame:
    """Seconds of each phase; of steps that a killed run made twice, the last time."""
    made = table.drop_duplicates(["phase", "global_step"], keep="last")
    return made.groupby("phase", sort=False).seconds.sum().reset_index()
