"""Checks and scores a policy as the leaderboard does: on the test sites of the generalist and the balanced task.

    python analysis/score_policy.py runs/ppo_group/boreal-balanced-v0-vectorization=lockstep/seed1
    python analysis/score_policy.py their_policy.pt --script their_method.py --name "Their method" --add

A run's folder is checked first: its policy has to play the evaluation that lies beside it, of which the first eight
episodes of each weight are played again. --add puts the row into docs/leaderboard.csv, and the table into
docs/leaderboard.md.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from cleanrl_style.flags import TEST_SITES, fail, parse, policy_file, require

require("tyro")

import tyro

TASKS = ("boreal-generalist-v0", "boreal-balanced-v0")
PAGE, TABLE = Path("docs", "leaderboard.md"), Path("docs", "leaderboard.csv")
SECTION = re.compile(r"(<!-- leaderboard -->\n).*?(<!-- end of leaderboard -->)", re.DOTALL)
CHECKED = 8  # episodes a weight that are played again
SUBMITTED = ("config.json", "policy.pt", "evaluation.csv")  # what a run's folder is handed in with


@dataclass
class Args:
    """Checks and scores a policy on the test sites."""

    policy: tyro.conf.Positional[Path]
    """folder of a run, policy file, or name of a policy that ships"""
    script: Path | None = None
    """the script that trained it, if that does not lie in cleanrl_style/"""
    tasks: tuple[str, ...] = TASKS
    """environments to score it on"""
    episodes: int = TEST_SITES
    """the first of the test sites; a row of the leaderboard has all"""
    name: str | None = None
    """name of the row (None: the script's)"""
    add: bool = False
    """put the row into the leaderboard"""
    replace: bool = False
    """in place of the row of that name"""
    root: Path = Path()
    """folder of docs/"""


def check_flags(args: Args) -> None:
    """End the command with one line for what is wrong without a look at the policy."""
    if not 1 <= args.episodes <= TEST_SITES:
        fail(f"--episodes {args.episodes}: 1 to {TEST_SITES} are allowed")
    if not args.tasks:
        fail(f"--tasks: at least one is needed, such as {TASKS[0]}")
    if args.add and (set(args.tasks) != set(TASKS) or args.episodes != TEST_SITES):
        fail(f"--add: a row of the leaderboard is of both tasks and all {TEST_SITES} test sites")
    page = args.root / PAGE
    if args.add and not (page.is_file() and SECTION.search(page.read_text(encoding="utf-8"))):
        fail(f"--root {args.root}: no {PAGE} with <!-- leaderboard --> to <!-- end of leaderboard -->")
    if args.replace and not args.add:
        fail("--replace goes with --add")
    if args.name is not None and (not args.name.strip() or {"|", "\n"} & set(args.name)):
        fail(f"--name {args.name!r}: a cell of a table, without |, is allowed")
    if args.name is not None and not args.add:
        fail("--name goes with --add")
    if args.script is not None and not (args.script.is_file() and args.script.suffix == ".py"):
        fail(f"--script {args.script}: a file that ends in .py, and is there, is allowed")
    try:
        policy_file(args.policy)
    except FileNotFoundError as error:
        fail(str(error))
    missing = [name for name in SUBMITTED if args.policy.is_dir() and not (args.policy / name).is_file()]
    if missing:
        fail(f"{args.policy}: it has no {missing[0]}; a run's folder has {', '.join(SUBMITTED)}")


if __name__ == "__main__":
    args = parse(Args)  # a bad flag is answered before all that follows is loaded
    check_flags(args)

import numpy as np
import pandas as pd

from analysis import runs
from analysis.tables.common import markdown
from cleanrl_style import protocol
from cleanrl_style.protocol import files, fronts, reference, score
from cleanrl_style.protocol.agents import own_script
from cleanrl_style.protocol.arguments import ask
from cleanrl_style.protocol.summary import followed

SCORES = tuple(f"{policy}, {task}" for task in TASKS for policy in protocol.POLICIES)
COLUMNS = ("name", "script", "trained on", "steps", *SCORES)


def evaluation_of(folder: Path) -> pd.DataFrame:
    """The evaluation of a run's folder; ValueError names the file of it that is damaged."""
    try:
        config = runs.read_config(folder)
        written = runs.read_table(folder / "evaluation.csv")
        runs.check(written, config)
        if "episode" not in written or not pd.api.types.is_numeric_dtype(written.episode):
            raise ValueError("damaged: evaluation.csv lacks the column episode, of numbers")
        weights = fronts.weight_columns(fronts.objectives_of(written.columns))
        in_turn = written.sort_values("episode").groupby(["policy", *weights]).cumcount().sort_index()
        wrong = written.episode != in_turn
        if wrong.any():
            row = int(np.argmax(wrong))
            value = f"episode is {written.episode[row]}, not {in_turn[row]}"
            raise ValueError(f"damaged: evaluation.csv, line {row + 2}: {value}")
    except ValueError as error:
        raise ValueError(f"{folder}: {error}") from error
    return written


def check(policy: protocol.Policy, folder: Path) -> str:
    """Play the beginning of a run's evaluation again; ValueError if it went otherwise."""
    if not folder.is_dir():
        return "a policy file alone: nothing to check it against"
    written = evaluation_of(folder)
    written = written[written.episode < CHECKED].reset_index(drop=True)
    weights = np.unique(fronts.weights_of(written), axis=0)
    again, _ = protocol.evaluate(policy.task(), policy.probabilities, weights, int(written.episode.max()) + 1)
    objectives = fronts.objectives_of(written.columns)
    key = ["policy", *fronts.weight_columns(objectives), "seed"]
    first, second = (table.sort_values(key)[fronts.return_columns(objectives)] for table in (written, again))
    if first.shape != second.shape:
        raise ValueError(f"{folder}: evaluation.csv lacks episodes of a policy, greedy or sampled, or of a weight")
    if not np.allclose(first, second, atol=1e-4):
        raise ValueError(f"{folder}: its policy does not play what evaluation.csv says (of another physics?)")
    return f"plays its evaluation again, {len(again)} episodes"


def check_script(args: Args) -> None:
    """ValueError if a folder names a script of its own: what is handed in runs only once somebody has named it."""
    named = own_script(args.policy) if args.script is None and args.policy.is_dir() else None
    if named is not None:
        raise ValueError(f"{args.policy}: its config.json names {named}; once you have read it, --script {named}")


def check_repeats(policy: protocol.Policy, task: protocol.Task, evaluation: pd.DataFrame) -> None:
    """Play the first episodes again, fewer at once; ValueError if a policy does something else then."""
    weights = np.unique(fronts.weights_of(evaluation), axis=0)
    again, _ = protocol.evaluate(task, policy.probabilities, weights, min(CHECKED, evaluation.seed.nunique()))
    key = ["policy", *fronts.weight_columns(task.objectives), "seed"]
    both = evaluation.merge(again, on=key, suffixes=("", "_again"))
    columns = fronts.return_columns(task.objectives)
    if not np.allclose(both[columns], both[[f"{name}_again" for name in columns]], atol=1e-4):
        raise ValueError(
            f"{policy.name}: it plays otherwise when it plays again; probabilities may depend on the stand's own "
            "observation, mask and accrued returns alone"
        )


def task_of(policy: protocol.Policy, env_id: str) -> protocol.Task:
    """An environment as the policy observes it; ValueError if it has another observation."""
    observation_groups = policy.task().env_kwargs.get("observation_groups")
    kwargs = {} if observation_groups is None else {"observation_groups": observation_groups}
    task = protocol.Task.of(env_id, **kwargs)
    size = task.make().observation_space.shape[0]
    if size != policy.size:
        trained_on = f"{policy.name}, trained on {policy.env_id}, observes {policy.size} entries"
        raise ValueError(f"{trained_on}; {env_id} has {size}: --tasks names others")
    return task


def comparison(policy: protocol.Policy, task: protocol.Task, episodes: int) -> score.Comparison:
    """A policy's evaluation in an environment, beside the constant plans there."""
    weights = fronts.evaluation_weights(task.num_objectives)
    evaluation, _ = protocol.evaluate(task, policy.probabilities, weights, episodes)
    plans = reference.reference_returns(task, evaluation.seed.drop_duplicates().tolist())
    return score.Comparison(evaluation, plans)


def leaderboard(root: Path) -> pd.DataFrame:
    """The leaderboard's rows; ValueError says what of the table is damaged."""
    path = root / TABLE
    if not path.exists():
        return pd.DataFrame(columns=COLUMNS)
    try:
        # a name may be one that pandas takes for a gap
        table = pd.read_csv(path, keep_default_na=False, na_values=dict.fromkeys(("steps", *SCORES), [""]))
    except ValueError as error:
        raise ValueError(f"{path} is damaged ({runs.in_a_line(error)})") from error
    if tuple(table) != COLUMNS:
        raise ValueError(f"{path} is damaged: its columns have to be {', '.join(map(repr, COLUMNS))}")
    unscored = table.name[table[list(SCORES)].apply(pd.to_numeric, errors="coerce").isna().any(axis=1)]
    if len(unscored):
        raise ValueError(f"{path} is damaged: its row {unscored.iloc[0]!r} lacks a score")
    if files.is_cut(path):
        raise ValueError(f"{path} is damaged: it does not end with a newline")
    return table.assign(steps=pd.to_numeric(table.steps).astype("Int64"))


def check_name(name: str, args: Args) -> None:
    """ValueError if the leaderboard is damaged, or has a row of that name already, which is not to be replaced."""
    if args.add and name in set(leaderboard(args.root).name) and not args.replace:
        raise ValueError(f"--name {name!r}: {TABLE} has a row of that name; --replace puts this one in its place")


def add(row: dict, root: Path) -> None:
    """Put a row into the leaderboard's table and page, the best on the balanced task first."""
    table, there = pd.DataFrame([row], columns=COLUMNS), leaderboard(root)
    if len(there):
        table = pd.concat([there[there.name != row["name"]], table], ignore_index=True)
    table = table.sort_values([f"greedy, {TASKS[1]}", "name"], ascending=[False, True])
    page = (root / PAGE).read_text(encoding="utf-8")
    cells = [[f"{v:.0f}" if isinstance(v, float) else str(v) for v in line] for line in table.itertuples(index=False)]
    text = SECTION.sub(lambda match: match[1] + markdown(COLUMNS, cells) + match[2], page)
    table["steps"] = table.steps.astype("Int64")
    with protocol.replacing(root / TABLE) as file:
        table.to_csv(file, index=False, float_format="%.6g", lineterminator="\n")
    with protocol.replacing(root / PAGE) as file:
        file.write(text.encode())


def main(args: Args) -> None:
    """Check, score, and add."""
    if len(set(args.tasks)) < len(args.tasks):
        fail(f"--tasks {' '.join(args.tasks)}: each once is allowed")
    for env_id in args.tasks:
        if not ask(env_id, "--tasks").boreal:
            fail(f"--tasks {env_id}: constant plans, and so a score, are of the boreal environments alone")
    try:
        check_script(args)
        policy = protocol.load_policy(args.policy, args.script)
        check_name(args.name or policy.script, args)
        if args.add and policy.env_id not in TASKS:
            raise ValueError(f"--add: a policy trained on {' or '.join(TASKS)} is allowed, not on {policy.env_id}")
        changed = [
            name
            for name, usual in (("site_seed", (None,)), ("thaw_formulation", (None, "asymmetric")))
            if policy.arguments.get(name) not in usual
        ]
        if args.add and changed:
            raise ValueError(f"--add: a policy trained on the task itself is allowed, not with another {changed[0]}")
        tasks = [task_of(policy, env_id) for env_id in args.tasks]  # refused before anything is played
        print(f"{policy.name}: {policy.script}, {check(policy, args.policy)}")
        row = {
            "name": args.name or policy.script,
            "script": policy.script,
            "trained on": policy.env_id,
            "steps": policy.arguments.get("total_timesteps"),
        }
        for env_id, task in zip(args.tasks, tasks, strict=True):
            one = comparison(policy, task, args.episodes)
            check_repeats(policy, task, one.evaluation)
            row |= {f"{kind}, {env_id}": one.score(kind) for kind in protocol.POLICIES}
            scores = ", ".join(f"{one.score(kind):z.0f} {kind}" for kind in protocol.POLICIES)
            gain, best = one.by_weight["greedy"].mean(), one.by_weight["best"].mean()
            print(f"{env_id}: SCORE {scores}; mean gain {gain:.2f} (best constant plans {best:.2f})")
            print(followed(task.objectives, one))
        if args.add:
            add(row, args.root)
            print(f"wrote {args.root / TABLE} and {args.root / PAGE}")
    except (ValueError, OSError) as error:
        fail(str(error))


if __name__ == "__main__":
    main(args)
