"""What claims are measured on: runs by experiment, metrics by training seed, studies and other stored tables."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from analysis import metrics, stored
from analysis.experiments import Job
from analysis.paper_claims.claim import SEEDS, Missing, Number, Undefined
from analysis.results import Replicate, Results
from analysis.tables.common import over_seeds
from analysis.tables.main_results import run_metrics

PAPER_ALONE = ""
VARIANCE, FRONTS = "python analysis/studies/variance.py", "python analysis/studies/fronts.py"
BENCHMARK, PROFILE = "python analysis/benchmark.py", "python analysis/profile_kernel.py"
SITES_OF_VARIANCE = "resampled sites"  # what the study of variance has intervals over
EUPG = "eupg_var_lambda"
PARTS = 10  # of a training; its first and its last are compared


def only(*experiments: str) -> str:
    """The command that makes the runs of some experiments."""
    return " ".join(["python analysis/reproduce.py --only", *experiments])


def seeds(values: pd.Series) -> Number:
    """Interquartile mean over training seeds, with its bootstrap interval and the mean's t interval."""
    known = values.dropna()
    if known.empty:
        raise Missing("a run that has the number")
    row = over_seeds(known.to_frame("x"))
    t = mean_of(known, SEEDS)
    return Number(row["x"], row["x_low"], row["x_high"], SEEDS, len(known), t.low, t.high)


def difference(first: pd.Series, second: pd.Series) -> Number:
    """First less second, paired by training seed."""
    common = first.index.intersection(second.index)
    if common.empty:
        raise Missing("training seeds that both sides have")
    return seeds(first[common] - second[common])


def unpaired(first: pd.Series, second: pd.Series) -> Number:
    """First less second, of scripts whose trainings share nothing by an equal seed: each side's seeds are drawn for
    itself, and the t interval is Welch's."""
    first, second = first.dropna(), second.dropna()
    if min(len(first), len(second)) < 2:
        raise Missing("two training seeds of either side")
    generator = np.random.default_rng(0)
    drawn = [
        stats.trim_mean(one.to_numpy()[generator.integers(len(one), size=(20_000, len(one)))], 0.25, axis=1)
        for one in (first, second)
    ]
    low, high = np.percentile(drawn[0] - drawn[1], [2.5, 97.5])
    value = metrics.iqm(first.to_numpy()) - metrics.iqm(second.to_numpy())
    t_low, t_high = metrics.welch_interval(first, second)
    return Number(value, low, high, SEEDS, min(len(first), len(second)), t_low, t_high)


def mean_of(values, over: str) -> Number:
    """Mean with its t interval, over sites or episodes."""
    mean, half_width = metrics.mean_interval(values)
    return Number(float(mean), float(mean - half_width), float(mean + half_width), over, len(values))


def first_and_last(run, column: str, statistic: str = "mean") -> tuple[float, float]:
    """A statistic of the training episodes in the first and the last tenth of a run's training."""
    parts = run.course(column, statistic, PARTS)
    return parts[0], parts[-1]


WITH_EUPG = only("main", "variants")  # Variable λ EUPG is judged with masks and without


class Evidence:
    """The results; metrics of a run are computed once."""

    def __init__(self, results: Results):
        self.results, self._known = results, {}
        self.asked_for_eupg = False  # of the main table, which has it choose among valid actions

    def job(self, experiment: str, script: str, budget: float | None = None, **flags) -> Job:
        """The first job of an experiment with these flags; budget : and this multiple of the main table's steps."""
        self.asked_for_eupg |= (experiment, script) == ("main", EUPG)
        jobs = self.results.jobs_of(experiment, script, **flags)
        if budget is not None:
            steps = budget * self.results.first_job("main", script).steps
            jobs = [job for job in jobs if job.steps == steps]
        if not jobs:
            raise Missing(f"{script} {flags}: not among these experiments")
        return jobs[0]

    def replicates(self, experiment: str, script: str, **wanted) -> list[Replicate]:
        """Runs of a job's row; Missing if there is none."""
        job = self.job(experiment, script, **wanted)
        found = self.results.rows[job.row]
        if not found:
            raise Missing(job.command)
        return found

    def by_seed(self, function: Callable, experiment: str, script: str, **wanted) -> pd.DataFrame:
        """The numbers that a function of a replicate gives, a row a training seed."""
        replicates = self.replicates(experiment, script, **wanted)
        key = function, self.job(experiment, script, **wanted).row
        if key not in self._known:
            index = [one.runs[0].arguments["seed"] for one in replicates]
            self._known[key] = pd.DataFrame([function(one) for one in replicates], index=index)
        return self._known[key]

    def metric(self, name: str, experiment: str, script: str, **wanted) -> pd.Series:
        """A metric of the main table by training seed; Missing if no run has it."""
        table = self.by_seed(main_metrics, experiment, script, **wanted)
        if name not in table or table[name].isna().all():
            raise Missing("runs of zero_change on the same episodes" if name.startswith("gain") else name)
        return table[name].dropna()

    def agents(self, experiment: str, weight: float) -> list:
        """Runs of fixed-weight EUPG trained for one weight."""
        found = [
            run
            for one in self.replicates(experiment, "eupg_fixed_lambda")
            for run in one.runs
            if run.arguments["preference"] == weight
        ]
        if not found:
            raise Missing(f"agents of the weight {weight:g}")
        return found

    def study(self, name: str) -> pd.DataFrame:
        """A study's table."""
        table = self.results.study(name)
        if table is None:
            raise Missing(f"analysis/studies/{name}.py")
        return table

    def compared(self, quantity: str) -> Number:
        """How the objectives' returns compare, by the study of variance, with its interval over resampled sites."""
        row = self.beside("variance/compared.csv").set_index("quantity").loc[quantity]
        return Number(row.value, row.low, row.high, SITES_OF_VARIANCE)

    def beside(self, name: str, read: Callable[[Path], pd.DataFrame] = stored.read) -> pd.DataFrame:
        """A table beside the studies' folder."""
        path = self.results.studies_dir.parent / name
        if not path.exists():
            raise Missing(name)
        return read(path)


class WithoutMasks(Evidence):
    """The same, but that the main table's Variable λ EUPG chooses among all actions."""

    def __init__(self, evidence: Evidence):
        super().__init__(evidence.results)
        self._known = evidence._known  # keys tell rows apart

    def is_there(self) -> bool:
        """Whether it has been run."""
        try:
            return bool(self.replicates("main", EUPG))
        except Missing:
            return False

    def job(self, experiment: str, script: str, budget: float | None = None, **flags) -> Job:
        """As Evidence.job; that of EUPG without masks for the main table's EUPG."""
        if (experiment, script) == ("main", EUPG):
            experiment, flags = "variants", {**flags, "masks": False}
        return super().job(experiment, script, budget, **flags)


def main_metrics(one: Replicate) -> dict:
    """The main table's metrics of a replicate."""
    return run_metrics(one.evaluation, one.gains)


def optional(measure: Callable[[], Number]) -> Number | str:
    """A number that a claim shows but does not need."""
    try:
        return measure()
    except Undefined as why:
        return str(why)
    except Missing:
        return "not run yet"
