"""Many threads, signals, and calls that somebody wishes to stop."""

import _thread
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import refraxel
import scenes
from conftest import STRAIGHT
from refraxel import CancelledError, Medium, Run, Session, sweep


def in_time(work: Callable[[], object], seconds: float = 60.0) -> None:
    """Fails where `work` hangs."""
    worker = threading.Thread(target=work, daemon=True)
    worker.start()
    worker.join(seconds)
    assert not worker.is_alive(), "it hangs"


def test_setting_and_reading_a_model_in_two_threads_ends() -> None:
    model = scenes.model(None)
    value = model.get("raw_density")

    def change() -> None:
        for k in range(200):
            model.set("raw_density", value + np.float32(1e-3 * k))

    def both() -> None:
        changer = threading.Thread(target=change, daemon=True)
        changer.start()
        while changer.is_alive():
            assert model.names and model.get("raw_density").shape == value.shape

    in_time(both)


def test_a_snapshot_within_the_last_events_is_answered(data: refraxel.Dataset) -> None:
    session = Session(data, options=STRAIGHT)
    taken: list[Run] = []

    def slow(event: dict) -> None:
        # The worker has ended when the last ones of these are heard.
        if event["event"] == "record":
            time.sleep(1.0)
            taken.append(session.snapshot())

    in_time(lambda: session.run(on_event=slow))
    assert taken and taken[-1].step == 40


def interrupted(work: Callable[[], object], once: Callable[[], object]) -> float:
    """Seconds until a call ends that is interrupted once something has happened."""
    told: list[float] = []

    def tell() -> None:
        once()
        told.append(time.monotonic())
        _thread.interrupt_main()

    teller = threading.Thread(target=tell)
    teller.start()
    with pytest.raises(KeyboardInterrupt):
        work()
        teller.join()  # where work was quicker
        pytest.fail("it was not interrupted")
    return time.monotonic() - told[0]


def test_interrupts_are_heard_within_long_calls() -> None:
    origins, directions = (np.tile(a, (100, 1)) for a in scenes.rays(2000))
    medium, scene, model = Medium([scenes.lens(41)]), refraxel.Scene("luneburg"), scenes.model(scenes.lens())
    camera = refraxel.Camera.look_at((3.0, 0.0, 0.8), (0.0, 0.0, 0.0), size=(2000, 2000))
    d_colour = np.ones_like(origins)
    for work in [
        lambda: medium.trace(origins, directions, step=0.1),
        lambda: model.vjp(origins, directions, d_colour),
        lambda: scene.radiance(origins, directions),
        lambda: scene.render(camera, spp=64),
    ]:
        assert interrupted(work, lambda: time.sleep(0.3)) < 5.0


def test_a_cancelled_evaluation_says_so(data: refraxel.Dataset) -> None:
    session = Session(data, options=STRAIGHT)
    session.run(until_step=2)
    session.cancel()
    with pytest.raises(CancelledError):
        session.evaluate()


def test_an_interrupted_run_of_a_sweep_is_saved_and_goes_on(tmp_path: Path) -> None:
    refraxel.synth("glass_ball", tmp_path / "ball", size=16, views=6, spp=1)
    plan = tmp_path / "plan.toml"
    options = '"run.steps" = {}\n"run.save_every" = 1\n"grid.resolution" = 16\n"refraction.bend" = "off"\n'
    plan.write_text('[data]\nball = "ball"\n[options]\n' + options.format(1_000_000))
    folder = tmp_path / "out" / "ball" / "run"

    def is_saved() -> None:
        deadline = time.monotonic() + 120
        while not (folder / "checkpoint.safetensors").exists() and time.monotonic() < deadline:
            time.sleep(0.05)  # look again

    assert interrupted(lambda: sweep.run(plan, tmp_path / "out", 0), is_saved) < 30.0
    assert Run.load(folder).step > 0
