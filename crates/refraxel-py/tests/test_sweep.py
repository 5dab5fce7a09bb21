"""The runs of a plan, here and on Ray."""

import os
import signal
import time
from pathlib import Path

import pytest

import refraxel
from refraxel import InputError, sweep
from refraxel._refraxel import Folder

PLAN = """
[data]
ball = "ball"

[options]
"run.steps" = {steps}
"run.save_every" = 1
"grid.resolution" = 16
"refraction.bend" = "off"

[vary]
"run.seed" = [0, 1, 2]
"""


@pytest.fixture()
def plan(tmp_path: Path) -> Path:
    refraxel.synth("glass_ball", tmp_path / "ball", size=16, views=6, spp=1)
    path = tmp_path / "plan.toml"
    path.write_text(PLAN.format(steps=30))
    return path


def test_runs_are_trained_scored_and_not_repeated(plan: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert [job["name"] for job in sweep.jobs(plan, out)] == [f"ball/run.seed={k}" for k in range(3)]
    sweep.run(plan, out, 1)
    checkpoint = out / "ball" / "run.seed=1" / "checkpoint.safetensors"
    saved = checkpoint.stat().st_mtime_ns
    sweep.run(plan, out, 1)
    assert checkpoint.stat().st_mtime_ns == saved
    with pytest.raises(InputError, match="from 0 to 2"):
        sweep.run(plan, out, 3)
    # A run that another process trains is left to it.
    folder = Folder(out / "ball" / "run.seed=2", False)
    sweep.run(plan, out, 2)
    assert not (out / "ball" / "run.seed=2" / "checkpoint.safetensors").exists()
    folder.release()
    plan.write_text(PLAN.format(steps=31))
    with pytest.raises(InputError, match="other options"):
        sweep.run(plan, out, 1)


def test_ray_trains_all_runs_also_if_a_worker_is_killed(plan: Path, tmp_path: Path) -> None:
    ray = pytest.importorskip("ray")
    out = tmp_path / "out"
    plan.write_text(PLAN.format(steps=4000))
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        import threading

        killed: list[int] = []

        def kill_the_first() -> None:
            deadline = time.monotonic() + 300
            while not killed and time.monotonic() < deadline:
                for lock in out.glob("ball/*/training.lock"):
                    # A run that has saved once: its worker's process is named in the lock.
                    if (lock.parent / "checkpoint.safetensors").exists():
                        pid = process_of(lock)
                        os.kill(pid, signal.SIGKILL)
                        killed.append(pid)
                        return
                time.sleep(0.05)  # look again

        killer = threading.Thread(target=kill_the_first)
        killer.start()
        rows = sweep.on_ray(plan, out)
        killer.join()
    finally:
        ray.shutdown()
    assert killed, "no worker was killed"
    assert [row["state"] for row in rows] == ["done"] * 3
    assert all(row["psnr"] > 10 for row in rows)
    assert len((out / "results.csv").read_text().splitlines()) == 4


def process_of(lock: Path) -> int:
    """The process that a lock names."""
    import json

    return int(json.loads(lock.read_text())["pid"])
