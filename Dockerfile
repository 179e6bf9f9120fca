# The commands in a container, for machines without Python of their own:
#   docker build -t deepsea-cosim .
#   docker run --rm -v "$PWD:/work" deepsea-cosim cosim-master /opt/deepsea/deepsea_11km.ssp --html
FROM python:3.13-slim

# gcc: FMUs get their front library; libosmesa6: replay --video without a display
RUN apt-get update \
    && apt-get install -y --no-install-recommends gcc libc6-dev libosmesa6 \
    && rm -rf /var/lib/apt/lists/*
ENV MUJOCO_GL=osmesa

COPY . /src
RUN pip install --no-cache-dir "/src[gap,study,results,formats,replay]" \
    && cosim-fmus build --out /opt/deepsea \
    && rm -rf /src

WORKDIR /work
CMD ["cosim-master", "--help"]
