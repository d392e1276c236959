# The README's training and tests, in a container.
#
#     docker build -t borearl .
#     docker run --rm -v "$PWD/runs:/borearl/runs" borearl             # train, evaluate, score
#     docker run --rm borearl pytest                                   # all tests but the slow ones
FROM python:3.11-slim

# tests make repositories of their own
RUN apt-get update && apt-get install -y --no-install-recommends git && rm -rf /var/lib/apt/lists/*

WORKDIR /borearl
# torch for processors: a tenth of the download; alone, since its index has not all versions of the rest, and first, so
# that a change of the source does not download it again
COPY constraints.txt .
RUN pip install --no-cache-dir --no-deps --index-url https://download.pytorch.org/whl/cpu -c constraints.txt torch
COPY . .
RUN pip install --no-cache-dir -c constraints.txt -e ".[train,test]"
# every kernel, so that a container does not compile them again
ENV NUMBA_CACHE_DIR=/borearl/.cache
RUN python -c "from cleanrl_style import protocol; from sim.block import KERNELS; protocol.compile_physics(KERNELS)"

CMD ["python", "cleanrl_style/ppo_group.py", "--seed", "1", "--vectorization", "lockstep"]
