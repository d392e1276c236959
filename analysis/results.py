"""What tables and figures are made of: the runs that exist, sorted into the experiments' rows, and the studies."""

from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import experiments, metrics, paths, reduction, runs, stored
from analysis.studies.constant_plans import of_environment
from boreal_env import NO_CHANGE
from cleanrl_style import protocol
from cleanrl_style.protocol import fronts
from cleanrl_style.protocol.evaluation import PRIMARY
from cleanrl_style.protocol.run_folder import as_text

PAIR = ["carbon", "thaw"]  # the paper's objectives


@dataclass(frozen=True)
class Replicate:
    """One training seed of a row: a run, or the runs of one agent a weight, evaluated each at its own."""

    runs: list[runs.Run]
    evaluation: pd.DataFrame
    gains: pd.DataFrame | None  # the evaluation less zero change on the same episodes, if that was evaluated
    by_policy: dict[str, pd.DataFrame | None] = field(default_factory=dict)  # gains of each policy
    plans: pd.DataFrame | None = None  # gains of the constant plans on its episodes, if they were evaluated

    def each_run(self) -> list["Replicate"]:
        """Its runs, each a replicate of its own."""
        return [Replicate([run], run.evaluation, None) for run in self.runs]

    @property
    def score(self) -> float:
        """Of the primary policy; NaN without constant plans on its episodes."""
        return self.score_of(self.gains)

    def score_of(self, gained: pd.DataFrame | None) -> float:
        """The score of gains on its episodes."""
        if gained is None or self.plans is None:
            return np.nan
        weights = np.unique(metrics.weights_of(gained), axis=0)
        return metrics.score(gained, metrics.best_constant_plans(self.plans, weights))

    @property
    def years(self) -> pd.DataFrame:
        """Annual record, a row a kept weight and year: means over the episodes of the columns of `reduction.ANNUAL`."""
        return self._joined("years", reduction.ANNUAL)

    @property
    def last_year(self) -> pd.DataFrame:
        """Percentiles over the episodes in the last year, a row a kept weight and variable of `reduction.SPREAD`."""
        return self._joined("last_year", ("p10", "p50", "p90"))

    def _joined(self, name: str, columns) -> pd.DataFrame:
        """A table of all its runs; without rows if none has it, which keeps no annual record."""
        tables = [run.tables[name] for run in self.runs if len(run.tables.get(name, ()))]
        return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=["year", *columns], dtype=float)

    def mean_of_years(self, variables) -> dict[str, float]:
        """Means over the years and the kept weights of columns of the annual record."""
        unknown = [name for name in variables if name not in reduction.ANNUAL]
        if unknown:
            raise ValueError(
                f"{unknown[0]}: no column of the annual record that is kept (analysis/reduction.py, ANNUAL)"
            )
        return self.years.reindex(columns=list(variables)).mean().to_dict()


def by_year(replicates: list[Replicate], variable: str) -> np.ndarray:
    """A column of the annual record, averaged over the kept weights, (replicates, years)."""
    return np.array([one.years.groupby("year")[variable].mean().to_numpy() for one in replicates])


def weights_of(arguments: dict) -> tuple | None:
    """The one preference that an agent is trained for; None of an agent of all."""
    preference = arguments.get("preference")
    return None if preference is None else tuple(np.ravel(preference).tolist())


