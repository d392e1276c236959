"""Training scripts that read top to bottom, and what they share.

Imported before torch first calculates, it has torch do so in one way on all processors with AVX2. Left alone, its
matrix products (MKL) and its functions of vectors take another order of sums on AMD's processors than on Intel's, and
another with AVX-512, so that equal trainings part in a last bit. Its roots stay the processor's own (decision 110).
What is set in the environment stays as it is.
"""

import os

import llvmlite.binding as llvm

if llvm.get_host_cpu_features().get("avx2"):
    os.environ.setdefault("MKL_CBWR", "COMPATIBLE")
    os.environ.setdefault("ATEN_CPU_CAPABILITY", "avx2")  # as fast here: networks are small
