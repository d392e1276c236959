"""torch's numbers are the same on every x86-64 processor with AVX2 (cleanrl_style/__init__.py)."""

import os
import re
import subprocess
import sys

import llvmlite.binding as llvm
import pytest
import torch
from scripts import ROOT

SETTINGS = ("MKL_CBWR", "ATEN_CPU_CAPABILITY")
# A few steps of a network as large as the scripts', in a process of its own: settings are read at torch's first use.
TRAIN = """
import hashlib
import cleanrl_style
import torch
torch.manual_seed(1)
torch.set_num_threads(1)
network = torch.nn.Sequential(torch.nn.Linear(105, 64), torch.nn.Tanh(), torch.nn.Linear(64, 27))
optimizer = torch.optim.Adam(network.parameters(), fused=True)
for _ in range(10):
    loss = -network(torch.randn(640, 105)).log_softmax(dim=1).mean()
    optimizer.zero_grad()
    loss.backward()
    optimizer.step()
parameters = torch.cat([p.detach().ravel() for p in network.parameters()])
print(hashlib.sha256(parameters.numpy().tobytes()).hexdigest()[:16], torch.backends.cpu.get_cpu_capability())
"""

pytestmark = pytest.mark.skipif(not llvm.get_host_cpu_features().get("avx2"), reason="needs AVX2")


def trained(**settings):
    environment = {name: value for name, value in os.environ.items() if name not in SETTINGS} | settings
    done = subprocess.run(
        [sys.executable, "-c", TRAIN], capture_output=True, text=True, cwd=ROOT, env=environment, check=True
    )
    return done.stdout.split()


@pytest.mark.skipif(
    not (sys.platform == "linux" and torch.__version__.startswith("2.13.0")), reason="the bytes are of torch 2.13.0"
)
def test_a_training_leaves_the_same_bytes_on_every_processor():
    assert trained() == ["f0838beb3cfd205e", "AVX2"]


def test_every_script_that_trains_takes_the_optimiser_whose_roots_are_exact():
    made = {
        path.stem: re.findall(r"optim\.Adam\(.*", path.read_text(encoding="utf-8"))
        for path in (ROOT / "cleanrl_style").glob("*.py")
    }
    with_one = {name: calls for name, calls in made.items() if calls}
    assert {"eupg_fixed_lambda", "eupg_var_lambda", "ppo_curriculum", "ppo_gated", "ppo_group"} <= with_one.keys()
    assert all("fused=True" in call for calls in with_one.values() for call in calls), with_one


def test_what_the_user_has_set_stays():
    assert trained(ATEN_CPU_CAPABILITY="default")[1] == "DEFAULT"
