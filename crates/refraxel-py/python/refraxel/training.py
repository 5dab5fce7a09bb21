"""Training from start to end, and the events of a session one by one."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ._refraxel import Dataset, Run, Session
from .errors import InputError

Event = dict[str, Any]
"""What happened in a run: ``event`` says what, and other keys say more. Those of ``record`` are lines of a training log."""

CHECKPOINT = "checkpoint.safetensors"


def train(
    data: Dataset,
    out: str | Path | None = None,
    *,
    options: Mapping[str, Any] | None = None,
    index_from: str | Path | None = None,
    save_every: float = 60.0,
    overwrite: bool = False,
    on_event: Callable[[Event], object] | None = None,
) -> Run:
    """Train to the end and return the run.

    ``out``: a folder in which the run is saved every ``save_every`` seconds and at the end; ``refraxel render`` and the other
    verbs of the program read it. ``options``: any of ``refraxel.options()``, such as ``{"run.minutes": 4}``. Where views
    have masks of what is refractive, rays bend if that explains the views better, unless ``{"refraction.bend": "off"}``. ``index_from``: a file with a known index of refraction. ``on_event`` is called in this
    thread with every event.

    KeyboardInterrupt ends training after saving what was learned, if there is a folder.

    Raises InputError before any work if something cannot be used or ``out`` holds a run and ``overwrite`` is False.
    """
    folder = None if out is None else Path(out)
    if folder is not None and not overwrite and (folder / CHECKPOINT).exists():
        raise InputError(f"{folder} holds a run already; choose another folder, or pass overwrite=True")
    session = Session(data, options=dict(options or {}), index_from=index_from, on_event=on_event)
    try:
        while session.run(seconds=None if folder is None else save_every, on_event=on_event) == "reached":
            if folder is None or _is_stopped(session):
                break
            session.save(folder)
    finally:
        if folder is not None and session.step > 0:
            session.save(folder)
    return session.snapshot()


def _is_stopped(session: Session) -> bool:
    """Whether the option run.stop_after has ended the run."""
    last = int(session.options["run"]["stop_after"])
    return 0 < last <= session.step


def events(session: Session, *, until_step: int | None = None, seconds: float | None = None) -> Iterator[Event]:
    """Train and yield every event.

    The session runs in another thread meanwhile; leaving the loop cancels it, and what was learned stays in the session.
    Failures of the run are raised here.
    """
    heard: queue.SimpleQueue[Event | None] = queue.SimpleQueue()
    failures: list[BaseException] = []

    def work() -> None:
        try:
            session.run(until_step=until_step, seconds=seconds, on_event=heard.put)
        except BaseException as failure:  # raised again by the consumer
            failures.append(failure)
        finally:
            heard.put(None)

    worker = threading.Thread(target=work, daemon=True)
    worker.start()
    ended = False
    try:
        while (event := heard.get()) is not None:
            yield event
        ended = True
    finally:
        if not ended:
            session.cancel()
        worker.join()
    if failures:
        raise failures[0]
