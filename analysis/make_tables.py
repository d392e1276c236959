"""Turns the runs that exist into results/tables/*.csv, *.md and *.tex, ours beside the paper's.

    python analysis/make_tables.py [--runs-dir runs] [--tables-dir results/tables]

Runs are recognised by their config.json, never by the name of their folder. Runs of one script that differ
only in the seed form one row: the metrics are computed for each run, then aggregated over training seeds
(interquartile mean, 95 % bootstrap interval). All numbers are of the sampled policy.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import tyro

from analysis import metrics
from analysis.evaluation import EVALUATION_COLUMNS
from analysis.protocol import FLOAT_FORMAT

# Our scripts in the order of the paper's main table, and what its tables call them.
METHODS = {
    "ppo_curriculum": "curriculum_ppo",
    "ppo_gated": "ppo_gated",
    "eupg_var_lambda": "eupg_variable_lambda",
    "target_density": "target_density",
    "conifer_restoration": "conifer_restoration",
    "zero_change": "zero_density_change",
    "plus_100": "plus_100_density",
}
PAPER_TABLES = Path(__file__).parent / "paper_tables"
ENVIRONMENTS = ("boreal-generalist-v0", "boreal-balanced-v0")
METRICS = ("scalarized", "hypervolume", "sparsity", "gain_scalarized", "gain_hypervolume", "gain_sparsity",
           "violations_percent", "significant_violations_percent")


def command(script: str, env_id: str) -> str | None:
    """The command that makes the first run of a row; None if the project has no such script."""
    root = Path(__file__).parents[1]
    environment = "" if env_id == "boreal-generalist-v0" else f" --env-id {env_id}"
    for folder in ("cleanrl_style", "baselines_heuristic"):
        if (root / folder / f"{script}.py").exists():
            return f"python {folder}/{script}.py --seed 1{environment}"
    return None


# --------------------------------------------------------------------------------------------------- runs


def read_run(config_file: Path) -> tuple[dict, pd.DataFrame]:
    """A run's configuration and evaluation (sampled policy); ValueError says why it cannot be used."""
    try:
        config = json.loads(config_file.read_text(encoding="utf-8"))
        arguments = config["arguments"]
        expected = len(arguments["eval_weights"]) * arguments["eval_episodes"]
        config["script"], config["not_default"], arguments["env_id"], arguments["seed"]
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"damaged: config.json ({error!r})") from error
    if not config_file.with_name("evaluation.csv").exists():
        raise ValueError("unfinished: it has no evaluation.csv")
    try:
        evaluation = pd.read_csv(config_file.with_name("evaluation.csv"))
    except ValueError as error:
        raise ValueError(f"damaged: evaluation.csv ({error})") from error
    missing = set(EVALUATION_COLUMNS) - set(evaluation.columns)
    if missing:
        raise ValueError(f"damaged: evaluation.csv lacks the column {sorted(missing)[0]}")
    evaluation = evaluation[evaluation.policy == "sampled"]
    if len(evaluation) != expected:
        raise ValueError(f"damaged: evaluation.csv has {len(evaluation)} episodes of the sampled policy, "
                         f"not {expected}")
    if not np.isfinite(evaluation[metrics.OBJECTIVES].to_numpy(dtype=float)).all():
        raise ValueError("damaged: evaluation.csv has returns that are not finite numbers")
    return config, evaluation


def read_runs(runs_dir: Path) -> tuple[list[tuple[dict, pd.DataFrame]], list[str]]:
    """All usable runs under a folder, and one line for each that was left out."""
    runs, left_out, seen = [], [], {}
    for config_file in sorted(runs_dir.rglob("config.json")):
        try:
            config, evaluation = read_run(config_file)
        except ValueError as error:
            left_out.append(f"{config_file.parent}: {error}")
            continue
        identity = json.dumps([config["script"], config["arguments"]], sort_keys=True)
        if identity in seen:
            left_out.append(f"{config_file.parent}: the same run as {seen[identity]}")
            continue
        seen[identity] = config_file.parent
        runs.append((config, evaluation))
    return runs, left_out


def setting(config: dict) -> str:
    """What is not default in a run, except its seed: runs that agree in it are one row."""
    return ", ".join(f"{name}={value}" for name, value in sorted(config["not_default"].items())) or "default"


def group_runs(runs: list) -> dict[tuple, list]:
    """(script, environment, setting) -> list of (evaluation, gains or None), one for each training seed.

    The default setting of every method is always there, without runs if there are none. Gains need an
    evaluation of zero change on the same episodes under the same reward.
    """
    def conditions(config):
        return tuple(config["arguments"][name] for name in ("env_id", "thaw_formulation", "site_seed"))

    zero_changes = {}
    for config, evaluation in sorted(runs, key=lambda run: len(run[1])):
        if config["script"] == "zero_change":
            zero_changes[conditions(config)] = evaluation  # the longest evaluation
    groups = {(script, env_id, "default"): [] for env_id in ENVIRONMENTS for script in METHODS}
    for config, evaluation in runs:
        zero_change = zero_changes.get(conditions(config))
        known = zero_change is not None and set(evaluation.seed) <= set(zero_change.seed)
        gains = metrics.gains(evaluation, zero_change) if known else None
        key = config["script"], config["arguments"]["env_id"], setting(config)
        groups.setdefault(key, []).append((evaluation, gains))

    def order(key):
        script, env_id, what = key
        return [*ENVIRONMENTS, env_id].index(env_id), [*METHODS, script].index(script), what != "default", key

    return {key: groups[key] for key in sorted(groups, key=order)}


