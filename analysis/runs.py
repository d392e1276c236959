"""Finished runs on disk: those of `runs/`, and the archive in `results/runs/`, which has the reduced tables alone.

A run is recognised by its config.json, never by the name of its folder, and is finished when its evaluation is there.
"""

import json
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import paths, reduction
from cleanrl_style.protocol import files, fronts
from cleanrl_style.protocol.evaluation import POLICIES, PRIMARY
from cleanrl_style.protocol.provenance import physics_name
from cleanrl_style.protocol.run_folder import as_text

SITE_SPECIFIC = "site-specific"  # the mode in which all episodes are of one site and weather
ARCHIVED = "tables.zip"  # the reduced tables of an archived run
NAMES_IN_TABLES = ("policy", "variable", "phase")  # columns of a run's tables that are no numbers

# What a run's config.json has in any case, and its arguments.
OF_CONFIG = {"script": str, "not_default": dict, "arguments": dict}
OF_ARGUMENTS = {"env_id": str, "mode": str, "seed": int, "eval_weights": list, "eval_episodes": int}
OF_ARGUMENTS |= {"thaw_formulation": str, "site_seed": int | None}
OF_TRAINING = {"total_timesteps": int | None, "num_envs": int | None}

# Arguments that do not make another row: what tells its runs apart, what the row has a column for, and the output.
NOT_A_SETTING = ("seed", "site_seed", "preference", "mode", "env_id", "run_dir", "overwrite")


@dataclass(frozen=True)
class Run:
    """A finished run: its configuration, and what `analysis.reduction` keeps of its tables, by name."""

    folder: Path
    config: dict
    tables: dict[str, pd.DataFrame]

    @property
    def script(self) -> str:
        """Name of the script, without .py."""
        return self.config["script"]

    @property
    def arguments(self) -> dict:
        """Every argument of the script."""
        return self.config["arguments"]

    @property
    def evaluation(self) -> pd.DataFrame:
        """The episodes of the primary policy."""
        return self.of_policy(PRIMARY)

    def of_policy(self, policy: str) -> pd.DataFrame:
        """The episodes of one policy."""
        table = self.tables["evaluation"]
        return table[table.policy == policy]

    def course(self, column: str, statistic: str = "mean", parts: int = reduction.BINS) -> np.ndarray:
        """Mean or standard deviation ("std") of a column in equal parts of the training, see `reduction.course`."""
        return reduction.course(self.tables["learning"], column, statistic, parts)

    @property
    def setting(self) -> str:
        """What is not default in the run, but for what tells replicates apart: runs that agree in it are one row."""
        return setting(self.config["not_default"], self.arguments["mode"])

    @property
    def share_selected(self) -> float:
        """Share of a curriculum's episodes that it was trained on."""
        (row,) = self.tables["selection"].itertuples()
        return row.selected / row.episodes


def setting(not_default: dict, mode: str) -> str:
    """name=value of the arguments that make a row, "default" if there are none; which single site, makes none."""
    items = {name: value for name, value in not_default.items() if name not in NOT_A_SETTING}
    if not_default.get("site_seed") is not None and mode != SITE_SPECIFIC:
        items["site_seed"] = "one"
    return ", ".join(f"{name}={as_text(value)}" for name, value in sorted(items.items())) or "default"


def identity(config: dict) -> str:
    """The same for two folders exactly if they hold the same run: arguments may have come or gone since, with what is
    now the default."""
    arguments, changed = config["arguments"], dict(config["not_default"])
    named = {name: arguments.get(name) for name in ("env_id", "mode", "seed", "site_seed", "preference")}
    return json.dumps([config["script"], changed | named], sort_keys=True)


def is_finished(folder: Path) -> bool:
    """Whether a folder's run is finished: it has its evaluation, or is archived."""
    return (folder / ARCHIVED).exists() or (folder / "evaluation.csv").exists()


def read_archived(folder: Path) -> dict[str, pd.DataFrame]:
    """The tables of an archived run; ValueError if they cannot be read."""
    try:
        with zipfile.ZipFile(folder / ARCHIVED) as file:
            return {name.removesuffix(".csv"): reduction.parse(file.read(name).decode()) for name in file.namelist()}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise ValueError(f"damaged: {ARCHIVED} ({error})") from error


