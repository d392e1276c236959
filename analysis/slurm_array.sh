#!/usr/bin/env bash
# A sweep as a Slurm job array, a core a task: the arguments of analysis/sweep.py, and as many tasks as one likes, without gaps.
#
#     sbatch --array=1-20 analysis/slurm_array.sh cleanrl_style/ppo_group.py --seeds 1-10 --grid learning_rate=1e-4,3e-4
#
# A task that is killed or requeued goes on from its checkpoints. When all have ended, the same arguments to
# `python analysis/sweep.py` make the table. The folder of the runs has to be one that all nodes see.
#SBATCH --job-name=borearl
#SBATCH --cpus-per-task=1
#SBATCH --mem=2G
#SBATCH --time=24:00:00
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail
cd "${SLURM_SUBMIT_DIR:-.}"
if ((SLURM_ARRAY_TASK_MAX - SLURM_ARRAY_TASK_MIN + 1 != SLURM_ARRAY_TASK_COUNT)); then
    echo "error: --array without gaps is allowed, such as 1-20, whose tasks share the runs that are not finished" >&2
    exit 1
fi
part=$((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN + 1))
exec python analysis/sweep.py --workers "${SLURM_CPUS_PER_TASK:-1}" "$@" --address none --part "$part/$SLURM_ARRAY_TASK_COUNT"
