"""Calls the program, and tells which one, and on which machine."""

import json
import os
import platform
import subprocess
import sys
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent


@cache
def program() -> str:
    """The path of the program, built where REFRAXEL does not name one."""
    if "REFRAXEL" in os.environ:
        return str(Path(os.environ["REFRAXEL"]).resolve())
    subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT, check=True)
    return str(Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "release" / "refraxel")


def call(*words: str, cwd: Path | None = None) -> str:
    """Standard output of a call that must succeed."""
    done = subprocess.run([program(), *words], capture_output=True, text=True, cwd=cwd)
    if done.returncode:
        sys.exit(f"figures.py: exit code {done.returncode} of refraxel {' '.join(words)}\n{done.stderr}")
    return done.stdout


def train(data: Path, run: Path, *words: str) -> dict:
    """The scores of a run, which is trained unless it has them."""
    scores = run / "eval/test/metrics.json"
    if not scores.exists():
        print(f"training {run}", file=sys.stderr, flush=True)
        call("train", str(data), "--out", str(run), "--overwrite", "--quiet", *words)
    return json.loads(scores.read_text())


def last_record(run: Path) -> dict:
    """The last record of a training: its step and its seconds."""
    lines = (run / "log.jsonl").read_text().splitlines()
    return next(record for record in map(json.loads, reversed(lines)) if "step" in record)


def machine() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{names[0] if names else platform.processor() or platform.machine()}, {os.cpu_count()} logical cores"


def stamp() -> dict:
    """Where figures come from. Pages and figures that have just been written do not change what is measured."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True).stdout.strip()

    written = [":!README.md", ":!docs/*.md", ":!docs/figures", ":!docs/pictures"]
    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", *written)
    revision = (git("describe", "--always") or "unknown") + ("-dirty" if changed else "")
    version = call("--version").strip()
    return {"program": version, "revision": revision, "machine": machine()}
