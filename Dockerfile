# ffrobot with both stages on Debian 12. Untested: no container engine was at hand where it was written.
#
#   docker build -t ffrobot .
#   docker run --rm -v "$PWD":/work -u "$(id -u):$(id -g)" ffrobot solve scene.toml
FROM debian:12-slim

COPY . /opt/ffrobot
# A portable core: the image may run on another processor than the one that built it.
ENV FFROBOT_NATIVE=OFF
RUN bash -c 'source /opt/ffrobot/scripts/setup.sh' && \
    apt-get install -y --no-install-recommends libegl1 libgl1-mesa-dri && \
    /opt/ffrobot/.venv/bin/pip install pyvista -c /opt/ffrobot/.venv/constraints.txt && \
    rm -rf /var/lib/apt/lists/* /root/.cache

# Compiled forms and modal bodies are kept here; mount a volume to keep them between runs.
ENV XDG_CACHE_HOME=/tmp/cache
WORKDIR /work
ENTRYPOINT ["/opt/ffrobot/.venv/bin/ffrobot"]
