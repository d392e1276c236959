"""Whether a change of the simulator's source left its numbers as they were.

    python analysis/same_physics.py --before HEAD --changed "messages of refusals"

Runs and reference returns carry a hash of the source of simulator and environment, which a message changes as much as
an equation does. This plays the same episodes with the source of a commit and with that of the working tree, in every
environment, in lockstep and alone. If all numbers have the same bits, it notes in
cleanrl_style/protocol/same_physics.csv that this source stands for that one, and archived runs stay of this physics.
If not, it says where they differ and notes nothing: what changed is physics. Two to four minutes, in which both sources
are compiled.
"""

import csv
import hashlib
import io
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import gymnasium as gym
import numpy as np

import boreal_env
import sim
from cleanrl_style import protocol
from cleanrl_style.protocol import provenance

#: What is played: environment and arguments. Not played are the GPU, the interpreter, and other arguments than these.
PLAYED = (
    ("boreal-generalist-v0", {}),
    ("boreal-generalist-v0", {"thaw_formulation": "contrast"}),
    ("boreal-generalist-v0", {"thaw_formulation": "raw_degree_days"}),
    ("boreal-site-specific-v0", {}),
    ("boreal-balanced-v0", {}),
    ("boreal-timber-v0", {}),
    ("boreal-four-v0", {}),
    ("boreal-warming-v0", {}),
)
STANDS, YEARS, SEED = 16, 20, 5_000_000
DAILY_YEARS = 2


@dataclass
class Args:
    """Compares the numbers of this source with those of a commit's, and notes it if they are the same."""

    before: str = "HEAD"
    """commit whose source the working tree's is compared with"""
    changed: str = ""
    """what was changed since the source that it stands for, in a few words, for the note"""
    digests: bool = False
    """print the digests of the source that python finds, and stop (what is called for each of the two)"""


def digests() -> dict[str, str]:
    """Hashes of all that is played, by its name, and of the tables' numbers."""
    found = {}
    for env_id, arguments in PLAYED:
        for stands in (STANDS, 1):
            name = " ".join((env_id, *arguments.values(), f"x {stands}"))
            found[name] = digest(played(env_id, arguments, stands))
    daily = sim.simulate(sim.middle_site(), 12, seed=1, years=DAILY_YEARS, output="daily")
    found["daily output"] = digest([daily.to_numpy(float)])
    tables = (sim.CONSTANTS, sim.SITE_PARAMETERS)
    numbers = [[p.low, p.high, p.physical_low, p.physical_high] for table in tables for p in table.values()]
    found["constants and site parameters"] = digest([np.array(numbers)])
    return found


def played(env_id: str, arguments: dict, stands: int):
    """Observations, rewards and records of an episode's years under random actions."""
    envs = gym.make_vec(env_id, num_envs=stands, record_steps=True, **arguments)
    generator = np.random.default_rng(SEED)
    observations, _ = envs.reset(seed=SEED)
    yield observations
    for _ in range(YEARS):
        observations, rewards, terminated, _, infos = envs.step(generator.integers(25, size=stands))
        yield from (observations, rewards, terminated)
        yield from (np.asarray(column) for _, column in sorted(infos["record"].items()))
    envs.close()


def digest(arrays) -> str:
    """Hash of arrays' bytes."""
    of_all = hashlib.sha256()
    for array in arrays:
        of_all.update(np.ascontiguousarray(array).tobytes())
    return of_all.hexdigest()[:16]


def of_tree(tree: Path) -> dict:
    """Name and digests of the source that lies in a folder."""
    words = [sys.executable, str(Path(__file__).resolve()), "--digests"]
    answer = subprocess.run(words, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree)}, stdout=subprocess.PIPE)
    if answer.returncode:
        protocol.fail(f"{' '.join(words)} in {tree}: exit {answer.returncode}")
    return json.loads(answer.stdout)


def main(args: Args) -> None:
    """Play with both, compare, note."""
    if args.digests:
        print(
            json.dumps({"source": provenance.physics_hash(), "folder": str(Path(sim.__file__).parent), "of": digests()})
        )
        return
    here = Path(boreal_env.__file__).parent
    if not args.changed:
        protocol.fail("--changed: a few words on what was changed are needed")
    git = ("git", "-C", str(here))
    known = subprocess.run([*git, "rev-parse", "--verify", "-q", f"{args.before}^{{commit}}"], stdout=subprocess.PIPE)
    if known.returncode:
        protocol.fail(f"--before {args.before}: no commit of {here}")
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder, "before")
        subprocess.run(
            [*git, "worktree", "add", "-q", "--detach", str(tree), known.stdout.decode().strip()], check=True
        )
        try:
            before, after = of_tree(tree), of_tree(here)
        finally:
            subprocess.run([*git, "worktree", "remove", "--force", str(tree)], check=True)
        if Path(before["folder"]).parent != tree:
            protocol.fail(f"python found {before['folder']} where the source of {args.before} was meant")
    differ = [name for name, hashed in after["of"].items() if before["of"].get(name) != hashed]
    if differ:
        protocol.fail(f"{args.before} has other numbers in: {'; '.join(differ)}. Nothing is noted.")
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("source", "stands_for", "changed"))
    if provenance.own_hash() != before["source"]:
        table.writerow((provenance.own_hash(), before["source"], args.changed))
    with protocol.replacing(provenance.SAME_PHYSICS) as file:
        file.write(text.getvalue().encode())
    print(f"all {len(after['of'])} digests are the same: {provenance.SAME_PHYSICS} has it")


if __name__ == "__main__":
    main(protocol.parse(Args))
