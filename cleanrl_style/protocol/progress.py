"""The progress line."""

import shutil
import sys
import time
from collections import deque

import numpy as np


class Progress:
    """One line that says how far a job is: rewritten in place on a terminal, else one every ten seconds.

    `returns` holds the last episodes' returns in the `objectives`, whose means the line shows while there is no `note`.
    """

    def __init__(self, label: str, total: int, unit: str, done: int = 0, objectives=(), then=lambda rate: 0.0):
        """done: what an earlier process has done of it; then: at a rate, seconds of what comes afterwards."""
        self.objectives, self.then, self.note = objectives, then, ""
        self.label, self.total, self.unit, self.done_before = label, total, unit, done
        self.terminal = sys.stdout.isatty()
        self.interval = 0.5 if self.terminal else 10.0
        self.start = time.perf_counter()
        self.shown = -np.inf
        self.returns = deque(maxlen=100)
        self.done = done

    def add(self, number: int = 1) -> None:
        """So many more are done."""
        self.done += number
        self.show(self.done)

    def show(self, done: int, last: bool = False) -> None:
        """Show the line if it is time to, and always at the end; last: no more comes, though less than the total."""
        now = time.perf_counter()
        last = last or done >= self.total
        if now - self.shown < self.interval and not last:
            return
        self.shown = now
        rate = (done - self.done_before) / (now - self.start)
        left, afterwards = (self.total - done) / max(rate, 1e-9), self.then(rate)
        line = (
            f"{self.label} {done:,}/{self.total:,} {self.unit}, {rate:,.0f}/s, "
            f"{(left + afterwards) / 60:.1f} min left{' with evaluation' if afterwards else ''}"
        )
        if self.note:
            line += f", {self.note}"
        elif self.returns:
            means = zip(self.objectives, np.mean(self.returns, axis=0), strict=True)
            text = ", ".join(f"{name} {mean:+.2f}" for name, mean in means)
            line += f", {text} (mean of {len(self.returns)} episodes)"
        if self.terminal:
            width = shutil.get_terminal_size().columns - 1
            print("\r" + line[:width].ljust(width), end="\n" if last else "", flush=True)
        else:
            print(line, flush=True)
