# Short names for common commands; `just` lists them.

default:
    @just --list

# Train on the built-in scene and show the result
demo:
    cargo run --release -- demo

# All tests
test:
    cargo test --workspace

# Format, lints, licences
lint:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets -- -D warnings
    cargo deny check bans licenses sources

# API documentation, opened in the browser
docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --open

# Speed of this machine
bench:
    cargo run --release -- bench

# Damaged and hostile files, kills and signals for so many minutes; what is found lies below campaign/
campaign minutes="60": campaign-programs
    "${CARGO_TARGET_DIR:-target}"/debug/campaign all {{minutes}}

[private]
campaign-programs:
    cargo build -p refraxel -p refraxel-campaign

# The viewer's page, after a change in viewer/ (needs node)
page:
    cd viewer && npm ci && npm run build

# Everything that CI checks
ci:
    .ci/run
    .ci/python

# The Python package: builds, types, tests, notebooks
python:
    .ci/python
