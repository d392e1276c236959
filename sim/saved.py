"""What a saved state has to be before it is taken back: nothing of it is, where a part of it is wrong."""

from collections.abc import Sequence

import numpy as np

from sim.parameters import brief, is_integer


def check_keys(what: str, saved, keys: Sequence[str]) -> None:
    """Refuse what is no dict of these keys, all of them and no other, as `get_state` gives it."""
    if isinstance(saved, dict) and set(saved) == set(keys):
        return
    if isinstance(saved, dict):
        missing, unknown = [key for key in keys if key not in saved], [str(key) for key in saved if key not in keys]
        wrong = f"missing: {', '.join(missing)}" if missing else f"unknown: {', '.join(unknown)}"
    else:
        wrong = f"got {type(saved).__name__}"
    raise ValueError(f"{what}: a dict of {', '.join(keys)} from get_state is allowed; {wrong}")


def check_settings(what: str, saved, ours: dict) -> None:
    """Refuse the state of one that was made with other arguments; both are dicts of plain values."""
    check_keys(f"settings of {what}", saved, tuple(ours))
    for name, value in ours.items():
        if saved[name] != value:
            there, here = brief(saved[name]), brief(value)
            differs = f"{name} = {there}, this one has {here}" if there != here else f"another {name}"
            raise ValueError(f"{what} of one with {differs}: make both with the same arguments")


def check_array(what: str, saved, ours: np.ndarray, low: float = -np.inf, high: float = np.inf) -> None:
    """Refuse what is no array of the shape and type of ours, or has a number outside [low, high], or NaN."""
    if type(saved) is not np.ndarray or saved.dtype != ours.dtype:  # a masked array's mask would be lost
        got = getattr(saved, "dtype", type(saved).__name__)
        raise ValueError(f"{what}: an array of {ours.dtype} is allowed, got {got}")
    if saved.shape != ours.shape:
        raise ValueError(f"{what} of shape {saved.shape}, {ours.shape} is allowed; of another version?")
    wrong = saved[~((saved >= low) & (saved <= high) & np.isfinite(saved))]
    if wrong.size:
        allowed = "finite numbers are" if np.isinf(low) else f"[{low:g}, {high:g}] is"
        raise ValueError(f"{what}: {allowed} allowed, got {wrong[0]}")


def restored_generator(state):
    """A generator in the given state of its bit generator; None for None."""
    if state is None:
        return None
    generator = np.random.default_rng(0)
    try:
        generator.bit_generator.state = state
        words = state["state"]
        if not is_integer(words["state"]) or not is_integer(words["inc"]) or words["inc"] % 2 == 0:
            raise ValueError("a PCG64's increment is odd")
    except (TypeError, ValueError, KeyError, OverflowError):
        raise ValueError(f"state of a generator: that of a PCG64 is allowed, got {brief(state)}") from None
    return generator
