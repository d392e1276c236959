"""A run's folder: configuration, tables, checkpoint and results, and what is said when a run stops early."""

import atexit
import contextlib
import csv
import hashlib
import io
import json
import os
import pickle
import random
import re
import shutil
import signal
import sys
import time
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from cleanrl_style.flags import fail
from cleanrl_style.protocol import tracking, training_envs
from cleanrl_style.protocol.arguments import FREE_ARGUMENTS, not_default
from cleanrl_style.protocol.course import Course
from cleanrl_style.protocol.evaluation import PRIMARY, episodes_by_policy, lanes_of_evaluation
from cleanrl_style.protocol.files import is_cut, load_whole, replacing
from cleanrl_style.protocol.fronts import objectives_of, weight_columns
from cleanrl_style.protocol.progress import Progress
from cleanrl_style.protocol.provenance import CODE, commit, physics_name, place_of, versions
from cleanrl_style.protocol.reference import reference_returns
from cleanrl_style.protocol.score import Comparison
from cleanrl_style.protocol.summary import draw_summary, print_course, print_score, print_table
from cleanrl_style.protocol.task import Task
from cleanrl_style.protocol.utility import Chebyshev

try:
    import fcntl
except ImportError:  # Windows, where a folder is not locked
    fcntl = None

#: Columns of timing.csv.
TIMING_COLUMNS = ("phase", "global_step", "seconds", "elapsed_seconds")
# What a run makes, but for config.json and timing.csv. The first of them makes it a finished run.
RESULTS = (
    "evaluation.csv",
    "checkpoint.pt",
    "policy.pt",
    "episodes.csv",
    "updates.csv",
    "validation.csv",
    "evaluation_years.csv",
    "cost.csv",
    "summary.png",
)
# A checkpoint follows each multiple of so many steps: by the clock the last one would differ each time.
CHECKPOINT_STEPS = 2048
#: How numbers are written into a run's tables.
FLOAT_FORMAT = "%.9g"
LONGEST_NAME = 200  # bytes of a folder's name; file systems allow 255


class Table:
    """A CSV file that grows by rows, each handed to the system at once: it outlives a killed process."""

    def __init__(self, path: Path, columns, size: int = 0):
        """size: bytes to keep of the table that is there; 0 starts a new one."""
        self.columns = columns
        # unbuffered: what a full disk refuses is not tried once more when the process ends
        self.file = open(path, "r+b" if size else "wb", buffering=0)
        self.file.truncate(size)
        self.file.seek(size)
        if not size:
            self._append(dict(zip(columns, columns, strict=True)))

    def write(self, row: dict) -> None:
        """Append a row; columns that it lacks stay empty, one that the table lacks raises ValueError."""
        self._append(
            {
                name: FLOAT_FORMAT % value if isinstance(value, (float, np.floating)) else value
                for name, value in row.items()
            }
        )

    def _append(self, row: dict) -> None:
        text = io.StringIO()
        csv.DictWriter(text, self.columns, lineterminator="\n").writerow(row)
        data = text.getvalue().encode()
        while data:
            data = data[self.file.write(data) :]