class Results:
    """Runs below some folders by row, and the tables of the studies.

    `left_out` has a line for each run that could not be used, `missing` the jobs that have no run.
    """

    def __init__(self, roots: tuple[Path, ...], jobs: list[experiments.Job], studies_dir: Path):
        self.roots, self.jobs, self.studies_dir = roots, jobs, studies_dir
        self.runs, self.left_out = runs.read_runs(*roots)
        # every replicate asks for them, and a few answers serve all
        self.zero_change = cache(self._zero_change)
        self.constant_plans_in = cache(self._constant_plans_in)
        self.missing = [job for job in jobs if not job.is_study and not any(job.made(run.config) for run in self.runs)]

    @staticmethod
    def load(quick: bool, roots: tuple[Path, ...] | None = None, here: bool = False) -> "Results":
        """The results of `reproduce.py`, or of `reproduce.py --quick`.

        here : only those below the folder in which the command is started, as for a study that writes there.

        The archive comes before the runs themselves, so that a clone's tables have the same digits. Exits with one line
        if a folder of `roots` is not there.
        """
        for root in roots or ():
            if not root.is_dir():
                protocol.fail(f"--runs-dir {root}: no such folder")
        jobs = experiments.quick_jobs() if quick else experiments.jobs()
        archive, studies = paths.archive(quick), paths.studies(quick)
        if not here:
            archive, studies = paths.there(archive), paths.there(studies)
        return Results(roots or (archive, paths.runs(quick)), jobs, studies)

    @cached_property
    def rows(self) -> dict[tuple, list[Replicate]]:
        """(script, environment, setting) -> replicates; the rows of the experiments first, without runs if need be."""
        rows = {job.row: {} for job in self.jobs if not job.is_study}
        for run in self.runs:
            row = rows.setdefault((run.script, run.arguments["env_id"], run.setting), {})
            row.setdefault((run.arguments["seed"], run.arguments["site_seed"]), []).append(run)
        rows = {key: self._planned(key, row) for key, row in rows.items()}
        return {
            key: [
                self._replicate(*item)
                for item in sorted(row.items(), key=lambda item: str(item[0]))
                if self._complete(key, row, *item)
            ]
            for key, row in rows.items()
        }

    def _weights_of(self, key, row: dict) -> set[tuple]:
        """Of agents of one weight each, the weights of the experiment, or if it has none those of an evaluation."""
        planned = {weights_of(job.flags) for job in self.jobs if job.row == key and "preference" in job.flags}
        if planned or all(weights_of(run.arguments) is None for its_runs in row.values() for run in its_runs):
            return planned
        every = fronts.evaluation_weights(len(self.objectives(key[1])))
        return {tuple(np.ravel(weight).tolist()) for weight in every}

    def _planned(self, key, row: dict) -> dict:
        """A row without agents of weights that its experiment has not, which are named."""
        weights, kept = self._weights_of(key, row), {}
        for replicate, its_runs in row.items():
            kept[replicate] = [run for run in its_runs if not weights or weights_of(run.arguments) in weights]
            for run in its_runs:
                if run not in kept[replicate]:
                    weight = as_text(weights_of(run.arguments))
                    self.left_out.append(f"{run.folder}: of the weight {weight}, which the experiment has not")
        return {replicate: its_runs for replicate, its_runs in kept.items() if its_runs}

    def _complete(self, key, row, replicate, its_runs) -> bool:
        """Whether one agent a weight is there for every weight of the row; if not, it is named."""
        lacking = self._weights_of(key, row) - {weights_of(run.arguments) for run in its_runs}
        if lacking:
            seed, site_seed = replicate
            site = "" if site_seed is None else f", site seed {site_seed}"
            self.left_out.append(
                f"{key[0]}, {key[1]}, seed {seed}{site}: partial, without the agents of the weights "
                f"{', '.join(map(as_text, sorted(lacking)))}"
            )
        return not lacking

    def _replicate(self, _, its_runs) -> Replicate:
        conditions = {name: its_runs[0].arguments[name] for name in ("env_id", "thaw_formulation", "site_seed")}
        by_policy = {
            policy: pd.concat([run.of_policy(policy) for run in its_runs], ignore_index=True)
            for policy in protocol.POLICIES
        }
        return self.replicate(its_runs, by_policy, **conditions)

    def replicate(self, its_runs, by_policy, env_id, **conditions) -> Replicate:
        """A replicate of evaluations by policy, with its gains if they are known."""
        gained = {policy: self.gains(table, env_id, **conditions) for policy, table in by_policy.items()}
        plans = None if gained[PRIMARY] is None else self.plans(by_policy[PRIMARY], env_id, **conditions)
        return Replicate(its_runs, by_policy[PRIMARY], gained[PRIMARY], gained, plans)

    def plans(self, evaluation, env_id, thaw_formulation="asymmetric", site_seed=None) -> pd.DataFrame | None:
        """Gains of the constant plans on an evaluation's episodes; None if they were not evaluated on them."""
        columns = metrics.return_columns(metrics.objectives_of(evaluation.columns))
        table = self.constant_plans_in(env_id, thaw_formulation, site_seed)
        if table is None or not set(columns) <= set(table.columns):
            return None
        table = table[table.seed.isin(evaluation.seed)]
        if set(table.seed) != set(evaluation.seed):
            return None
        table = table.assign(plan=table.action.astype(str))[["plan", "seed", *columns]]
        zero = self.zero_change(env_id, thaw_formulation, site_seed)
        nothing = zero.drop_duplicates("seed").set_index("seed")[columns]
        table[columns] -= nothing.loc[table.seed].to_numpy()
        return table

    def gains(self, evaluation, env_id, thaw_formulation="asymmetric", site_seed=None) -> pd.DataFrame | None:
        """An evaluation less zero change under the same reward; None if that was not evaluated on its episodes."""
        longest = self.zero_change(env_id, thaw_formulation, site_seed)
        known = longest is not None and set(evaluation.seed) <= set(longest.seed)
        return metrics.gains(evaluation, longest) if known else None

    def _zero_change(self, env_id, thaw_formulation, site_seed) -> pd.DataFrame | None:
        """Episodes of zero change under these conditions, of all its runs and of that constant plan; None without."""
        conditions = {"env_id": env_id, "thaw_formulation": thaw_formulation, "site_seed": site_seed}
        same = [
            run.evaluation
            for run in self.runs
            if run.script == "zero_change" and all(run.arguments[name] == value for name, value in conditions.items())
        ]
        plans = self.constant_plans_in(**conditions)
        same += [] if plans is None else [plans[plans.action == NO_CHANGE]]
        return pd.concat(same, ignore_index=True).drop_duplicates("seed") if same else None

    def _constant_plans_in(self, env_id, thaw_formulation, site_seed) -> pd.DataFrame | None:
        """The study of constant plans under these conditions, with the returns of the environment's objectives."""
        if self.constant_plans is None or thaw_formulation != "asymmetric" or site_seed is not None:
            return None
        table = of_environment(self.constant_plans, env_id)
        return table if len(table) else None

    @cached_property
    def own(self) -> dict[tuple, list[runs.Run]]:
        """The rows that have runs which are not the archive's, and those runs."""
        archive, own = paths.there(paths.archive()).absolute(), {}
        for key, replicates in self.rows.items():
            of_row = [run for one in replicates for run in one.runs if archive not in run.folder.absolute().parents]
            own |= {key: of_row} if of_row else {}
        return own

    def of_several_sources(self) -> list[str]:
        """A line for each row of `own` whose seeds were trained by several versions of a script."""
        lines = []
        for (script, *_), runs_of in self.own.items():
            seeds: dict[str | None, set[int]] = {}
            for run in runs_of:
                seeds.setdefault(run.config.get("source"), set()).add(run.arguments["seed"])
            if len(seeds) > 1:
                by = ", and ".join(" ".join(map(str, sorted(group))) for group in seeds.values())
                lines.append(
                    f"{runs_of[0].folder.parent}: its seeds were trained by {len(seeds)} versions of {script}.py: "
                    f"{by}; --overwrite trains a run anew"
                )
        return lines

    @cached_property
    def constant_plans(self) -> pd.DataFrame | None:
        """The study of that name."""
        return self.study("constant_plans")

    def objectives(self, env_id: str) -> list[str]:
        """An environment's objectives, by its runs; the paper's two without a run."""
        run = next((run for run in self.runs if run.arguments["env_id"] == env_id), None)
        return PAIR if run is None else metrics.objectives_of(run.evaluation.columns)

    def rows_of_two_objectives(self) -> dict[tuple, list[Replicate]]:
        """The rows of environments that pay carbon and thaw, which the paper's tables are about."""
        return {key: replicates for key, replicates in self.rows.items() if self.objectives(key[1]) == PAIR}

    def of(self, experiment: str, script: str, **flags) -> list[Replicate]:
        """Replicates of an experiment's row: the first of its jobs with these flags says which; none without a job."""
        jobs = self.jobs_of(experiment, script, **flags)
        return self.rows[jobs[0].row] if jobs else []

    def jobs_of(self, experiment: str, script: str, **flags) -> list[experiments.Job]:
        """Jobs of an experiment's script that have these flags, in order."""
        return [
            job
            for job in self.jobs
            if (job.experiment, job.script) == (experiment, script)
            and all(job.flags.get(name) == value for name, value in flags.items())
        ]

    def is_trained(self, key: tuple) -> bool:
        """Whether a row is of a script that trains, by its jobs or its runs."""
        return any(job.row == key and job.steps for job in self.jobs) or any(
            "total_timesteps" in one.runs[0].arguments for one in self.rows[key]
        )

    def of_main_and_others(self, scripts) -> dict[tuple, list[Replicate]]:
        """Rows of the main experiment's scripts, then those of scripts that no experiment has, such as one's own.

        The others' rows are those of the main experiment's environment and thaw formulation.
        """
        planned = {job.script for job in self.jobs}
        keys = [self.first_job("main", script).row for script in scripts]
        environment = keys[0][1]
        keys += [
            key
            for key in self.rows
            if key[0] not in planned and key[1] == environment and "thaw_formulation" not in key[2]
        ]
        return {key: self.rows[key] for key in keys}

    def first_job(self, experiment: str, script: str) -> experiments.Job:
        """The first job of an experiment's script."""
        return self.jobs_of(experiment, script)[0]

    def study(self, name: str) -> pd.DataFrame | None:
        """The table of a study; None if it has not been made."""
        path = self.studies_dir / f"{name}.csv"
        if not path.exists():
            return None
        return stored.read(path)
