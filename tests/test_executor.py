"""Independent tasks: here, and on Ray, where workers and nodes are killed while they are at work."""

import os
import random
import shutil
import signal
import threading
import time
from importlib.util import find_spec
from pathlib import Path

import pytest
from scripts import ROOT

from analysis import sweep
from sim import executor


def test_tasks_here_end_in_any_order_and_are_numbered():
    def work(task):
        time.sleep(task)
        return 10 * task

    assert list(executor.each(work, [0.2, 0.0], workers=2)) == [(1, 0.0), (0, 2.0)]
    assert list(executor.each(work, iter([0.1, 0.0]), workers=1)) == [(0, 1.0), (1, 0.0)]


def test_no_more_tasks_are_made_than_are_under_way():
    made, free = [], threading.Event()

    def tasks():
        for number in range(5):
            made.append(number)
            yield number

    found = executor.each(lambda task: task or free.wait(), tasks(), workers=2)
    assert next(found) == (1, 1) and made == [0, 1]
    free.set()
    assert len(list(found)) == 4


def test_an_error_of_a_task_is_raised():
    with pytest.raises(ZeroDivisionError):
        list(executor.each(lambda task: 1 / task, [1, 0, 1], workers=2))


@pytest.mark.parametrize("address", ["foo", "foo:", ":6379", "", None, 6379])
def test_what_is_no_address_is_refused_before_anything_is_tried(address):
    with pytest.raises(ValueError, match="address .*: none, local, auto, HOST:PORT and ray://HOST:PORT are allowed"):
        list(executor.each(abs, [1], address=address))


@pytest.mark.skipif(find_spec("ray") is not None, reason="Ray is there")
def test_ray_is_named_where_it_is_missing():
    with pytest.raises(ValueError, match=r"address local: it needs Ray, pip install -e \"\.\[ray\]\"; without it none"):
        list(executor.each(abs, [1], address="local"))
    assert executor.default_address() == executor.HERE


# ----------------------------------------------------------------------------------------------------------- Ray


def processes(words: str) -> list[int]:
    """Processes whose command line has these words."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if words in path.read_bytes().replace(b"\0", b" ").decode(errors="replace"):
                found.append(int(path.parent.name))
        except OSError:
            continue
    return found


def parent(process: int) -> int:
    return int(Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[1])


def bytes_of(folder: Path) -> dict[str, bytes]:
    """Every file that does not hang on the clock."""
    paths = [path for path in folder.rglob("*") if path.is_file() and path.name != "timing.csv"]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths if "logs" not in path.parts}


def test_a_sweep_whose_workers_and_node_are_killed_has_the_same_bytes(tmp_path, monkeypatch):
    """Two nodes of a CPU each: a script, a worker and the node of a script are killed at random moments."""
    pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    monkeypatch.setenv(
        "PYTHONPATH", os.pathsep.join([str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    )
    monkeypatch.setenv("RAY_worker_niceness", "0")  # 15 by itself: beside anything else it would take minutes
    monkeypatch.setenv("TOY_SECONDS", "0.02")  # long enough to be killed, at no cost to the processor
    grid = ("env_id=resumable_toy:resumable-toy-v0", "total_timesteps=600", "num_envs=2", "rollout_steps=100")
    grid += ("eval_episodes=1", "eval_weights=0 1")

    def args(name, **changes):
        folder = tmp_path / name
        script = ROOT / "cleanrl_style" / "ppo_gated.py"
        return sweep.Args(script, "1-2", grid, runs_dir=folder, output=folder / "sweep.csv", **changes)

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "object_store_memory": 80_000_000})
    nodes = [cluster.add_node(num_cpus=1, object_store_memory=80_000_000) for _ in range(2)]
    dice, killed, ended = random.SystemRandom(), [], threading.Event()

    def kill(what, script):
        if what == "node":
            raylet = parent(parent(script))
            found = [node for node in nodes if node.all_processes["raylet"][0].process.pid == raylet]
            cluster.remove_node(*found, allow_graceful=False)
        else:
            os.kill(script if what == "script" else parent(script), signal.SIGKILL)
        killed.append(what)

    def disturb():
        for what in ("script", "worker", "node"):
            while what not in killed and not ended.wait(dice.uniform(0.0, 5.0)):
                for script in processes(f"{tmp_path}/disturbed")[:1]:
                    kill(what, script)

    disturber = threading.Thread(target=disturb)
    try:
        disturber.start()
        sweep.main(args("disturbed", address=cluster.address))
        ended.set()
        disturber.join()
        assert killed == ["script", "worker", "node"]
    finally:
        ended.set()
        cluster.shutdown()
    sweep.main(args("whole", address=executor.HERE))
    assert bytes_of(tmp_path / "disturbed") == bytes_of(tmp_path / "whole")
    shutil.rmtree(tmp_path / "disturbed")