def read_whole(folder: Path, trained: bool) -> dict[str, pd.DataFrame]:
    """The tables of a run of runs/; ValueError says which is missing or cannot be read."""
    tables = {}
    for name in ("evaluation", "timing", "evaluation_years", "cost", *(["episodes", "validation"] if trained else [])):
        path = folder / f"{name}.csv"
        if not path.exists() and name in ("evaluation_years", "validation", "cost"):
            continue  # its environment keeps no annual record or is not ours; the run is ours
        if not path.exists():
            raise ValueError(f"{'unfinished' if name == 'evaluation' else 'partial'}: it has no {name}.csv")
        tables[name] = read_table(path)
        lacking = [column for column in reduction.NEEDED.get(name, ()) if column not in tables[name]]
        if lacking:
            raise ValueError(f"damaged: {name}.csv lacks the column {lacking[0]}")
    return tables


def read_table(path: Path) -> pd.DataFrame:
    """A table of a run; ValueError names the file that cannot be read, or its first line of text for a number."""
    try:
        table = pd.read_csv(path)
    except (ValueError, OSError) as error:
        raise ValueError(f"damaged: {path.name} ({in_a_line(error)})") from error
    if files.is_cut(path):
        raise ValueError(f"damaged: {path.name} does not end with a newline")
    for name in table.columns.difference(NAMES_IN_TABLES, sort=False):
        wrong = table[name].notna() & pd.to_numeric(table[name], errors="coerce").isna()
        if wrong.any():
            row = int(np.argmax(wrong))
            raise ValueError(f"damaged: {path.name}, line {row + 2}: {name} is {table[name].iloc[row]!r}, not a number")
    return table


def in_a_line(error: Exception) -> str:
    """What an error says, without its line breaks."""
    return " ".join(str(error).split())


def read_config(folder: Path) -> dict:
    """A run's configuration; ValueError if it cannot be used."""
    try:
        config = json.loads((folder / "config.json").read_text(encoding="utf-8"))
        check_kinds(config, OF_CONFIG)
        check_kinds(config["arguments"], OF_ARGUMENTS)
        check_kinds({**dict.fromkeys(OF_TRAINING), **config["arguments"]}, OF_TRAINING)
        if Path(config["script"]).name != config["script"]:
            raise ValueError(f"script is {config['script']!r}, no name of one")
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise ValueError(f"damaged: config.json ({error!r})") from error
    return config


def check_kinds(values: dict, kinds: dict) -> None:
    """KeyError or TypeError for the first value that is not there, or of another kind."""
    for name, kind in kinds.items():
        if not isinstance(values[name], kind):
            raise TypeError(f"{name} is {values[name]!r}, not of {getattr(kind, '__name__', kind)}")


def read_run(folder: Path | str) -> Run:
    """A run; ValueError says why it cannot be used."""
    folder = Path(folder)
    config = read_config(folder)
    if (folder / ARCHIVED).exists():
        tables = read_archived(folder)
        if "evaluation" not in tables:
            raise ValueError(f"damaged: {ARCHIVED} has no evaluation.csv")
        check(tables["evaluation"], config)
        return Run(folder, config, tables)
    steps = config["arguments"].get("total_timesteps")
    tables = read_whole(folder, steps is not None)
    check(tables["evaluation"], config)
    if steps is not None:
        check_training(tables, config["arguments"])
    return Run(folder, config, reduction.reduce(tables, steps))


def check(evaluation: pd.DataFrame, config: dict) -> None:
    """ValueError if an evaluation is not whole."""
    objectives = fronts.objectives_of(evaluation.columns)
    needed = ["policy", "seed", "site_seed", "scalarized_return", *fronts.weight_columns(objectives)]
    missing = [name for name in needed if name not in evaluation]
    if missing:
        raise ValueError(f"damaged: evaluation.csv with the returns of {objectives} lacks the column {missing[0]}")
    for policy in POLICIES:
        check_policy(evaluation[evaluation.policy == policy], policy, config["arguments"], objectives)


