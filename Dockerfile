# BridgeGen with its simulator compiled: docker build -t bridgegen . && docker run --rm -v "$PWD:/runs" bridgegen search crossroads-s4
FROM python:3.11-slim AS wheel
WORKDIR /bridgegen
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY src src
COPY tools tools
RUN pip install --no-cache-dir -c constraints.txt . wheel
RUN python tools/build_wheel.py --out /wheels

FROM python:3.11-slim
COPY constraints.txt /tmp/constraints.txt
RUN --mount=type=bind,from=wheel,source=/wheels,target=/wheels pip install --no-cache-dir -c /tmp/constraints.txt /wheels/*.whl
RUN useradd --create-home bridgegen
USER bridgegen
WORKDIR /runs
ENTRYPOINT ["bridgegen"]
