"""Independent tasks, on this machine or on a Ray cluster: the one place that knows of Ray."""

import re
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from importlib.util import find_spec
from itertools import islice
from typing import Any

from sim.stands import available_cores

HERE, RAY_HERE = "none", "local"  # addresses: threads of this process; Ray, started on this machine for the time
CLUSTER = re.compile(r"auto|[^\s:/]+:\d+|\w+://\S+")  # addresses of a Ray that is there
RETRIES = 20  # of a task whose worker or node was killed
OBJECT_STORE_BYTES = 200_000_000  # of a Ray of our own: results are a few megabytes each


class NoCluster(ValueError):
    """Ray is wanted, and is not installed, does not start, or does not answer."""


def default_address() -> str:
    """Ray on this machine where Ray is installed, threads where it is not."""
    return RAY_HERE if find_spec("ray") else HERE


def check_address(address: str) -> None:
    """Refuse, in one line, what is no address, and what needs Ray where Ray is not installed."""
    if not isinstance(address, str) or address not in (HERE, RAY_HERE) and not CLUSTER.fullmatch(address):
        raise NoCluster(f"address {address!r}: {HERE}, {RAY_HERE}, auto, HOST:PORT and ray://HOST:PORT are allowed")
    if address != HERE and find_spec("ray") is None:
        raise NoCluster(f'address {address}: it needs Ray, pip install -e ".[ray]"; without it {HERE} is allowed')


def each(
    work: Callable[[Any], Any], tasks: Iterable, *, workers: int | None = None, address: str = HERE
) -> Iterator[tuple[int, Any]]:
    """The number of each task and what `work` makes of it, in the order in which they end.

    workers : tasks at a time (None: one a core); of a cluster that is there, as many as it has CPUs.
    address : "none", this process; "local", Ray started on this machine for the time; else of a cluster that is there,
    "auto" or as `ray.init` takes it. With Ray, `work` and the tasks are pickled, and a task whose worker or node is
    killed is done again.

    Raises what `work` raises, and `NoCluster`.
    """
    check_address(address)
    workers = available_cores() if workers is None else workers
    if address == HERE and workers == 1:  # in this thread, so that Ctrl-C ends a task
        yield from ((number, work(task)) for number, task in enumerate(tasks))
        return
    pool: Threads | Cluster = Threads(workers) if address == HERE else Cluster(address, workers)
    waiting = enumerate(tasks)
    under_way: dict[Any, int] = {}
    try:
        while True:
            for number, task in islice(waiting, max(0, pool.width() - len(under_way))):
                under_way[pool.start(work, task)] = number
            if not under_way:
                return
            ended = pool.first(under_way)
            yield under_way.pop(ended), pool.result(ended)
    finally:
        pool.end(under_way)


class Threads:
    """Threads of this process."""

    def __init__(self, workers: int):
        self.workers = workers
        self.pool = ThreadPoolExecutor(workers)

    def width(self) -> int:
        """Tasks that may be under way."""
        return self.workers

    def start(self, work, task):
        """A ticket of a task that has been handed over."""
        return self.pool.submit(work, task)

    def first(self, under_way):
        """A ticket of a task that has ended; waits for one."""
        return next(iter(wait(under_way, return_when=FIRST_COMPLETED).done))

    def result(self, ended):
        """What came of it."""
        return ended.result()

    def end(self, under_way) -> None:
        """Start no more."""
        self.pool.shutdown(wait=False, cancel_futures=True)


class Cluster:
    """Workers of a Ray cluster, one CPU each. A Ray that was started here ends with it."""

    def __init__(self, address: str, workers: int):
        import ray

        self.ray = ray
        self.ours = not ray.is_initialized()
        if self.ours:
            here = {"num_cpus": workers, "object_store_memory": OBJECT_STORE_BYTES, "include_dashboard": False}
            try:
                ray.init(address, log_to_driver=False, logging_level="ERROR", **(here if address == RAY_HERE else {}))
            except ConnectionError as error:
                raise NoCluster(f"address {address!r}: no Ray cluster answers there ({error})") from error
            except Exception as error:
                if type(error) is not Exception:  # Ray raises this bare kind where it does not start in half a minute
                    raise
                raise NoCluster(f"address {address!r}: Ray does not start ({error})") from error

    def width(self) -> int:
        """Twice as many as there are CPUs now, so that none waits for the next task."""
        return max(2, 2 * int(self.ray.cluster_resources().get("CPU", 0)))

    def start(self, work, task):
        """As of threads."""
        return self.ray.remote(work).options(num_cpus=1, max_retries=RETRIES).remote(task)

    def first(self, under_way):
        """As of threads."""
        return self.ray.wait(list(under_way), num_returns=1)[0][0]

    def result(self, ended):
        """As of threads."""
        return self.ray.get(ended)

    def end(self, under_way) -> None:
        """End what is under way."""
        for one in under_way:
            self.ray.cancel(one, force=True)
        if self.ours:
            self.ray.shutdown()
