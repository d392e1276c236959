"""The page of `analysis/explore.py` in a browser without a window: for its test, and for docs/explore.md.

    python analysis/exploring/browser.py

Needs playwright (`pip install -e ".[explore-test]"`) and a Chromium of the system (Debian: `apt-get install chromium`).
"""

import contextlib
import io
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from cleanrl_style import protocol

SCRIPT = Path(__file__).parents[1] / "explore.py"
PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync"
).split()
PATIENCE_MS = 120_000  # for a first start, which compiles


def program() -> str | None:
    """The browser that is installed; None without one."""
    return next(filter(None, map(shutil.which, PROGRAMS)), None)


@dataclass
class Args:
    """Draws the page after some years."""

    path: Path = Path("docs/images/explore.png")
    """file of the picture"""
    width: int = 1280
    """of the browser's window [pixels]"""
    height: int = 1400
    """of the browser's window [pixels]"""
    years: int = 30
    """played before, in tens"""


@contextlib.contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a page that the command serves from this folder, for as long as the block lasts."""
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    command = [sys.executable, str(SCRIPT), "--port", str(port), "--no-show"]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as server:
        try:
            yield server.stdout.readline().split()[0]
        finally:
            server.send_signal(signal.SIGINT)


@contextlib.contextmanager
def opened(address: str, width: int, height: int):
    """A tab with the page at that address, once the stands are there; a playwright page."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program(), args=FLAGS)
        tab = browser.new_page(viewport={"width": width, "height": height})
        tab.set_default_timeout(PATIENCE_MS)
        tab.goto(address)
        tab.get_by_text("After 0 of").first.wait_for()
        yield tab
        browser.close()


def main(args: Args) -> None:
    """Draw it."""
    if program() is None:
        protocol.fail(f"no browser: one of {', '.join(PROGRAMS)} has to be installed")
    with served(Path.cwd()) as address, opened(address, args.width, args.height) as tab:
        for decade in range(10, args.years + 1, 10):
            tab.get_by_role("button", name="Ten years").click()
            tab.get_by_text(f"Through year {decade},").wait_for()  # what is filled last
        tab.wait_for_timeout(2000)  # charts are drawn after texts
        shot = Image.open(io.BytesIO(tab.screenshot()))
    with protocol.replacing(args.path) as file:
        shot.convert("RGB").save(file, format="png", optimize=True)


if __name__ == "__main__":
    main(protocol.parse(Args))
