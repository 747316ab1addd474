# docker build -t pbcs-ompl .
# docker run --rm -v "$PWD:/work" pbcs-ompl plan --env pbcs/Maze-v0
# Everything but Ray and the formats of other tools; torch without CUDA. g++ is for torch.compile, EGL for videos.
FROM python:3.11-slim-bookworm

RUN apt-get update && apt-get install -y --no-install-recommends g++ libegl1 libgl1 libgomp1 && rm -rf /var/lib/apt/lists/*

WORKDIR /source
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY planners planners
COPY envs envs
COPY pbcs_ompl pbcs_ompl
ARG TORCH_INDEX=https://download.pytorch.org/whl/cpu
RUN pip install --no-cache-dir --extra-index-url "$TORCH_INDEX" -c constraints.txt ".[all]"

ENV MUJOCO_GL=egl
WORKDIR /work
ENTRYPOINT ["pbcs"]
CMD ["--help"]