# ------------------------------------------------------------------------------------------------- tables


def front_metrics(evaluation: pd.DataFrame, prefix: str = "") -> dict:
    """Mean scalarised return, hypervolume and sparsity of one run; one point has no sparsity."""
    front = metrics.mean_returns(evaluation).to_numpy()
    return {
        f"{prefix}scalarized": metrics.mean_scalarized(evaluation),
        f"{prefix}hypervolume": metrics.hypervolume(front),
        f"{prefix}sparsity": metrics.sparsity(front) if np.ptp(front, axis=0).any() else np.nan,
    }


def run_metrics(evaluation: pd.DataFrame, gains: pd.DataFrame | None) -> dict:
    """The metrics of one run. A policy that does not depend on the preference has no violations to count."""
    row = front_metrics(evaluation) | {"sd_over_episodes": evaluation.scalarized_return.std()}
    front = metrics.mean_returns(evaluation).to_numpy()
    if np.ptp(front, axis=0).any():
        row["violations_percent"] = metrics.violations_percent(front)
        row["significant_violations_percent"] = metrics.significant_violations_percent(evaluation)
    return row if gains is None else row | front_metrics(gains, "gain_")


def paper_rows() -> pd.DataFrame:
    """The paper's main table and violations, and what its own table of details gives for the same."""
    table = pd.read_csv(PAPER_TABLES / "main_results.csv").set_index("method")
    violations = pd.read_csv(PAPER_TABLES / "monotonicity_violations.csv").set_index("method")
    details = pd.read_csv(PAPER_TABLES / "detailed_objectives.csv")
    fronts = details.groupby("method")[["carbon_mean", "thaw_mean"]]
    return pd.DataFrame({
        "paper_scalarized": table.scalarized_mean,
        "paper_sd_over_episodes": table.scalarized_std,
        "paper_hypervolume": table.hypervolume,
        "paper_sparsity": table.sparsity,
        "paper_violations_percent": violations.violations_percent,
        "paper_detail_hypervolume": fronts.apply(metrics.hypervolume),
        "paper_detail_sparsity": fronts.apply(metrics.sparsity),
    })


def over_seeds(values: pd.DataFrame) -> dict:
    """Interquartile mean of each column over training seeds (rows), with its 95 % bootstrap interval."""
    row = {}
    for name in values:
        known = values[name].dropna().to_numpy()
        row[name] = metrics.iqm(known) if len(known) else np.nan
        row[f"{name}_low"], row[f"{name}_high"] = metrics.bootstrap_interval(known)
    return row


def main_results(groups: dict) -> pd.DataFrame:
    """Main comparison: one row per script, environment and setting."""
    paper, rows = paper_rows(), []
    for (script, env_id, what), results in groups.items():
        columns = [*METRICS, "sd_over_episodes"]
        runs = pd.DataFrame([run_metrics(*result) for result in results], columns=columns)
        row = {"method": script, "environment": env_id, "setting": what, "seeds": len(runs)}
        row |= over_seeds(runs[[*METRICS]]) | {"sd_over_episodes": runs.sd_over_episodes.mean()}
        if env_id == "boreal-generalist-v0" and script in METHODS:
            row |= paper.loc[METHODS[script]].to_dict()
        rows.append(row)
    return pd.DataFrame(rows)


def detailed_objectives(groups: dict) -> pd.DataFrame:
    """Both returns and their gains: one row per script, environment, setting and weight that has runs."""
    paper = pd.read_csv(PAPER_TABLES / "detailed_objectives.csv", index_col=["method", "lambda_carbon"])
    rows = []
    for (script, env_id, what), results in groups.items():
        tables = [metrics.mean_returns(evaluation) for evaluation, _ in results]
        gains = [metrics.mean_returns(gain).rename(columns=lambda name: name.replace("return", "gain"))
                 for _, gain in results if gain is not None]
        for weight in tables[0].index if tables else ():
            row = {"method": script, "environment": env_id, "setting": what, "seeds": len(results),
                   "weight": weight}
            row |= over_seeds(pd.concat([table.loc[[weight]] for table in tables]))
            if gains:
                row |= over_seeds(pd.concat([table.loc[[weight]] for table in gains]))
            if env_id == "boreal-generalist-v0" and (METHODS.get(script), weight) in paper.index:
                row |= paper.loc[METHODS[script], weight].add_prefix("paper_").to_dict()
            rows.append(row)
    return pd.DataFrame(rows)


# ------------------------------------------------------------------------------------------------- output


