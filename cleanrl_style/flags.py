"""The command line of a script: its flags, and what it says when it cannot go on.

It loads nothing slow: a bad flag, or a package that is not installed, is answered before torch and the physics come.
"""

import atexit
import contextlib
import dataclasses
import errno
import gc
import importlib.util
import io
import itertools
import os
import re
import sys
from pathlib import Path

#: A trained policy in its run's folder; the folder of those that ship.
POLICY, SHIPPED = "policy.pt", Path(__file__).with_name("policies")
#: Environments that a training may have, at most.
MAX_ENVS = 1000
#: Sites that results are of (cleanrl_style/protocol/evaluation_sites.csv).
TEST_SITES = 200
#: Training resets environments with seeds below this one, evaluation from this one on.
FIRST_EVALUATION_SEED = 1_000_000_000

#: What tyro says of a value that is not a number, or not a whole one.
PARSING = re.compile(
    r"Error parsing (?P<flag>--\S+): (?P<why>invalid literal for int.*?|could not convert string to float|"
    r"no type matching .*?(INT|FLOAT).*? could be instantiated from):? (?P<values>\[?'.*'\]?)\.?"
)
#: What it says of them where there may be any number.
SEVERAL = re.compile(r"Error parsing (--\S+): Could not find valid parse for arguments: \[(.*)\]\.?")
#: What it says of words that are no flags.
UNKNOWN = re.compile(r"Unrecognized options: (.*)")
#: What it says of a value that is none of a few, in an order of its own where None is one of them.
CHOICE = re.compile(r"invalid choice '(.*)' for argument '(--\S+)'\. Expected one of \((.*)\)\.")
#: Closed interval of each argument that has one; an algorithm's own are the `limits` of its arguments.
LIMITS = {
    "seed": (0, FIRST_EVALUATION_SEED // MAX_ENVS - 1),
    "site_seed": (0, 2**63 - 1),
    "total_timesteps": (1, 10**12),
    "num_envs": (1, MAX_ENVS),
    "group_size": (1, MAX_ENVS),
    "eval_episodes": (1, 10**6),
    "eval_weights": (0, 1),
    "learning_rate": (1e-12, 1),
    "gamma": (0, 1),
    "gae_lambda": (0, 1),
    "rollout_steps": (1, 10**9),
    "minibatch_size": (2, 10**9),
    "update_epochs": (1, 10**6),
    "clip_coef": (1e-12, 10),
    "ent_coef": (0, 10),
    "vf_coef": (0, 10),
    "max_grad_norm": (1e-12, 10**6),
    "reward_scales": (0, 10**6),
    "threshold": (0, 1),
    "preference": (0, 1),
    "sites": (1, 10**6),
    "first_site": (0, 10**9),
    "stands": (1, 10**9),
    "years": (1, 1000),
    "spacing": (0.01, 10),
    "kills": (0, 1000),
    "workers": (1, 10**4),
    "environments": (1, 10**6),
    "gpu_stands": (1, 10**9),
    "gpu_environments": (1, 10**6),
    "threads": (1, 10**4),
    "repeats": (1, 10**4),
    "dollars_per_core_hour": (0, 10**6),
    "dollars_per_gpu_hour": (0, 10**6),
}


def fail(message: str):
    """End the script with one line on stderr and a non-zero exit."""
    sys.exit(f"error: {message}")


def require(*packages: str, extra: str = "train") -> None:
    """End the script if one of the packages of an extra is not installed."""
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    if missing:
        limit = " with Python 3.11 to 3.13" if "morl_baselines" in missing else ""  # see pyproject.toml
        fail(f'not installed: {", ".join(missing)}; in the project\'s folder: pip install -e ".[{extra}]"{limit}')


def shipped_policies() -> dict[str, Path]:
    """The policies that ship: name -> file."""
    return {path.stem: path for path in sorted(SHIPPED.glob("*.pt"))}


def policy_file(run_or_name) -> Path:
    """The file of a policy: of a run's folder, the file itself, or of a name that ships. FileNotFoundError if none,
    ValueError for what is no name.
    """
    if not isinstance(run_or_name, (str, os.PathLike)):
        raise ValueError(f"policy {run_or_name!r}: a run's folder, a file, or the name of one that ships is allowed")
    path, ships = Path(run_or_name), shipped_policies()
    if os.path.isdir(path):  # a name too long for the file system is no folder; Path's own would raise
        runs = sorted(path.glob(f"seed*/{POLICY}"))
        path = path / POLICY
        if runs and not path.exists():
            raise FileNotFoundError(f"{run_or_name} holds runs: give one of them, such as {runs[0].parent}")
    if not os.path.exists(path):
        path = ships.get(str(run_or_name), path)
    if not os.path.isfile(path):
        raise FileNotFoundError(
            f"{run_or_name or repr('')}: neither the folder of a finished run, with {POLICY}, nor such a file, nor a "
            f"policy that ships ({', '.join(ships) or 'none does yet'})"
        )
    return path


def describe(arguments: type) -> str:
    """What `--help` says of a script: of one that trains how to try it, and what becomes of it."""
    if not hasattr(arguments, "total_timesteps"):
        return arguments.__doc__
    # a script that updates after every episode has one stand at a time, which takes five times as long
    usual = (6000, "forty minutes") if getattr(arguments, "num_envs", None) == 1 else (32000, "three to ten minutes")
    steps, whole = getattr(arguments, "trial", usual)
    lockstep = " --vectorization lockstep" if hasattr(arguments, "vectorization") else ""
    left = """A stopped run goes on with the same
command, to the same bytes. The folder gets config.json, episodes.csv, updates.csv, validation.csv (of 22,500 steps
and more), evaluation.csv, policy.pt and summary.png, which docs/algorithms explains"""
    return f"""{arguments.__doc__}

    python {sys.argv[0]}{lockstep} --total-timesteps {steps} --eval-episodes 20

is a trial: a minute on two cores once the physics is compiled, too short to learn much. Without the last two flags
it trains for 300,000 steps and is evaluated on 200 sites, for {whole}. {getattr(arguments, "left", left)}; python
analysis/make_tables.py sets it beside other runs."""


def parse(arguments: type):
    """The command line as an instance of `arguments`; a bad flag or value ends the script with one line."""
    prepare_output()
    # the million objects that imports make all stay: to search them for garbage time and again is a third of a start
    gc.set_threshold(20_000, 20, 20)
    if "" in sys.argv[1:]:
        before = sys.argv[sys.argv.index("", 1) - 1]
        fail(f"{before + ' ' if before.startswith('--') else ''}'': a value is allowed, not an empty text")
    if home := next((word for word in sys.argv[1:] if word.rpartition("=")[2].split("/")[0] == "~"), None):
        fail(f"{home}: the shell left the ~ as it is; $HOME is understood everywhere")
    require("tyro", "matplotlib", "moocore", *(["torch"] if hasattr(arguments, "total_timesteps") else []))
    import tyro

    errors = io.StringIO()
    try:
        with contextlib.redirect_stderr(errors):
            args = tyro.cli(arguments, description=describe(arguments))
    except SystemExit as end:
        if not end.code:
            raise
        fail(message_of(errors.getvalue()))
    check_lists(args)
    check_limits(args)
    check_run_dir(args)
    check_task(args)
    return args


def message_of(box: str) -> str:
    """What tyro says in its box, in a line: its message, and the flags that it takes for the ones that were meant."""
    lines = [line.strip("│ ") for line in box.splitlines()]
    rules = [i for i, line in enumerate(lines) if line.startswith(("───", "---", "╰─"))]
    first = 2 if rules[0] == 1 else 1  # drawn in ASCII, the title has a rule of its own
    message = " ".join(filter(None, lines[first : rules[first - 1]]))
    headings = ("Perhaps you meant:", "Arguments similar to --")
    meant = [after.split()[0] for line, after in itertools.pairwise(lines) if line.startswith(headings)]
    if meant:
        return f"{message}; did you mean {', '.join(sorted({*meant}))}?"
    if unknown := UNKNOWN.fullmatch(message):
        return f"{message}; {way_on(unknown[1].split(', ')[0])}"
    return in_plain_words(message.partition(" Got errors:")[0])  # of each type that the flag may have


def way_on(word: str) -> str:
    """What to do about a word of the command line that is no flag."""
    before = [before for before, after in itertools.pairwise(sys.argv) if after == word]
    if word.startswith("-") or len(before) != 1 or not before[0].startswith("--") or "=" in before[0]:
        return "--help lists all"
    name = before[0].removeprefix("--")
    opposite = name.removeprefix("no-") if name.startswith("no-") else f"no-{name}"
    return f"--{name} takes no value, --{opposite} is its opposite"


def in_plain_words(message: str) -> str:
    """What tyro says of a value that is not of its flag's type, without the names of types."""
    if several := SEVERAL.fullmatch(message):
        return f"{several[1]} {words_of(several[2])}: not of the kind that --help shows"
    if choice := CHOICE.fullmatch(message):
        allowed = {*words_of(choice[3]).split()} - {"None"}
        allowed = sorted(allowed, key=lambda word: (word.isdigit() and int(word), word))
        return f"{choice[2]} {choice[1]}: {', '.join(allowed)} {'is' if len(allowed) == 1 else 'are'} allowed"
    found = PARSING.fullmatch(message)
    if not found:
        return message
    flag, why, values = found["flag"], found["why"], words_of(found["values"])
    what = "whole number" if "int" in why.lower() else "number"
    allowed = f"{what}s are" if "..." in why else f"a {what} is"
    return f"{flag} {values}: {allowed} allowed"


def words_of(values: str) -> str:
    """A printed list of texts as it was typed."""
    return " ".join(re.findall("'([^']*)'", values))


def check_lists(args) -> None:
    """End the script with one line for a flag of several values that was given none."""
    for field in dataclasses.fields(args):
        flag = f"--{field.name.replace('_', '-')}"
        if getattr(args, field.name) == () and flag in sys.argv[1:]:
            fail(f"{flag}: at least one value is allowed")


def check_limits(args) -> None:
    """End the script with one line for an argument outside its limits, or one that does not go with --num-envs."""
    for name, (low, high) in (LIMITS | getattr(args, "limits", {})).items():
        value = getattr(args, name, None)
        for number in flat(value):
            if not low <= number <= high:
                fail(f"--{name.replace('_', '-')} must lie in [{low}, {high}], not {number}")
    if "num_envs" not in vars(args):  # it is no flag there
        return
    fill_in_envs(args)
    if args.num_envs % getattr(args, "group_size", 1):
        fail(f"--num-envs {args.num_envs}: a multiple of --group-size {args.group_size} is allowed")
    if getattr(args, "rollout_steps", 0) % args.num_envs:
        fail(
            f"--rollout-steps {args.rollout_steps}, a sum over all environments, must be a multiple of "
            f"--num-envs {args.num_envs}"
        )
    steps = getattr(args, "total_timesteps", None)
    if steps is not None and steps < args.num_envs:
        fail(f"--total-timesteps {steps} must be at least --num-envs {args.num_envs}")


def check_run_dir(args) -> None:
    """End the script with one line for a folder that cannot be made, or not be written to."""
    given = getattr(args, "run_dir", None)
    if given is None:
        return
    there = next(path for path in (Path(given).absolute(), *Path(given).absolute().parents) if os.path.exists(path))
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        fail(
            f"--run-dir {given}: cannot write there ({'not a folder' if there.is_file() else 'no permission'}: {there})"
        )


def check_environment(env_id: str) -> None:
    """End the script with one line if there is no environment of that name; one of a module is asked for later."""
    import gymnasium as gym

    import boreal_env  # noqa: F401, it registers ours

    if ":" in env_id:
        return
    if env_id not in gym.registry and f"{env_id}-v0" in gym.registry:
        fail(f"--env-id {env_id}: give the version, {env_id}-v0")
    try:
        gym.spec(env_id)
    except gym.error.Error as error:
        fail(f"--env-id {env_id or repr(env_id)}: {no_environment(error)}")


def check_task(args) -> None:
    """End the script with one line for an environment that is not there, or a flag that does not go with a registered
    one of ours; others are asked when they are loaded.
    """
    env_id, mode = getattr(args, "env_id", None), getattr(args, "mode", None)
    if not isinstance(env_id, str):
        known: dict = {"mode": mode or "generalist"}
    else:
        check_environment(env_id)
        import gymnasium as gym

        known = {} if ":" in env_id else gym.spec(env_id).kwargs
    if "mode" not in known:
        return
    check_mode(args, known["mode"])
    objectives = known.get("objectives", ("carbon", "thaw"))
    check_scales(args, objectives)
    check_weights_given(args, len(objectives))
    one_site = known["mode"] == "site-specific" or getattr(args, "site_seed", None) is not None
    if not one_site and getattr(args, "eval_episodes", 0) > TEST_SITES:
        fail(f"--eval-episodes {args.eval_episodes}: at most {TEST_SITES} are allowed, as many as there are test sites")


def check_mode(args, mode: str) -> None:
    """End the script with one line for a --mode that is not the environment's."""
    if getattr(args, "mode", None) not in (None, mode):
        fail(f"--mode {args.mode} contradicts --env-id {args.env_id}, which is {mode}")


def check_scales(args, objectives: tuple[str, ...]) -> None:
    """End the script with one line for --reward-scales that are not one an objective, or all 0."""
    scales = getattr(args, "reward_scales", None)
    if scales is None:
        return
    if len(scales) != len(objectives):
        names = ", ".join(objectives)
        fail(f"--reward-scales: {len(objectives)} numbers, of {names}, are allowed, not {list(scales)}")
    if not any(scales):
        fail("--reward-scales: not all of them 0, which leaves nothing to learn")


def check_weights_given(args, number: int) -> None:
    """End the script with one line for --eval-weights, or a --preference, of which each has not `number` numbers."""
    for name in ("preference", "eval_weights"):
        given = flat(getattr(args, name, None))
        if number != 2 and len(given) % number:
            fail(f"--{name.replace('_', '-')}: {number} numbers a weight, not {len(given)} in all")


def no_environment(error: Exception) -> str:
    """What is wrong with an environment's name, and which are allowed."""
    import gymnasium as gym

    ours = ", ".join(name for name in gym.registry if name.startswith("boreal-"))
    return f"{str(error).splitlines()[0].rstrip('.')}; allowed: {ours}, or module:id of an environment of yours"


def fill_in_envs(args) -> None:
    """Set --num-envs, in place, where it is left to the vectorization."""
    if getattr(args, "num_envs", 0) is None:
        args.num_envs = 32 if args.vectorization == "lockstep" else 8


def flat(value) -> list:
    """The numbers of a number, of tuples of them, or of None."""
    if value is None:
        return []
    return [number for part in value for number in flat(part)] if isinstance(value, (tuple, list)) else [value]


# ------------------------------------------------------------------------------------------------------ the terminal


def prepare_output() -> None:
    """Have the script write to any terminal, file or pipe: what an encoding lacks is a "?", a closed one takes all."""
    sys.stdout, sys.stderr = (stream or open(os.devnull, "w") for stream in (sys.stdout, sys.stderr))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    if sys.excepthook is not end_quietly:
        sys.excepthook = end_quietly
        atexit.register(flush)


def end_quietly(kind, error, trace) -> None:
    """A line for Ctrl-C, `| head` and a full disk, which are no errors of the script; of all else the traceback."""
    if issubclass(kind, KeyboardInterrupt):
        print("\ninterrupted", file=sys.stderr)
    elif issubclass(kind, BrokenPipeError):
        print("stopped: nobody reads the output any more", file=sys.stderr)
        to_nobody()
    elif isinstance(error, OSError) and error.errno == errno.ENOSPC:
        print(f"error: {error}", file=sys.stderr)
        to_nobody()
    else:
        sys.__excepthook__(kind, error, trace)


def flush() -> None:
    """Write what is left; the interpreter itself would complain if its reader has gone."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        to_nobody()


def to_nobody() -> None:
    """Send the rest of the output nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
