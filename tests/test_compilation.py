"""The first start says what it does; later ones have nothing to say."""

import re
import time

import pytest

from cleanrl_style import protocol
from cleanrl_style.protocol import compilation


@pytest.fixture
def made(monkeypatch):
    """Kernels made in this process, each of which takes a while; those of one and of sixteen lanes are on disk."""
    made = []

    def slow(lanes):
        time.sleep(0.2)
        made.append(lanes)

    monkeypatch.setattr(compilation, "kernel", slow)
    monkeypatch.setattr(compilation, "is_compiled", lambda lanes: lanes in (1, 16))
    monkeypatch.setattr(compilation, "INTERVAL", 0.05)
    return made


@pytest.fixture
def begun(monkeypatch):
    """Lanes that a process was started for; each process is done at once."""
    begun = []

    class Process:
        def __init__(self, target, args, daemon):
            self.lanes = args[0]

        def start(self):
            begun.append(self.lanes)

        def join(self):
            pass

    monkeypatch.setattr(compilation.multiprocessing, "Process", Process)
    monkeypatch.setattr(compilation, "_UNDER_WAY", {})
    return begun


def test_what_is_there_is_loaded_without_a_word(made, capsys):
    protocol.compile_physics([16, 1])
    assert made == [16]  # the other when it is needed
    assert capsys.readouterr().out == ""


def test_compiling_says_so_and_for_how_long(made, capsys):
    protocol.compile_physics((4,))
    assert made == [4]
    first, *signs, last = capsys.readouterr().out.splitlines()
    assert first.startswith("compiling the physics") and last.startswith("  compiled in ")
    assert signs and all(re.fullmatch(r"  \d+ s", sign) for sign in signs)


def test_what_is_needed_at_once_is_compiled_side_by_side(made, begun):
    protocol.compile_physics((4, 1, 8, 8))
    assert made == [4] and begun == [8]  # that of one lane is there
    assert not compilation._UNDER_WAY  # waited for


def test_what_is_needed_later_is_compiled_in_the_background(made, begun, capsys):
    protocol.compile_physics((16,), later=(1, 4))
    assert made == [16] and begun == [4] and list(compilation._UNDER_WAY) == [4]
    assert capsys.readouterr().out == ""  # nothing waits
    protocol.compile_physics((16,), later=(4,))
    assert begun == [4]
    protocol.compile_physics((4,))  # now it is needed: no second compilation, the first is waited for
    assert begun == [4] and not compilation._UNDER_WAY and made == [16, 16, 4]
    assert capsys.readouterr().out.startswith("compiling the physics")