def cell(row: pd.Series, name: str) -> str:
    """A value as text; a number with its interval over training seeds, if there is one."""
    if name == "scalarized" and row.seeds == 0:
        return "no run yet"
    value, low, high = (row.get(key, np.nan) for key in (name, f"{name}_low", f"{name}_high"))
    if isinstance(value, str):
        return value
    if pd.isna(value):
        return ""
    return f"{value:.4g}" if pd.isna(low) else f"{value:.4g} [{low:.4g}, {high:.4g}]"


def readable(table: pd.DataFrame, headings: dict[str, str]) -> pd.DataFrame:
    """The table's chosen columns as text: name -> heading."""
    return pd.DataFrame([{heading: cell(row, name) for name, heading in headings.items()}
                         for _, row in table.iterrows()])


MAIN_HEADINGS = {
    "method": "method",
    "environment": "environment",
    "setting": "setting",
    "seeds": "seeds",
    "scalarized": "scalarised",
    "paper_scalarized": "scalarised (paper)",
    "sd_over_episodes": "sd over episodes",
    "paper_sd_over_episodes": "sd over episodes (paper)",
    "hypervolume": "hypervolume",
    "paper_hypervolume": "hypervolume (paper)",
    "paper_detail_hypervolume": "hypervolume (paper's details)",
    "sparsity": "sparsity",
    "paper_sparsity": "sparsity (paper)",
    "paper_detail_sparsity": "sparsity (paper's details)",
    "gain_scalarized": "gain",
    "gain_hypervolume": "gain hypervolume",
    "gain_sparsity": "gain sparsity",
    "violations_percent": "violations %",
    "significant_violations_percent": "violations beyond interval %",
    "paper_violations_percent": "violations % (paper)",
}
DETAIL_HEADINGS = {
    "method": "method",
    "environment": "environment",
    "setting": "setting",
    "seeds": "seeds",
    "weight": "weight",
    "carbon_return": "carbon",
    "paper_carbon_mean": "carbon (paper)",
    "thaw_return": "thaw",
    "paper_thaw_mean": "thaw (paper)",
    "carbon_gain": "carbon gain",
    "thaw_gain": "thaw gain",
}
TERMINAL = ["method", "environment", "setting", "seeds", "scalarised", "scalarised (paper)", "hypervolume",
            "hypervolume (paper)", "gain hypervolume"]


def write_table(stem: Path, table: pd.DataFrame, text: pd.DataFrame) -> None:
    """stem.csv with all numbers; stem.md and stem.tex (booktabs) with the readable columns."""
    table.to_csv(stem.with_suffix(".csv"), index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
    lines = [text.columns, ["---"] * text.shape[1], *text.to_numpy()]
    markdown = "".join("| " + " | ".join(line) + " |\n" for line in lines)
    stem.with_suffix(".md").write_text(markdown, encoding="utf-8")
    head, *body = [" & ".join(line).replace("_", r"\_").replace("%", r"\%") + r" \\"
                   for line in (text.columns, *text.to_numpy())]
    latex = [rf"\begin{{tabular}}{{{'l' * text.shape[1]}}}", r"\toprule", head, r"\midrule", *body,
             r"\bottomrule", r"\end{tabular}"]
    stem.with_suffix(".tex").write_text("\n".join(latex) + "\n", encoding="utf-8")


def main(runs_dir: Path = Path("runs"), tables_dir: Path = Path("results/tables")) -> None:
    """Make the tables from the runs that exist.

    Args:
        runs_dir: folder that holds the runs, at any depth
        tables_dir: folder for the tables
    """
    runs, left_out = read_runs(runs_dir)
    for line in left_out:
        print(f"left out: {line}", file=sys.stderr)
    groups = group_runs(runs)
    missing = [(script, command(script, env_id))
               for (script, env_id, _), results in groups.items() if not results]
    commands = "\n".join(f"  {line}" for _, line in missing if line)
    without_script = {script: None for script, line in missing if not line}
    if not runs:
        sys.exit(f"error: no finished run under {runs_dir}; these commands make the rows:\n{commands}")

    try:
        tables_dir.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        sys.exit(f"error: --tables-dir {tables_dir}: cannot write there ({error.strerror})")
    table = main_results(groups)
    text = readable(table, MAIN_HEADINGS)
    write_table(tables_dir / "main_results", table, text)
    details = detailed_objectives(groups)
    write_table(tables_dir / "detailed_objectives", details, readable(details, DETAIL_HEADINGS))

    print("Sampled policies; interquartile mean over training seeds [95 % bootstrap interval].\n")
    print(text[TERMINAL].to_string(index=False))
    if missing:
        print(f"\nNo run yet for some rows; these commands make them:\n{commands}")
    if without_script:
        print(f"No script yet for {', '.join(without_script)}.")
    if any(gain is None for results in groups.values() for _, gain in results):
        print("Gains need a run of baselines_heuristic/zero_change.py in the same environment, as long.")
    print(f"\nAll columns, and the returns per weight: {tables_dir}/*.csv, *.md, *.tex")


if __name__ == "__main__":
    tyro.cli(main)