class Run:
    """A run's folder: its configuration, its tables (given as name=columns), its checkpoint and its results.

    Used as a context: a run that is stopped inside says in one line how to go on, and leaves no process behind.
    A run is finished when `evaluation.csv` exists: it is written last. Exits with one line if the folder is
    another run's, in use, damaged or not writable, or holds this run finished (exit 0).
    """

    def __init__(self, args, task: Task, script: str | Path, *, plays_validation: bool = True, **tables):
        """script : its file, `__file__`, or a name alone; plays_validation : whether it calls `validate`; tables : name
        -> columns."""
        self.args, self.task, self.script = args, task, Path(script).stem
        self.stopped = False
        changed = not_default(args)
        self.folder = Path(
            args.run_dir or Path("runs", self.script, folder_name(args.env_id, changed), f"seed{args.seed}")
        )
        self.config = {
            "script": self.script,
            "arguments": {k: value for k, value in vars(args).items() if k not in FREE_ARGUMENTS},
            "not_default": changed,
            "primary_policy": PRIMARY,
            **({"ideal_point": task.utility.ideal} if isinstance(task.utility, Chebyshev) else {}),
            "versions": versions(),
            "commit": commit(),
            "file": place_of(Path(script)),
            "source": hashlib.sha256(Path(script).read_bytes()).hexdigest()[:16] if Path(script).is_file() else None,
            "physics": physics_name(),
        }
        self.envs, self.checkpoint, self.checkpoint_step = None, None, 0
        self.env_seconds, self.progress_line, self.course = 0.0, None, None
        self.played_seconds = 0.0  # of a year and stand of the course
        with self._writing():
            self._claim_folder(tables)
            self._load_checkpoint()
            self.first_step = self.env_step = self.checkpoint_step  # of this process, so far
            if task.boreal and plays_validation and hasattr(args, "total_timesteps"):
                course = Course(task, args.total_timesteps, args.eval_episodes, self.checkpoint_step)
                if course.fits:
                    self.course, tables = course, {**tables, "validation": course.columns}
            sizes = self.checkpoint["table_sizes"] if self.checkpoint else dict.fromkeys(tables, 0)
            if set(sizes) != set(tables) or any(
                size and header_of(self.folder / f"{name}.csv") != list(tables[name]) for name, size in sizes.items()
            ):
                self._no_checkpoint()
            self.tables |= {
                name: Table(self.folder / f"{name}.csv", columns, sizes[name]) for name, columns in tables.items()
            }
        self.trackers = tracking.start(args, self.script, self.folder, self.config, self.checkpoint_step)
        print(f"{self.script}: {args.env_id}, seed {args.seed}, into {self.folder}", flush=True)
        if self.checkpoint:
            print(f"resuming at step {self.checkpoint_step:,}", flush=True)

    # ------------------------------------------------------------------------------------- opening the folder

    def _claim_folder(self, tables) -> None:
        """Make the folder this run's, and lock it by its timing.csv; what is there of this very run stays."""
        config_file, timing_file = self.folder / "config.json", self.folder / "timing.csv"
        # what a killed process left half-written, or empty, does not make the folder another's
        occupied = self.folder.is_dir() and any(
            not path.name.endswith(".tmp") and not (path == timing_file and not path.stat().st_size)
            for path in self.folder.iterdir()
        )
        if occupied and not config_file.exists():
            fail(f"--run-dir {self.folder}: neither empty nor a run's folder (it has no config.json)")
        if occupied and is_foreign(config_file):
            fail(f"--run-dir {self.folder}: not a run's folder (its config.json has no script and arguments)")
        if occupied and not self.args.overwrite:
            self._compare(config_file, tables)
        self.folder.mkdir(parents=True, exist_ok=True)
        timing_file.touch()
        self.lock = open(timing_file, "r+b")
        if fcntl is not None:
            try:
                fcntl.lockf(self.lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                fail(f"{self.folder}: another process is at work on this run")
            except OSError as error:
                print(
                    f"warning: {self.folder}: its file system has no locks ({error.strerror}); see that no other "
                    "process works on this run",
                    file=sys.stderr,
                )
        if occupied and self.args.overwrite:
            for name in (*RESULTS, *tracking.FOLDERS):
                remove(self.folder / name)
            self.lock.truncate()
        if not occupied or self.args.overwrite or "begun_with" in self.config:
            self._write_config()
        # timing.csv keeps its rows; the time that this run took goes on from the last whole one
        *rows, half_a_row = self.lock.read().split(b"\n")
        try:
            earlier = float(rows[-1].split(b",")[-1]) if len(rows) > 1 else 0.0
            if not 0.0 <= earlier < np.inf:
                raise ValueError(earlier)
        except ValueError:
            fail(f"{timing_file} is damaged; --overwrite starts over")
        self.start = time.perf_counter() - earlier
        self.tables = {"timing": Table(timing_file, TIMING_COLUMNS, sum(len(row) + 1 for row in rows))}

    def _write_config(self) -> None:
        with replacing(self.folder / "config.json") as file:
            file.write(json.dumps(self.config, indent=2, default=str).encode() + b"\n")

    def _compare(self, config_file: Path, tables) -> None:
        """Exit if the folder's run has other arguments, or is finished; warn if it was made by other code."""
        try:
            config = json.loads(config_file.read_text(encoding="utf-8"))
            there = {"script": config["script"], **config["arguments"]}
            code_there = {**config["versions"], **{name: config.get(name) for name in CODE}}
        except (ValueError, KeyError, TypeError) as error:
            fail(f"{config_file} is damaged ({error!r}); --overwrite starts over")
        here = json.loads(json.dumps({"script": self.script, **self.config["arguments"]}, default=str))
        if there != here:
            fail(
                f"{self.folder} holds a run with other arguments: {differences(there, here)} "
                "(--run-dir names another folder, --overwrite starts over)"
            )
        if (self.folder / "evaluation.csv").exists():
            made = (*self._made_by_all(), *(f"{name}.csv" for name in tables))
            lost = [name for name in made if is_empty(self.folder / name)]
            damaged = damage_of(self.folder, len(self.args.eval_weights)) or next(iter(lost), None)
            if damaged:
                what = "damaged" if (self.folder / damaged).exists() else "missing"
                fail(f"{self.folder / damaged} is {what}; --overwrite starts over")
            changed = config.get("source") not in (None, self.config["source"])
            now = f"finished, but {self.script}.py has changed since (--overwrite trains it anew)"
            print(f"{self.folder}: this run is {now if changed else 'finished (--overwrite starts over)'}")
            sys.exit(0)
        code_here = {**self.config["versions"], **{name: self.config[name] for name in CODE}}
        if "begun_with" in config:
            self.config["begun_with"] = config["begun_with"]
        if code_there != code_here:
            changed = {name: value for name, value in code_there.items() if code_here.get(name) != value}
            self.config["begun_with"] = [*self.config.get("begun_with", []), changed]  # written once the lock is ours
            print(
                f"warning: {self.folder} was begun with other code, and goes on with this: "
                f"{differences(code_there, code_here)}; its config.json says so, --overwrite starts over",
                file=sys.stderr,
            )

    def _made_by_all(self) -> tuple[str, ...]:
        """Files that every finished run in this environment has."""
        return ("timing.csv", "summary.png", *(["evaluation_years.csv"] if self.task.boreal else []))

    # -------------------------------------------------------------------------------------------- checkpoints

    def save(self, global_step: int, last: bool, **state) -> None:
        """Write a checkpoint if it is the last one, or a multiple of CHECKPOINT_STEPS has been passed.

        state: what the algorithm needs to go on; environments, generators and tables are added to it.
        """
        if global_step // CHECKPOINT_STEPS == self.checkpoint_step // CHECKPOINT_STEPS and not last:
            return
        import torch  # only here: the heuristics do without

        start = time.perf_counter()
        state |= {
            "script": self.script,
            "global_step": global_step,
            "envs": training_envs.get_states(self.envs),
            "random_states": (random.getstate(), np.random.get_state(), torch.get_rng_state()),
            "table_sizes": {name: table.file.tell() for name, table in self.tables.items() if name != "timing"},
        }
        # first into memory: what torch says of a full disk is not an OSError
        buffer = io.BytesIO()
        torch.save(state, buffer, pickle_module=BY_VALUE)
        with self._writing():
            self._flush_tables()
            with replacing(self.folder / "checkpoint.pt") as file:
                file.write(buffer.getvalue())
        self.checkpoint_step = global_step
        self.time("checkpoint", global_step, time.perf_counter() - start)

    def _flush_tables(self) -> None:
        """Have the disk take what the system holds of the tables: a checkpoint that outlives a machine needs them."""
        for table in self.tables.values():
            os.fsync(table.file.fileno())

    def _load_checkpoint(self) -> None:
        path = self.folder / "checkpoint.pt"
        if not path.exists():
            return
        try:
            checkpoint = load_whole(path, weights_only=False)
        except (
            zipfile.BadZipFile,
            RuntimeError,
            EOFError,
            pickle.UnpicklingError,
            ImportError,
            AttributeError,
            ValueError,
            OSError,
        ) as error:
            what = [*str(error).splitlines(), type(error).__name__][0]
            fail(f"{path} is damaged ({what}); --overwrite starts over")
        steps = getattr(self.args, "total_timesteps", 0)
        if (
            not isinstance(checkpoint, dict)
            or checkpoint.get("script") != self.script
            or not {"envs", "global_step", "random_states", "table_sizes"} <= checkpoint.keys()
            or not isinstance(checkpoint["global_step"], int)
            or not 0 <= checkpoint["global_step"] <= steps
            or not isinstance(checkpoint["table_sizes"], dict)
        ):
            self._no_checkpoint()
        if checkpoint["envs"] is None:
            print(f"{self.args.env_id} gives no state to go on from: the interrupted run starts over", flush=True)
            return
        for name, size in checkpoint["table_sizes"].items():
            table = self.folder / f"{name}.csv"
            if not table.exists() or table.stat().st_size < size:
                fail(f"{table} is shorter than when the checkpoint was written; --overwrite starts over")
            if table.read_bytes()[size - 1 : size] != b"\n":
                fail(f"{table} is not as it was when the checkpoint was written; --overwrite starts over")
        self.checkpoint, self.checkpoint_step = checkpoint, checkpoint["global_step"]

    def _no_checkpoint(self) -> None:
        path = self.folder / "checkpoint.pt"
        fail(f"{path} is no checkpoint of this version of {self.script}; --overwrite starts over")

    def resume(self, **parts) -> dict | None:
        """Set environments, generators and `parts` as in the checkpoint, and give its state; None if there is none.

        parts : what has a `load_state_dict` (networks, optimizers), under the names that `save` was given.
        """
        if self.checkpoint:
            import torch

            path = self.folder / "checkpoint.pt"
            for name, part in parts.items():
                try:
                    part.load_state_dict(self.checkpoint[name])
                except (KeyError, ValueError, RuntimeError):
                    fail(f"{path}: its {name} does not fit that of this {self.script}; --overwrite starts over")
            try:
                training_envs.set_states(self.envs, self.checkpoint["envs"])
            except ValueError as error:
                fail(f"{path}: its environments are not those of this {self.script} ({error}); --overwrite starts over")
            python_state, numpy_state, torch_state = self.checkpoint["random_states"]
            random.setstate(python_state)
            np.random.set_state(numpy_state)
            torch.set_rng_state(torch_state)
        return self.checkpoint

    # ------------------------------------------------------------------------------------------- while it runs

    def make_envs(self, **env_kwargs):
        """The vector environment to train on, which ends with the run; env_kwargs : what the evaluation's lack.

        config.json has them too, as "training_environment".
        """
        args = self.args
        if env_kwargs:
            self.config["training_environment"] = env_kwargs
            with self._writing():
                self._write_config()
        later = lanes_of_evaluation(self.task, len(args.eval_weights), args.eval_episodes)
        if self.course is not None:
            later = [*self.course.lanes, *later]
        self.envs = training_envs.make_training_envs(self.task, args.num_envs, args.vectorization, later, **env_kwargs)
        return self.envs

    def progress(self, steps: int, done: int) -> Progress:
        """The line that says how far the training is; the time left has the evaluation in it."""
        self.progress_line = Progress(
            "training", steps, "steps", done, self.task.objectives, self._seconds_of_evaluation
        )
        return self.progress_line

    def _seconds_of_evaluation(self, rate: float) -> float:
        """What the evaluation will take, by the last play of the course, which is like it, or by the training."""
        args = self.args
        episodes = len(args.eval_weights) * sum(episodes_by_policy(self.task, args.eval_episodes).values())
        steps = self.env_step - self.first_step
        of_a_step = self.env_seconds / steps if steps else 1 / rate
        return episodes * (self.task.years or 0) * (self.played_seconds or of_a_step)

    def validate(self, global_step: int, last: bool, policy) -> None:
        """At some shares of the training and at its end: what the greedy policy gains on the validation sites.

        policy : as for `evaluate`. Its gains go into validation.csv, its score into the progress line. Does nothing in
        trainings too short for it, and in environments of which it is not known what doing nothing returns.
        """
        if self.course is None or not self.course.reach(global_step, last):
            return
        start = time.perf_counter()
        gained = self.course.play(policy)
        self.played_seconds = (time.perf_counter() - start) / self.course.years
        for row in gained.to_dict("records"):
            self.log("validation", {"global_step": global_step, **row})
        if self.progress_line is not None:
            self.progress_line.note = f"score {self.course.score(gained):.0f} on {self.course.where}"
        self.time("validation", global_step, time.perf_counter() - start)

    def log(self, table: str, row: dict) -> None:
        """Append a row to one of the run's tables."""
        with self._writing():
            self.tables[table].write(row)
        for tracker in self.trackers:
            tracker(table, row)

    def time(self, phase: str, global_step: int, seconds: float) -> None:
        """Append to timing.csv, the only file that depends on the clock."""
        if self.stopped:
            raise KeyboardInterrupt
        if phase == "environment":
            self.env_seconds, self.env_step = self.env_seconds + seconds, global_step
        with self._writing():
            self.tables["timing"].write(
                {
                    "phase": phase,
                    "global_step": global_step,
                    "seconds": seconds,
                    "elapsed_seconds": time.perf_counter() - self.start,
                }
            )

    def save_policy(self, agent, **arguments) -> None:
        """Write policy.pt, what `load_policy` makes the policy of: no code in it.

        arguments : all of the Agent's after `envs`. Raises TypeError where they do not make an Agent of its weights.
        """
        import torch

        buffer = io.BytesIO()
        shape = self.envs.single_observation_space.shape
        arguments = {name: one.item() if isinstance(one, np.generic) else one for name, one in arguments.items()}
        try:
            with torch.random.fork_rng(devices=[]):
                type(agent)(self.envs, **arguments).load_state_dict(agent.state_dict())
        except (RuntimeError, TypeError) as error:
            own = "run.save_policy(agent, name=value, ..) wants every argument that the Agent was made with after envs"
            raise TypeError(f"{own}, not {arguments}: they make another network") from error
        own = {name: value for name, value in self.config["arguments"].items() if name != "vectorization"}
        # without the vectorization: the same bytes, async or lockstep
        run = json.loads(json.dumps({"script": self.script, "arguments": own}, default=str))
        policy = {"agent": agent.state_dict(), "arguments": arguments, "observation_shape": shape, "run": run}
        torch.save(policy, buffer)
        try:
            torch.load(io.BytesIO(buffer.getvalue()), weights_only=True)
        except pickle.UnpicklingError as error:
            raise TypeError(
                f"run.save_policy: numbers, texts and tuples of them are allowed, not {arguments}"
            ) from error
        with self._writing():
            with replacing(self.folder / "policy.pt") as file:
                file.write(buffer.getvalue())
            self.config["policy"] = "policy.pt"
            self._write_config()

    def finish(self, evaluation: pd.DataFrame, years: pd.DataFrame | None) -> None:
        """Write the evaluation and the picture, print the table, and so declare the run finished."""
        objectives, start = self.task.objectives, time.perf_counter()
        plans = reference_returns(self.task, evaluation.seed.drop_duplicates().tolist())
        comparison = None if plans is None else Comparison(evaluation, plans, self.task.utility)
        self.time("reference", self.checkpoint_step, time.perf_counter() - start)
        with self._writing():
            if years is not None:
                with replacing(self.folder / "evaluation_years.csv") as file:
                    years.to_csv(file, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
            with replacing(self.folder / "summary.png") as file:
                title = f"{self.script}, {self.args.env_id}, seed {self.args.seed}"
                draw_summary(file, title, objectives, evaluation, years, self.folder, comparison, self.course)
            self._flush_tables()
            with replacing(self.folder / "evaluation.csv") as file:
                evaluation.to_csv(file, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
        if comparison is None:
            print_table(objectives, evaluation)
        else:
            print_score(objectives, comparison, trained=hasattr(self.args, "total_timesteps"))
        if self.course is not None:
            print_course(self.course, pd.read_csv(self.folder / "validation.csv"))
        print(f"{self.folder}: finished in {time.perf_counter() - self.start:.0f} s")

    @contextlib.contextmanager
    def _writing(self):
        try:
            yield
        except OSError as error:
            fail(f"--run-dir {self.folder}: cannot write there ({error.strerror})")

    # ------------------------------------------------------------------------------------- when it stops early

    def __enter__(self):
        self.handlers = {number: signal.signal(number, self._stop) for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def _stop(self, number, frame) -> None:
        self.stopped = True  # a compiler's callbacks lose the exception: `time` raises it again
        raise KeyboardInterrupt

    def __exit__(self, kind, error, trace) -> None:
        for number in self.handlers:  # a second Ctrl-C, too, waits until workers and files are closed
            signal.signal(number, signal.SIG_IGN)
        dead = training_envs.end(self.envs) if self.envs is not None else []
        for table in self.tables.values():
            table.file.close()
        self.lock.close()
        for number, handler in self.handlers.items():
            signal.signal(number, handler)
        command = "the same command without --overwrite" if self.args.overwrite else "the same command"
        then = (
            f"{command} goes on from step {self.checkpoint_step:,}"
            if self.checkpoint_step
            else f"{command} starts it again"
        )
        if isinstance(error, KeyboardInterrupt):
            print(f"\n{self.folder}: interrupted; {then}", file=sys.stderr)
            atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)  # before other libraries' last words
            sys.exit(130)
        if isinstance(error, (EOFError, ConnectionError)) and dead:
            fail(f"{'; '.join(dead)}; {then}")
        if isinstance(error, Exception):
            print(f"{self.folder}: stopped by an error; {then}", file=sys.stderr)


class ByValue(pickle.Pickler):
    """Writes every object in full: equal states give equal bytes, whether or not they share their parts."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.fast = True


BY_VALUE = SimpleNamespace(__name__="by_value", Pickler=ByValue)  # for torch, a pickle module


def is_foreign(config_file: Path) -> bool:
    """Whether a config.json is another program's; a damaged one may be ours."""
    try:
        config = json.loads(config_file.read_text(encoding="utf-8"))
    except ValueError:
        return False
    return not isinstance(config, dict) or not {"script", "arguments"} <= config.keys()


def is_empty(path: Path) -> bool:
    """Whether a file has nothing in it, or is not there."""
    return not path.exists() or not path.stat().st_size


def header_of(table: Path) -> list[str]:
    """Columns of a table."""
    with table.open(newline="", encoding="utf-8") as file:
        return next(csv.reader(file), [])


def damage_of(folder: Path, weights: int) -> str | None:
    """Which file of a finished run, all written whole, something has cut short, changed or removed since, if any."""
    evaluation, policy = folder / "evaluation.csv", folder / "policy.pt"
    for table in sorted(folder.glob("*.csv")):
        if is_cut(table):
            return table.name
    try:
        table = pd.read_csv(evaluation)
        by_weight = table.groupby(["policy", *weight_columns(objectives_of(table.columns))]).size()
        alike = by_weight.groupby("policy").agg(lambda episodes: len(episodes) == weights and episodes.nunique() == 1)
        # a column that the environment does not report is empty throughout
        numbers = table.drop(columns="policy").to_numpy(dtype=float)
        known = np.isfinite(numbers).all(axis=0) | np.isnan(numbers).all(axis=0)
        whole = len(alike) and alike.all() and known.all()
    except (ValueError, KeyError):
        whole = False
    if not whole:
        return evaluation.name
    saved = policy.exists() or "policy" in json.loads((folder / "config.json").read_text(encoding="utf-8"))
    return policy.name if saved and not zipfile.is_zipfile(policy) else None


def remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def differences(there: dict, here: dict) -> str:
    """What differs between two dicts, by name."""
    return "; ".join(
        f"{name} {there.get(name)} there, {here.get(name)} now"
        for name in {**there, **here}
        if there.get(name) != here.get(name)
    )


def folder_name(env_id: str, changed: dict) -> str:
    """Environment and name=value of what is not default; the end of a name too long for file systems is its hash."""

    name = "-".join([env_id.split(":")[-1], *(f"{k}={as_text(value)}" for k, value in changed.items())])
    name = re.sub(r"[/\\\s]+", "-", name)  # one folder
    if len(name.encode()) <= LONGEST_NAME:
        return name
    digest = hashlib.sha256(name.encode()).hexdigest()[:12]
    return f"{name.encode()[: LONGEST_NAME - 13].decode(errors='ignore')}-{digest}"


def as_text(value) -> str:
    """An argument as folders and tables name it."""
    if not isinstance(value, (list, tuple)):
        return str(value)
    return ",".join(f"{one:g}" if isinstance(one, (int, float)) else str(one) for one in np.ravel(value).tolist())
