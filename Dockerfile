# docker build -t refraxel . && docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" refraxel demo
FROM rust:1.95-slim-bookworm AS build
WORKDIR /source
COPY . .
RUN cargo build --profile dist --locked

# The program alone: docker build --target program -t refraxel .
FROM debian:bookworm-slim AS program
COPY --from=build /source/target/dist/refraxel /usr/local/bin/
# Runs are written here: mount a folder.
WORKDIR /work
ENTRYPOINT ["refraxel"]
CMD ["demo"]

# With what `refraxel import` and films call.
FROM program
RUN apt-get update && apt-get install -y --no-install-recommends colmap ffmpeg && rm -rf /var/lib/apt/lists/*
