"""The appendix on running time: episodes, training, memory, cores and cost."""

from functools import partial

import numpy as np
import pandas as pd

from analysis.paper_claims.claim import (
    COST,
    LEVEL,
    UNTESTABLE,
    Finding,
    Missing,
    Number,
    Row,
    about,
    above,
    below,
    finding,
)
from analysis.paper_claims.claim import claim as claim_of_any_kind
from analysis.paper_claims.evidence import BENCHMARK, PROFILE, only, seeds
from analysis.tables.common import paper
from analysis.tables.runtime import hours, published

TITLE = "Time, memory and cost"
claim = partial(claim_of_any_kind, kind=COST)
WORKERS = 16
# On demand, Linux, us-east-1: docs.aws.amazon.com, Amazon EC2 Auto Scaling user guide, prices by instance hour
DOLLARS_PER_HOUR = 0.68
FASTER = "A cost: what is claimed is that it can be afforded, and ours being less does not speak against it."


def measured(evidence, what: str) -> Number:
    """A figure of the benchmark: median, lowest and highest of its repeats."""
    table = evidence.beside("benchmark.csv", pd.read_csv).set_index("what")
    if what not in table.index:
        raise Missing(f"{what} in results/benchmark.csv")
    row = table.loc[what]
    return Number(row["median"], row.low, row.high, "repeats (lowest, highest)", int(row.repeats))


def most(name: str) -> float:
    """The upper end of the paper's range."""
    return paper("runtime", index_col="quantity").high[name]


@claim("A 50-year episode takes 5 to 7 s on one core (Numba).", "Appendix, runtime", BENCHMARK, note=FASTER)
def episode(evidence):
    name = "episode_50_years_numba"
    ours = measured(evidence, "50-year episode, 1 stand")
    lockstep = measured(evidence, "50-year episode, 16 stands in lockstep, each")
    rows = [Row("one stand [s]", published(name), ours), Row("sixteen in lockstep, each [s]", "", lockstep)]
    return finding(rows, below(ours, most(name)))


@claim(
    "The same takes 12 to 15 s in pure Python.",
    "Appendix, runtime",
    BENCHMARK,
    note="Of another program: interpreted, every operation on every lane's field is looked up anew here, and the "
    "uncompiled backend is there to compare bits with, not to be fast. How much physics a step of the paper's has is "
    "not known.",
    kind=LEVEL,
)
def pure_python(evidence):
    name = "episode_50_years_pure_python"
    ours = measured(evidence, "50-year episode, python backend")
    return finding([Row("one stand [s]", published(name), ours)], below(ours, most(name)))


def training_claim(statement: str, command: str, experiment: str, script: str, name: str):
    """The claim on the time of a training."""

    @claim(statement, "Appendix, runtime", command, note=FASTER)
    def training(evidence):
        values = [hours(run)["training"] for one in evidence.replicates(experiment, script) for run in one.runs]
        ours = seeds(pd.Series(values))
        steps = evidence.job(experiment, script).steps
        method = {"eupg": "EUPG", "ppo": "PPO"}[script.split("_")[0]]
        rows = [
            Row(f"hours of {steps:,} steps of {method} in lockstep on one core", published(name), ours),
            Row("runs that were timed, alone on their core", "", f"{np.isfinite(values).sum()} of {len(values)}"),
        ]
        return finding(rows, below(ours, most(name)))

    return training


TRAINING = (
    training_claim(
        "Training on all sites takes 8 to 12 hours.",
        only("main"),
        "main",
        "ppo_curriculum",
        "training_generalist_300k_steps",
    ),
    training_claim(
        "Training on one site takes 3 to 4 hours.",
        only("site"),
        "site",
        "eupg_fixed_lambda",
        "training_site_specific_100k_steps",
    ),
)


