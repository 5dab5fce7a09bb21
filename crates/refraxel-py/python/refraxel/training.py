"""Training from start to end, and the events of a session one by one."""

from __future__ import annotations

import math
import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ._refraxel import Dataset, Folder, Run, Session
from .errors import InputError

Event = dict[str, Any]
"""What happened in a run: ``event`` says what, and other keys say more. Those of ``record`` are lines of a training log."""


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
    have masks of what is refractive, or something is found that straight rays do not explain, rays bend if that explains the views
    better, unless ``{"refraction.bend": "off"}``. ``index_from``: a file with a known index of refraction. ``on_event`` is called
    in this thread with every event.

    KeyboardInterrupt ends training after saving what was learned, if there is a folder.

    Raises InputError or FileError before any work if something cannot be used, if ``out`` cannot be a folder, if somebody else trains
    there, or if it holds a run and ``overwrite`` is False. A run that is overwritten stays until the new one is saved first.
    """
    if not (save_every > 0 and math.isfinite(save_every)):
        raise InputError(f"save_every is {save_every}; expected seconds above 0")
    if out is None:
        session = Session(data, options=options, index_from=index_from, on_event=on_event)
        session.run(on_event=on_event)
        return session.snapshot()
    path = Path(out)
    folder = Folder(path, overwrite)
    try:
        session = Session(data, options=options, index_from=index_from, on_event=on_event)
        replaces = overwrite

        def save() -> None:
            nonlocal replaces
            if replaces:
                folder.clear_scores()
                replaces = False
            session.save(path)

        try:
            while session.run(seconds=save_every, on_event=on_event) == "reached" and not _is_stopped(session):
                save()
        finally:
            if session.step > 0:
                save()
        return session.snapshot()
    finally:
        folder.release()


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
