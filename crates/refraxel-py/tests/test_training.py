"""Sessions and runs."""

import os
import signal
import threading
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

import refraxel
from conftest import STRAIGHT
from refraxel import FileError, InputError, Run, Session


def test_training_teaches_the_pictures(data: refraxel.Dataset, run: Run) -> None:
    scores = run.evaluate(data)
    assert run.step == 40 and len(scores["per_image"]) == 2
    assert scores["psnr"] > 15.0, scores["psnr"]
    rendering = run.render(data.cameras[data.test[0]])
    assert rendering.colour.shape == (32, 32, 3) and rendering.colour.dtype == np.uint8
    assert rendering.opacity.shape == rendering.depth.shape == (32, 32)


def test_a_session_steps_saves_and_goes_on_with_the_same_bits(data: refraxel.Dataset, tmp_path: Path) -> None:
    whole, parts = Session(data, options=STRAIGHT), Session(data, options=STRAIGHT)
    assert parts.run(until_step=12) == "reached" and parts.step == 12
    parts.save(tmp_path / "run")
    resumed = Run.load(tmp_path / "run").resume(data)
    assert resumed.run(until_step=20) == whole.run(until_step=20) == "reached"
    ours, theirs = resumed.snapshot().model(), whole.snapshot().model()
    np.testing.assert_array_equal(ours.get("raw_density"), theirs.get("raw_density"))
    np.testing.assert_array_equal(ours.get("sh"), theirs.get("sh"))


def test_saved_runs_load_and_existing_ones_are_not_overwritten(
    data: refraxel.Dataset, run: Run, tmp_path: Path
) -> None:
    run.save(tmp_path / "a")
    camera = data.cameras[0]
    np.testing.assert_array_equal(Run.load(tmp_path / "a").render(camera).colour, run.render(camera).colour)
    with pytest.raises(InputError, match="overwrite=True"):
        refraxel.train(data, tmp_path / "a", options=STRAIGHT)
    with pytest.raises(InputError, match="data in memory"):
        Run.load(tmp_path / "a").evaluate()


