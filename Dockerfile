# docker build -t objstate . && docker run --rm -v "$PWD":/data objstate inspect drive.mcap
# Files that it writes belong to you with --user "$(id -u):$(id -g)".
FROM python:3.11-slim

WORKDIR /src
COPY pyproject.toml README.md LICENSE constraints.txt ./
COPY objstate objstate
RUN pip install --no-cache-dir -c constraints.txt .

# Compiled loops are kept for the processor that they were compiled on; on another one the first run
# compiles them anew, and a volume at this place keeps them.
ENV NUMBA_CACHE_DIR=/var/cache/objstate
RUN mkdir -m 1777 /var/cache/objstate && cd / && objstate compile \
    && chmod -R a+rwX /var/cache/objstate && rm -r /src

WORKDIR /data
ENTRYPOINT ["objstate"]
