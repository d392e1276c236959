"""TensorBoard and Weights & Biases, for those who ask for them by --track: the run's tables, row by row."""

import atexit
import secrets
from pathlib import Path

import numpy as np

from cleanrl_style.flags import fail

FOLDERS = ("tensorboard", "wandb")  # of a run's folder, named like the trackers


def numbers(table: str, row: dict) -> dict:
    """The row's numbers, under names such as episodes/carbon_return; of validation, with a row a weight at every step,
    validation/0.5/carbon_gain."""
    weights = [name for name in row if name.startswith(("preference", "weight_"))] if table == "validation" else []
    curve = "/".join([table, *(f"{row[name]:g}" for name in weights)])
    return {
        f"{curve}/{name}": float(value)
        for name, value in row.items()
        if isinstance(value, (int, float, np.number)) and name not in ("global_step", *weights)
    }


def start(args, script: str, folder: Path, config: dict, first_step: int) -> list:
    """The trackers that args.track names, each a function of a table's name and a row of it.

    first_step: of a resumed run, the step that it goes on from.
    """
    return [TRACKERS[name](args, script, folder, config, first_step) for name in getattr(args, "track", ())]


def tensorboard(args, script, folder, config, first_step):
    """Event files in <run>/tensorboard."""
    from torch.utils.tensorboard import SummaryWriter

    purged = first_step + 1 if first_step else 0  # what an earlier process wrote beyond its last checkpoint
    writer = SummaryWriter(str(folder / "tensorboard"), purge_step=purged, flush_secs=1)  # what a kill may lose
    atexit.register(writer.close)  # its thread ends with the program, and with it what is not yet written

    def track(table: str, row: dict) -> None:
        for name, value in numbers(table, row).items():
            writer.add_scalar(name, value, row["global_step"])

    return track


def wandb(args, script, folder, config, first_step):
    """A run of the project args.wandb_project_name; resumed, it goes on under the same id."""
    import wandb

    identity = folder / "wandb" / "borearl_id"  # --overwrite takes it away: what it starts is another run
    if not identity.exists():
        identity.parent.mkdir(exist_ok=True)
        identity.write_text(secrets.token_hex(8))
    try:
        wandb.init(
            project=args.wandb_project_name,
            name=f"{script}-{args.env_id}-{args.seed}",
            config=config,
            dir=str(folder),
            id=identity.read_text(),
            resume="allow",
        )
    except wandb.errors.UsageError as error:  # no login
        fail(f"--track wandb: {str(error).splitlines()[0]}")

    def track(table: str, row: dict) -> None:
        wandb.log({"global_step": row["global_step"], **numbers(table, row)})

    return track


TRACKERS = {"tensorboard": tensorboard, "wandb": wandb}