def test_where_a_run_is_saved_is_checked_before_the_work(data: refraxel.Dataset, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    heard: list[dict] = []
    with pytest.raises(FileError, match="file"):
        refraxel.train(data, file, options=STRAIGHT, on_event=heard.append)
    with pytest.raises(FileError, match="file"):
        Session(data, options=STRAIGHT).save(file)
    for seconds in [0.0, -1.0, float("nan"), float("inf")]:
        with pytest.raises(InputError, match="save_every"):
            refraxel.train(data, tmp_path / "run", options=STRAIGHT, save_every=seconds, on_event=heard.append)
    assert not heard


def test_two_trainings_do_not_share_a_folder_and_a_new_run_keeps_no_old_scores(
    data: refraxel.Dataset, tmp_path: Path
) -> None:
    def again(event: dict) -> None:
        if event["event"] == "record":
            with pytest.raises(InputError, match="training.lock"):
                refraxel.train(data, tmp_path, options=STRAIGHT, overwrite=True)

    refraxel.train(data, tmp_path, options=STRAIGHT, on_event=again)
    assert not (tmp_path / "training.lock").exists()
    scores = tmp_path / "eval" / "test" / "metrics.json"
    scores.parent.mkdir(parents=True)
    scores.write_text("{}")
    refraxel.train(data, tmp_path, options={**STRAIGHT, "run.steps": 5}, overwrite=True)
    assert Run.load(tmp_path).step == 5 and not scores.exists()


def test_a_run_goes_on_with_its_own_photographs_alone(data: refraxel.Dataset, tmp_path: Path) -> None:
    session = Session(data, options=STRAIGHT)
    session.run(until_step=2)
    session.save(tmp_path)
    other = refraxel.Scene("glass_ball", seed=1).dataset(size=(32, 32), views=(12, 0, 2), spp=4)
    with pytest.raises(InputError, match="other photographs or cameras"):
        Run.load(tmp_path).resume(other)
    assert Run.load(tmp_path).resume(data).step == 2


def test_a_known_index_that_is_not_used_is_refused(data: refraxel.Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="would not be used"):
        Session(data, options={"refraction.bend": False}, index_from=tmp_path / "none.json")


def test_options_are_any_mapping_and_switches_those_of_numpy_too(data: refraxel.Dataset) -> None:
    options = MappingProxyType({**STRAIGHT, "refraction.bend": np.bool_(False)})
    assert Session(data, options=options).options["refraction"]["bend"] == "off"


def test_events_can_be_called_back_or_yielded(data: refraxel.Dataset) -> None:
    session = Session(data, options=STRAIGHT)
    heard: list[dict] = []
    session.run(until_step=30, on_event=heard.append)
    assert any(e["event"] == "record" and e["step"] == 25 for e in heard)
    yielded = list(refraxel.events(session))
    assert [e["step"] for e in yielded if e["event"] == "record"] == [40] and session.step == 40


def test_leaving_the_loop_over_events_cancels(data: refraxel.Dataset) -> None:
    session = Session(data, options={**STRAIGHT, "run.steps": 1_000_000})
    for event in refraxel.events(session):
        if event["event"] == "record":
            break
    assert 0 < session.step < 1_000_000
    assert session.run(until_step=session.step + 1) == "reached"


def test_another_thread_gets_a_snapshot_and_cancels(data: refraxel.Dataset) -> None:
    session = Session(data, options={**STRAIGHT, "run.steps": 1_000_000})
    started, ended = threading.Event(), []
    worker = threading.Thread(target=lambda: ended.append(session.run(on_event=lambda _: started.set())))
    worker.start()
    assert started.wait(120)
    snapshot = session.snapshot()
    session.cancel()
    worker.join(120)
    assert ended == ["cancelled"] and snapshot.step <= session.step


def test_an_interrupt_stops_training_and_keeps_what_was_learned(data: refraxel.Dataset, tmp_path: Path) -> None:
    def interrupt(event: dict) -> None:
        if event["event"] == "record":
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        refraxel.train(data, tmp_path, options={**STRAIGHT, "run.steps": 1_000_000}, on_event=interrupt)
    assert 25 <= Run.load(tmp_path).step < 1_000_000


def test_an_exception_of_a_callback_stops_training_and_arrives(data: refraxel.Dataset) -> None:
    session = Session(data, options=STRAIGHT)

    def refuse(event: dict) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        session.run(on_event=refuse)
    assert session.run(until_step=session.step + 1) == "reached"


def test_wrong_options_are_refused_with_the_right_name(data: refraxel.Dataset) -> None:
    with pytest.raises(InputError, match="run.steps"):
        Session(data, options={"run.stepz": 3})
    assert "run.steps" in [option["name"] for option in refraxel.options()]


def test_straight_runs_have_opaque_things_alone(run: Run, tmp_path: Path) -> None:
    for name in ["scene.ply", "scene.obj", "scene.glb"]:
        run.export(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000
    with pytest.raises(InputError, match=".ply, .obj or .glb"):
        run.export(tmp_path / "glass.stl")
    assert run.surfaces() == [] and run.indices == []


def test_a_known_index_bends_rays_and_its_surface_is_exported(tmp_path: Path) -> None:
    refraxel.synth("glass_ball", tmp_path / "ball", size=24, views=8, spp=1)
    data = refraxel.Dataset.open(tmp_path / "ball")
    options = {**STRAIGHT, "refraction.bend": "on", "refraction.straight_steps": 10, "judge.enabled": "off"}
    run = refraxel.train(data, options=options, index_from=tmp_path / "ball" / "scene.json")
    assert run.indices == pytest.approx([1.5], abs=0.02)
    [surface] = run.surfaces()
    assert surface["vertices"].shape[1] == surface["triangles"].shape[1] == 3
    radii = np.linalg.norm(surface["vertices"] - surface["vertices"].mean(axis=0), axis=1)
    assert radii.std() < 0.02 * radii.mean(), "the surface of a ball"
    for name in ["glass.ply", "glass.glb"]:
        run.export(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000
    assert run.evaluate()["ior"]["mean_inside"] == pytest.approx(1.5, abs=0.02)
