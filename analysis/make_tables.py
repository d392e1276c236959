"""Turns the runs that exist, yours and the project's, into runs/tables/*.csv, *.md and *.tex, beside the paper's.

    python analysis/make_tables.py [--runs-dir runs results/runs] [--tables-dir runs/tables]

Those of results/tables are of the project's runs alone; `reproduce.py` makes them.

A table without a number of ours is not written, and what an earlier call left of it is removed.

Runs are recognised by their config.json, never by the name of their folder. Runs of one script that differ only in
the seed form one row: the metrics are computed for each run, then aggregated over training seeds (interquartile mean,
95 % bootstrap interval). The main table has the score of the greedy and of the sampled policy; all other numbers are of
the greedy one. A column "sd over episodes" is the paper's kind of +-.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

from analysis import paths
from analysis import runs as finished
from analysis.results import Results
from analysis.tables import (
    best_known,
    choices,
    curriculum_selection,
    detailed_objectives,
    growing_season_correlations,
    lambda_violations,
    learned_strategies,
    learning_difficulty,
    main_results,
    many_objectives,
    physical_conflicts,
    runtime,
    single_sites,
    thaw_formulations,
    warming_flux,
)
from analysis.tables.common import has_numbers, readable, remove_table, write_table
from cleanrl_style import protocol

TABLES = (
    main_results,
    thaw_formulations,
    growing_season_correlations,
    learned_strategies,
    warming_flux,
    physical_conflicts,
    curriculum_selection,
    detailed_objectives,
    lambda_violations,
    runtime,
    learning_difficulty,
    single_sites,
    best_known,
    choices,
)

SHOWN = 3  # commands of what is not there
EXPLANATION = """Score: 0 is to do nothing, 100 the best constant plan of each weight. Interquartile mean over training
seeds [95 % bootstrap interval, of score and gain over seeds and sites]; of the weighted sum, whatever the utility of a
training. Seeds to tell 0.1: how many training seeds each of two methods needs for a t test (5 %) to find a difference
of 0.1 in gain with a power of 80 %. Compare methods by gain hypervolume: `hypervolume` and `sparsity` of the table's
files are of returns above (-2, -2), as the paper has them."""


@dataclass
class Args:
    """Makes the tables from the runs that exist."""

    runs_dir: tuple[Path, ...] | None = None
    """folders that hold the runs, at any depth (None: results/runs and runs)"""
    tables_dir: Path | None = None
    """folder for the tables (None: runs/tables, or runs/quick/tables)"""
    quick: bool = False
    """from the runs of `reproduce.py --quick`"""


def name_of(table) -> str:
    """A table's file name: that of its module."""
    return table.__name__.rsplit(".")[-1]


def say_what_is_missing(results: Results) -> None:
    """Print how many rows and studies of the project's experiments are not there, and the first commands of them."""
    rows = {job.row: job for job in reversed(results.missing)}
    commands = [job.command for job in reversed(rows.values())]
    studies = [job for job in results.jobs if job.is_study and results.study(job.script) is None]
    commands += [job.command for job in studies]
    if commands:
        print(f"\nOf the project's experiments {len(commands)} rows and studies are not there, or not whole:")
        print("\n".join(f"  {line}" for line in commands[:SHOWN]))
        more = f"  and {len(commands) - SHOWN} more; " if len(commands) > SHOWN else "  "
        print(f"{more}`python analysis/reproduce.py --list` names all, without --list makes them")


def say_what_was_not_run(what: str, lines: list[str]) -> None:
    """Print the tables or figures that have no data, with their commands."""
    if lines:
        print(f"\nNot run yet, so these {what} are not there:")
        print("\n".join(f"  {line}" for line in lines))


def main(args: Args) -> None:
    """Write every table; print the main one's rows that have runs, and what was left out or is missing."""
    results = Results.load(args.quick, args.runs_dir)
    print(f"tables of {len(results.runs)} runs\n", flush=True)
    rows = results.rows  # completes left_out
    for line in results.left_out:
        print(f"left out: {line}", file=sys.stderr)
    others = finished.of_another_physics(results.runs)
    if others:
        of = (
            f"{len(others)} of {len(results.runs)} runs are of another version of the simulator, or do not say of which"
        )
        print(
            f"{of}: {others[0].folder}{', ..' * (len(others) > 1)}; the script's --overwrite trains one anew",
            file=sys.stderr,
        )
    for line in results.of_several_sources():
        print(f"warning: {line}", file=sys.stderr)
    mixed = [run for run in results.runs if "begun_with" in run.config]
    if mixed:
        of = f"{len(mixed)} of {len(results.runs)} runs were begun with one code and went on with another"
        print(f"{of}, such as {mixed[0].folder} (begun_with in config.json)", file=sys.stderr)
    if not results.runs:
        where, first = ", ".join(map(str, results.roots)), results.missing[0].command
        protocol.fail(f"no finished run under {where}; `{first}` makes the first, `python analysis/reproduce.py` all")
    folder = args.tables_dir or paths.runs(args.quick) / "tables"
    paths.make_writable("--tables-dir", folder)
    not_run = []
    for module in TABLES:
        table = module.make(results)
        if not has_numbers(table, module.COLUMNS):
            remove_table(folder / name_of(module))
            not_run.append(f"{name_of(module)}: {module.MADE_BY}")
            continue
        text = readable(table, module.COLUMNS)
        write_table(folder / name_of(module), table, text)
        if module is main_results:
            print(f"{EXPLANATION}\n")
            shown = text[list(main_results.TERMINAL)]
            print(shown[(table.seeds > 0).to_numpy()].to_string(index=False))
            keys = zip(table.method, table.environment, table.setting, strict=True)
            own = [key in results.own for key in keys]
            if any(own) and args.runs_dir is None and not args.quick:
                print(f"\nYours, once more:\n\n{shown[own].to_string(index=False)}")
            elsewhere = [run for run in results.runs if run.arguments["env_id"] not in main_results.ENVIRONMENTS]
            if elsewhere:
                places = "detailed_objectives*.md, those of three and more objectives in main_results_*.md too"
                print(f"\nRuns of other environments, {len(elsewhere)}, are in {folder}: {places}.")
    others = many_objectives.make(results)
    for stem in many_objectives.STEMS:
        for path in set(folder.glob(f"{stem}_*.csv")) - {folder / f"{name}.csv" for name in others}:
            remove_table(path)
    for name, (table, columns) in others.items():
        write_table(folder / name, table, readable(table, columns))
    say_what_is_missing(results)
    if any(one.gains is None for replicates in rows.values() for one in replicates):
        print("Gains need a run of baselines_heuristic/zero_change.py in the same environment, as long.")
    say_what_was_not_run("tables", not_run)
    print(f"\n{len(TABLES) - len(not_run) + len(others)} tables with all columns: {folder}/*.csv, *.md, *.tex")


if __name__ == "__main__":
    main(protocol.parse(Args))
