"""The first start says what it does; later ones have nothing to say."""

import errno
import re
import threading
import time

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest

from cleanrl_style import protocol
from cleanrl_style.protocol import compilation
from sim import block, jit
from sim.jit import phase


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


# ------------------------------------------------------------------------------------------------ what is kept of it


@phase
def simulate_year(block, steps, days, forcing, output):
    """What is compiled here in place of the physics."""
    return steps + 1


@pytest.fixture
def cache(monkeypatch, tmp_path):
    """A function that has the kernels of another physics kept in a folder; of these none is made yet."""

    def keep(folder):
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
        jit.cache_folder.cache_clear()
        jit.is_cacheable.cache_clear()
        monkeypatch.setattr(block, "_MADE", {})
        monkeypatch.setattr(block, "simulate_year", simulate_year)
        return folder

    yield keep
    jit.cache_folder.cache_clear()
    jit.is_cacheable.cache_clear()


def test_the_library_says_that_it_compiles_and_keeps_it(cache, tmp_path, caplog):
    cache(tmp_path)
    assert not block.is_compiled(1)
    assert block.kernel(1)(None, 1, 0, None, None) == 2
    said = "compiling the physics for 1 stand at a time, once for this processor: half a minute"
    assert [record.message for record in caplog.records] == [said]
    cache(tmp_path)
    assert block.is_compiled(1)
    assert block.kernel(1).stats.cache_hits and len(caplog.records) == 1


def test_where_nothing_can_be_written_it_is_compiled_uncached_with_one_warning(cache, tmp_path):
    (tmp_path / "file").touch()
    folder = cache(tmp_path / "file" / "cache")
    with pytest.warns(RuntimeWarning, match="file/cache.* cannot be written .*NUMBA_CACHE_DIR") as warned:
        assert block.kernel(1)(None, 1, 0, None, None) == 2
        block.kernel(4)
    assert len(warned) == 1 and not folder.exists()
    assert not list(tmp_path.rglob("*.nbi"))


def test_a_full_disk_keeps_nothing_and_says_so(cache, tmp_path, monkeypatch):
    def save(self, key, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    cache(tmp_path)
    monkeypatch.setattr(numba.core.caching.IndexDataCacheFile, "save", save)
    with pytest.warns(RuntimeWarning, match="No space left on device"):
        assert block.kernel(1).signatures


def test_a_user_without_a_home_is_one_without_a_cache(cache, monkeypatch):
    def home():
        raise RuntimeError("Could not determine home directory.")

    cache("")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(jit.Path, "home", home)
    with pytest.warns(RuntimeWarning, match="cannot be written"):
        assert not jit.is_cacheable()


def test_one_compiles_while_others_wait(cache, tmp_path):
    cache(tmp_path)
    order, came = [], threading.Event()

    def second():
        came.set()
        with jit.alone("kernel"):
            order.append("second")

    with jit.alone("kernel"):
        other = threading.Thread(target=second)
        other.start()
        came.wait()
        time.sleep(0.2)
        order.append("first")
    other.join()
    assert order == ["first", "second"]


def test_what_is_on_disk_is_loaded_beside_others(cache, tmp_path, monkeypatch):
    cache(tmp_path)
    block.kernel(1)
    cache(tmp_path)
    monkeypatch.setattr(block, "alone", lambda name: pytest.fail("it waits for those that compile"))
    assert block.kernel(1)(None, 1, 0, None, None) == 2


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_damaged_file_of_the_cache_is_named_and_done_without(cache, tmp_path, kind):
    cache(tmp_path)
    block.kernel(1)
    cache(tmp_path)
    for path in tmp_path.rglob(f"*.{kind}"):
        path.write_bytes(path.read_bytes()[:-1] if kind == "nbc" else b"")
    with pytest.warns(RuntimeWarning, match=f"a file in {tmp_path}.* is damaged .* until that folder is deleted"):
        assert block.kernel(1)(None, 1, 0, None, None) == 2


@phase
def product(a, b, c):
    for k in range(a.size):
        a[k] = b[k] * c[k]


@pytest.mark.skipif(
    not llvm.get_host_cpu_features().get("avx512f") or llvm.get_host_cpu_name() in jit.SLOWED, reason="needs AVX-512"
)
def test_vectors_are_as_wide_as_the_processor_has():
    product(*np.ones((3, 100)))
    assert any("zmm" in text for text in product.inspect_asm().values())