@claim(
    "With 16 workers training takes 1 to 2 hours: it scales well with cores.",
    "Appendix, runtime",
    BENCHMARK,
    note="Needs a training on a machine of as many cores, as the benchmark's row; docs/scaling.md has what the "
    "simulator alone does on sixteen.",
)
def workers(evidence):
    table = evidence.beside("benchmark.csv", pd.read_csv)
    threads = table[table.section == "threads"].set_index("what")
    ratios = {int(what.split()[0]): row.ratio for what, row in threads.iterrows()}
    rows = [
        Row(
            f"speed of {number} threads, in that of one",
            "4 - 12 for 16 workers" if number == WORKERS else "",
            Number(ratio),
        )
        for number, ratio in sorted(ratios.items())
        if number > 1
    ]
    if WORKERS not in ratios:
        return Finding(rows or [Row("threads", "16 workers", "one core")], UNTESTABLE)
    printed = paper("runtime", index_col="quantity")
    least = printed.low["training_generalist_300k_steps"] / printed.high["training_generalist_16_workers"]
    return finding(rows, above(Number(ratios[WORKERS]), least, what="the speed-up"))


@claim(
    "The canopy's solver takes 60 to 70 % of the physics.",
    "Appendix, runtime",
    PROFILE,
    note="The canopy is solved by Newton's method in few iterations; the soil's answer, fluxes and snow cost as much.",
    kind=LEVEL,
)
def solver_share(evidence):
    table = evidence.beside("profile_kernel.csv", pd.read_csv).set_index("phase")
    phases = ("solve_canopy", "answer_to_canopy")
    share = {name: 100 * table.loc[name].sum() / table.loc["sum"].sum() for name in phases}
    ours = Number(share["solve_canopy"])
    rows = [
        Row("share of the solver [%], mean of four moments of the year", published("canopy_solver_share"), ours),
        Row("with the other nodes' answer, from which it starts [%]", "", Number(sum(share.values()))),
    ]
    return finding(rows, about(ours, 60, 70))


@claim("An environment needs 50 to 100 MB of memory.", "Appendix, runtime", BENCHMARK, note=FASTER)
def memory(evidence):
    ours = measured(evidence, "async worker")
    what = "a worker's own memory, without what it shares with the others [MB]"
    return finding([Row(what, published("memory_per_env"), ours)], below(ours, most("memory_per_env")))


@claim(
    "16 environments and the agent fit into 2 to 3 GB.",
    "Appendix, runtime",
    BENCHMARK,
    note="The agent's process was not measured: its library alone takes more memory than sixteen environments.",
)
def memory_of_all(evidence):
    worker, process = measured(evidence, "async worker"), measured(evidence, "this process")
    ours = Number((WORKERS * worker.value + process.value) / 1000)
    rows = [Row("16 workers and a process that has the physics [GB]", published("memory_16_envs_and_agent"), ours)]
    return Finding(rows, UNTESTABLE)


@claim(
    "A training costs one dollar of cloud computing (c5.4xlarge).",
    "Appendix, runtime",
    only("main"),
    note="For the whole machine of sixteen virtual cores (on demand, Linux, Northern Virginia; the price is from "
    "AWS's documentation of Auto Scaling), though a training of ours uses one of them; evaluation included. "
    "The time is that of another, faster processor.",
)
def dollars(evidence):
    spent = pd.Series(
        [
            DOLLARS_PER_HOUR * (hours(run)["training"] + hours(run)["evaluation"])
            for one in evidence.replicates("main", "ppo_curriculum")
            for run in one.runs
        ]
    )
    printed = paper("runtime", index_col="quantity").loc["training_generalist_16_workers"]
    low, high = (DOLLARS_PER_HOUR * value for value in (printed.low, printed.high))
    ours = seeds(spent)
    rows = [
        Row("USD a training", f"1 ({low:.2f} - {high:.2f} from its hours)", ours),
        Row("price of the machine [USD/h]", "", Number(DOLLARS_PER_HOUR)),
    ]
    return finding(rows, below(ours, 1.1))


CLAIMS = (episode, pure_python, *TRAINING, workers, solver_share, memory, memory_of_all, dollars)
