"""Ships trained policies with the package, so that `load_policy` and `python -m boreal_env watch` know them by name.

    python analysis/ship_policies.py runs/ppo_group/boreal-balanced-v0-vectorization=lockstep/seed1 ..

A policy is named as its script, with -<task> behind it where that is not boreal-generalist-v0: ppo_group,
ppo_group-balanced. Writes cleanrl_style/policies/<name>.pt, without the critic, at most 100 kB each.
"""

import io
import sys
from dataclasses import dataclass
from pathlib import Path

from cleanrl_style import flags

flags.require("tyro")

import tyro

from analysis import paths
from cleanrl_style import protocol

LARGEST = 100_000  # bytes


@dataclass
class Args:
    """Ships the policies of runs, in place of those of the same names."""

    runs: tyro.conf.Positional[tuple[Path, ...]]
    """folders of finished runs, or their policy.pt"""
    folder: Path = flags.SHIPPED
    """folder of the policies that ship"""


def name_of(run: dict) -> str:
    """A policy's name, of its run's script and arguments."""
    task = run["arguments"]["env_id"].split(":")[-1].removeprefix("boreal-").removesuffix("-v0").replace("/", "-")
    return run["script"] + ("" if task == "generalist" else f"-{task}")


def main(args: Args) -> None:
    """Ship the policies; nothing is written unless all can be."""
    import torch

    if not args.runs:
        sys.exit("error: runs: at least one is needed")
    packed = {}
    for path in args.runs:
        try:
            protocol.load_policy(path)
        except (FileNotFoundError, ValueError) as error:
            sys.exit(f"error: {error}")
        saved = torch.load(flags.policy_file(path), weights_only=True)
        # parameters are views of one tensor, which would be saved whole
        kept = {key: value.clone() for key, value in saved["agent"].items() if not key.startswith("critic.")}
        saved["agent"] = kept
        if "run" not in saved:
            sys.exit(f"error: {path}: a policy file that names its run is allowed, as run.save_policy writes it")
        script = Path("cleanrl_style", f"{saved['run']['script']}.py")
        if not (Path(__file__).parents[1] / script).is_file():
            sys.exit(f"error: {path}: its script has to be {script} first, or nobody who has the policy can load it")
        buffer, name = io.BytesIO(), name_of(saved["run"])
        torch.save(saved, buffer)
        if len(buffer.getvalue()) > LARGEST:
            sys.exit(f"error: {path}: {len(buffer.getvalue())} bytes, at most {LARGEST} are allowed")
        if name in packed:
            sys.exit(f"error: {path}: two policies of the name {name}")
        packed[name] = buffer.getvalue()
    paths.make_writable("--folder", args.folder)
    for name, content in packed.items():
        with protocol.replacing(args.folder / f"{name}.pt") as file:
            file.write(content)
        print(f"wrote {args.folder / name}.pt: {len(content)} bytes")


if __name__ == "__main__":
    main(protocol.parse(Args))
