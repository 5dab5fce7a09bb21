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
    cargo test --workspace --test dependencies -- --ignored

# API documentation, opened in the browser
docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --open

# Speed of this machine
bench:
    cargo run --release -- bench

# So many damages of each file that is read
damage cases="1000":
    PROPTEST_CASES={{cases}} cargo test --workspace --test robustness --test damage

# The viewer's page, after a change in viewer/ (needs node)
page:
    cd viewer && npm ci && npm run build

# The site of the pages, with links checked, in target/site/html
site:
    .ci/site

# Whether the pages show the stored figures
figures:
    docs/figures.py --check

# Everything that CI checks
ci:
    .ci/run
    .ci/python

# The Python package: builds, types, tests, notebooks
python:
    .ci/python
