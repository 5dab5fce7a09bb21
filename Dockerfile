# docker build -t refraxel . && docker run --rm -v "$PWD:/work" refraxel demo
FROM rust:1.95-slim-bookworm AS build
WORKDIR /source
COPY . .
RUN cargo build --release --locked

FROM debian:bookworm-slim
# What `refraxel import` and films call.
RUN apt-get update && apt-get install -y --no-install-recommends colmap ffmpeg && rm -rf /var/lib/apt/lists/*
COPY --from=build /source/target/release/refraxel /usr/local/bin/
# Runs are written here: mount a folder.
WORKDIR /work
ENTRYPOINT ["refraxel"]
CMD ["demo"]
