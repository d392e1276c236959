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


def test_what_is_there_is_loaded_without_a_word(made, capsys):
    protocol.compile_physics([16, 1])
    assert made == [16]  # the other when it is needed
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("lanes", [(4,), (4, 1), (1, 4), (4, 8, 4)])
def test_compiling_says_so_and_for_how_long(made, capsys, lanes):
    protocol.compile_physics(lanes)
    assert made == [lanes[0]]
    first, *signs, last = capsys.readouterr().out.splitlines()
    assert first.startswith("compiling the physics") and last.startswith("  compiled in ")
    assert signs and all(re.fullmatch(r"  \d+ s", sign) for sign in signs)
