"""The machine that a speed was measured on."""

import importlib.metadata
import os
import platform
from pathlib import Path

from sim.stands import available_cores

INSTRUCTION_SETS = {"avx512f": "AVX-512", "avx2": "AVX2", "avx": "AVX", "asimd": "NEON"}  # flag -> name, widest first


def machine() -> dict[str, str]:
    """What a speed depends on: processor, instruction set, cores, load, versions."""
    facts = {"processor": platform.processor() or platform.machine()}
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        values = {name.strip(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
        facts["processor"] = values.get("model name", facts["processor"])
        flags = values.get("flags", values.get("Features", "")).split()
        known = [name for flag, name in INSTRUCTION_SETS.items() if flag in flags]
        facts["instruction set"] = known[0] if known else "unknown"
    facts["cores"] = str(available_cores())
    if hasattr(os, "getloadavg"):
        facts["load before"] = f"{os.getloadavg()[0]:.1f}"
    facts["system"] = f"{platform.system()} {platform.release()}"
    facts["python"] = platform.python_version()
    return facts | {name: importlib.metadata.version(name) for name in ("numba", "numpy", "gymnasium", "torch")}
