"""The runs of a plan, as ``refraxel sweep`` reads it, on Ray: ``pip install ray``. ``refraxel sweep --help`` shows a plan.

A run is done when it has been scored. While it is trained a checkpoint is saved now and then (``run.save_every``); a run that lost its
worker starts again and goes on from there.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ._refraxel import sweep_check, sweep_collect, sweep_jobs, sweep_run

__all__ = ["jobs", "on_ray", "run"]


def jobs(plan: str | Path, out: str | Path) -> list[dict[str, Any]]:
    """The runs of a plan: number, name, data, folder and options of each. Raises InputError if anything is wrong with the plan."""
    return sweep_jobs(plan, out)


def run(plan: str | Path, out: str | Path, number: int) -> None:
    """Train and score one run of a plan, by its number, here. A run that is done, or that another process trains, is left as it is.

    KeyboardInterrupt ends it after saving; the same call goes on.
    """
    sweep_run(plan, out, number)


def on_ray(
    plan: str | Path,
    out: str | Path,
    *,
    cpus_per_run: int = 1,
    retries: int = 3,
    address: str | None = None,
) -> list[dict[str, Any]]:
    """Train all runs of a plan on a Ray cluster, and collect their scores.

    ``plan`` and ``out`` must be seen under the same paths by all machines, as on a shared file system. ``cpus_per_run``: processors, and
    threads, of a run. ``retries``: how often a run whose worker is lost starts again. ``address``: the cluster; a running one, or else a
    local one is started, if None. Returns one dictionary per run, and writes out/results.csv and out/index.html, also when a run failed;
    then its error is raised.
    """
    import ray

    plan, out = Path(plan).absolute(), Path(out).absolute()
    found = jobs(plan, out)
    sweep_check(plan, out)
    if not ray.is_initialized():
        ray.init(address=address)

    @ray.remote(num_cpus=cpus_per_run, max_retries=retries)  # type: ignore[untyped-decorator,unused-ignore]
    def one(number: int) -> int:
        import os

        # Threads start with the first computation of a worker; workers are used again.
        os.environ["RAYON_NUM_THREADS"] = str(cpus_per_run)
        sweep_run(plan, out, number)
        return number

    left = [one.remote(job["number"]) for job in found]
    failure: Exception | None = None
    while left:
        ready, left = ray.wait(left)
        try:
            ray.get(ready)
        except Exception as error:  # other runs go on
            failure = failure or error
        sweep_collect(plan, out)
    rows = sweep_collect(plan, out)
    if failure is not None:
        raise failure
    return rows
