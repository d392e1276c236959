"""Runs a script of the project as the command line would, with checkpoints every 512 steps: short runs have some, too.

python tests/often_saved.py cleanrl_style/ppo_gated.py --seed 1
"""

import sys

from scripts import run_script

from cleanrl_style.protocol import run_folder

if __name__ == "__main__":
    run_folder.CHECKPOINT_STEPS = 512
    run_script(*sys.argv[1:])
