"""Runs scripts to their end whatever is killed, one a core, on this machine or on a Ray cluster.

A script that is killed is started again, and goes on from its checkpoint; so is one whose Ray worker or node is killed.
It ends with the process that started it (analysis/tied.py), so that none is left over and holds its folder's lock.
"""

import contextlib
import os
import re
import shlex
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sim.executor import HERE, RETRIES, each

try:
    import fcntl
except ImportError:  # Windows, where cores cannot be chosen either
    fcntl = None

REPORT_SECONDS = 30.0
STOP_SECONDS = 30.0  # that a script has to end by itself
LAST_LINES = 8  # of a failed script's output
TAIL_BYTES = 4000
INTERRUPTED = 130  # exit status of a script that was asked to end


@dataclass(frozen=True)
class Command:
    """A script with its arguments, and where its output goes."""

    words: tuple[str, ...]
    log: Path
    steps: int = 0  # of training
    waits: bool = False  # whether those before it have to be finished when it starts
    folder: Path = Path()  # in which it is started

    def __str__(self) -> str:
        return shlex.join(["python", os.path.relpath(self.words[0]), *self.words[1:]])

    def tail(self) -> str:
        """The end of its output."""
        if not self.log.exists():
            return ""
        with self.log.open("rb") as file:
            file.seek(max(0, self.log.stat().st_size - TAIL_BYTES))
            return file.read().decode(errors="replace")

    def steps_done(self) -> int:
        """Environment steps of training so far, by its last progress line."""
        done = re.findall(r"training ([\d,]+)/", self.tail())
        return int(done[-1].replace(",", "")) if done else 0


def run_all(commands: list[Command], total: int, *, address: str = HERE, workers: int | None = None) -> list[Command]:
    """Run commands in order, one a core at once; returns those that failed.

    total : how many there are with those that are finished already; workers, address : see `sim.executor.each`.
    """
    report = Report(commands, total)
    failed = []
    _STOPPED.clear()
    try:
        with report.by_the_clock():
            for group in groups(commands):
                absolute = [(str(Path(one.folder).resolve()), str(one.log.resolve()), one.words) for one in group]
                for number, (status, tail) in each(run, absolute, workers=workers, address=address):
                    report.ended(group[number], status != 0)
                    if status:
                        failed.append(group[number])
                        last = "\n    ".join(tail.splitlines()[-LAST_LINES:])
                        print(f"FAILED: {group[number]}\n    {last}\n    (all of it: {group[number].log})", flush=True)
    finally:
        stop()
    return failed


def groups(commands: list[Command]) -> Iterator[list[Command]]:
    """Commands that may run beside each other: one that waits begins the next group."""
    group: list[Command] = []
    for command in commands:
        if command.waits and group:
            yield group
            group = []
        group.append(command)
    if group:
        yield group


class Report:
    """What is done, and how long the rest will take."""

    def __init__(self, commands: list[Command], total: int):
        self.left, self.total, self.failed = list(commands), total, 0
        self.all_steps = sum(command.steps for command in commands)
        self.begun, self.earlier = time.monotonic(), self._steps()

    def _steps(self) -> int:
        return self.all_steps - sum(command.steps - min(command.steps_done(), command.steps) for command in self.left)

    def ended(self, command: Command, failed: bool) -> None:
        """Count a command as ended."""
        self.left.remove(command)
        self.failed += failed

    def line(self) -> str:
        """In words."""
        steps = self._steps()
        rate = (steps - self.earlier) / (time.monotonic() - self.begun)
        left = f"{(self.all_steps - steps) / rate / 3600:.1f} h left" if rate > 0 else "time left not known yet"
        done = f"{self.total - len(self.left) - self.failed}/{self.total} runs"
        done += f", {self.failed} failed" if self.failed else ""
        return f"{done}, {steps:,} of {self.all_steps:,} steps, {rate:,.0f} steps/s, {left}"

    @contextlib.contextmanager
    def by_the_clock(self):
        """Print the line every half minute, and at the end."""
        ended = threading.Event()

        def tell():
            while not ended.wait(REPORT_SECONDS):
                print(self.line(), flush=True)

        teller = threading.Thread(target=tell, daemon=True)
        teller.start()
        try:
            yield
        finally:
            ended.set()
            teller.join()
        print(self.line(), flush=True)


# ---------------------------------------------------------------------------------------------------------------
# One command, where it runs
# ---------------------------------------------------------------------------------------------------------------

KILLED = -9  # the status of what was killed: not signal.SIGKILL, which Windows lacks
_UNDER_WAY: set[subprocess.Popen] = set()
_STOPPED = threading.Event()


def run(command: tuple[str, str, tuple[str, ...]]) -> tuple[int, str]:
    """Run a command (folder, log, words) on a core of its own, again up to `RETRIES` times if it is killed; its exit
    status, and the end of its output."""
    folder, log, words = command
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    status = KILLED
    with own_core() as core:
        for _ in range(1 + RETRIES):
            if _STOPPED.is_set() or (status >= 0 and status != INTERRUPTED):
                break
            status = run_once(folder, Path(log), words, core)
    return status, Command(words, Path(log)).tail()


def run_once(folder: str, log: Path, words: tuple[str, ...], core: int | None) -> int:
    """Run a command until it ends or is ended; its exit status, below 0 for a signal."""
    with log.open("ab") as output:  # what an attempt that was killed has said stays
        process = subprocess.Popen(
            [sys.executable, "-m", "analysis.tied", "any" if core is None else str(core), *words],
            stdin=subprocess.PIPE,  # closes when this process ends, however it does
            stdout=output,
            stderr=subprocess.STDOUT,
            cwd=folder,
            start_new_session=True,  # so that Ctrl-C reaches it through `stop` alone
        )
    _UNDER_WAY.add(process)
    if _STOPPED.is_set():  # since it was looked at
        process.terminate()
    try:
        return process.wait()
    finally:
        _UNDER_WAY.discard(process)
        process.stdin.close()


def stop() -> None:
    """End the commands under way in this process."""
    _STOPPED.set()
    processes = list(_UNDER_WAY)
    for process in processes:
        process.terminate()
    for process in processes:
        try:
            process.wait(STOP_SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextlib.contextmanager
def own_core() -> Iterator[int | None]:
    """A core that no other command has, by a lock that ends with it; None if none is free or none can be chosen."""
    # not TMPDIR where it can be helped: each job may have its own
    folder = Path("/tmp" if os.access("/tmp", os.W_OK) else tempfile.gettempdir())
    for core in sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") and fcntl else ():
        with open(folder / f"borearl-{os.getuid()}-core-{core}.lock", "w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            yield core
            return
    yield None