def check_policy(evaluation: pd.DataFrame, policy: str, arguments: dict, objectives: list[str]) -> None:
    """ValueError if the episodes of a policy are not whole."""
    expected = len(arguments["eval_weights"]) * arguments["eval_episodes"]
    # on the fixed site every greedy episode is the first again, and one may stand for all
    alike = policy == "greedy" and arguments["mode"] == SITE_SPECIFIC
    if len(evaluation) != expected and not (alike and len(evaluation) == len(arguments["eval_weights"])):
        raise ValueError(
            f"damaged: evaluation.csv has {len(evaluation)} episodes of the {policy} policy, not {expected}"
        )
    episodes = evaluation.groupby(fronts.weight_columns(objectives)).seed.nunique()
    if len(episodes) != len(arguments["eval_weights"]):
        raise ValueError(f"damaged: evaluation.csv has {len(episodes)} weights, not {len(arguments['eval_weights'])}")
    if episodes.nunique() != 1:
        least, most = episodes.min(), episodes.max()
        raise ValueError(
            f"damaged: evaluation.csv lacks episodes: {least} of the weight {episodes.idxmin()}, not {most}"
        )
    for what, columns in (
        ("weights", fronts.weight_columns(objectives)),
        ("returns", fronts.return_columns(objectives)),
    ):
        if not np.isfinite(evaluation[columns].apply(pd.to_numeric, errors="coerce").to_numpy(dtype=float)).all():
            raise ValueError(f"damaged: evaluation.csv has {what} that are not finite numbers")


def check_training(tables: dict[str, pd.DataFrame], arguments: dict) -> None:
    """ValueError if the log of a finished training lacks a column, or ends before half of its steps: it was cut."""
    episodes, steps, years = tables["episodes"], arguments["total_timesteps"], tables.get("evaluation_years")
    objectives = fronts.objectives_of(tables["evaluation"].columns)
    needed = [*fronts.weight_columns(objectives), *fronts.return_columns(objectives)]
    needed += ["site_seed", "threshold", "score"] if "selected" in episodes else []
    lacking = [name for name in needed if name not in episodes]
    if lacking:
        raise ValueError(f"damaged: episodes.csv lacks the column {lacking[0]}")
    if years is None:
        return  # how long its episodes are is not known
    first_end = max(arguments.get("num_envs") or 1, episodes.env.nunique()) * years.year.max()
    last = 0 if episodes.empty else episodes.global_step.max()
    if first_end <= steps and not last >= steps / 2:  # a search by generations may end with half of its steps left
        raise ValueError(f"damaged: episodes.csv ends at step {last} of {steps}")


def of_another_physics(runs: list[Run]) -> list[Run]:
    """Those that another simulator or environment than this checkout's has made, or that do not say which."""
    return [run for run in runs if not is_of_this_physics(run)]


def run_folders(root: Path, *files: str) -> list[Path]:
    """Folders below `root` that hold one of the files, config.json if none is named, in order; those of
    `reproduce.py --quick` only if asked for.
    """
    folders = sorted({path.parent for name in files or ("config.json",) for path in root.rglob(name)})
    return [folder for folder in folders if folder.relative_to(root).parts[:1] != (paths.QUICK,)]


def read_runs(*roots: Path) -> tuple[list[Run], list[str]]:
    """All usable runs below the folders, and one line for each that was left out.

    The same run below two of the folders counts once, the first, unless they differ and the other alone is of this
    checkout's physics; differing, or twice below one folder, it is reported.
    """
    found, left_out, roots_of = {}, [], {}
    for root in roots:
        with_config = run_folders(root)
        nameless = sorted({*run_folders(root, "evaluation.csv", ARCHIVED)} - {*with_config})
        left_out += [f"{folder}: damaged: it has no config.json" for folder in nameless]
        for folder in with_config:
            try:
                run = read_run(folder)
            except ValueError as error:
                left_out.append(f"{folder}: {error}")
                continue
            name = identity(run.config)
            first = found.setdefault(name, run)
            if first is run:
                roots_of[name] = root
            elif roots_of[name] == root:
                left_out.append(f"{folder}: the same run as {first.folder}")
            elif not first.evaluation.equals(run.evaluation):
                found[name] = run if is_of_this_physics(run) and not is_of_this_physics(first) else first
                other = first if found[name] is run else run
                left_out.append(f"{other.folder}: other results than {found[name].folder}, which counts")
    return list(found.values()), left_out


def is_of_this_physics(run: Run) -> bool:
    """Whether a run says that this checkout's simulator and environment have made it."""
    return run.config.get("physics") == physics_name()
