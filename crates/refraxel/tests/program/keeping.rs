//! What was trained is kept: saves, locks, and stops in the middle of things.
#![cfg(unix)] // signals

use crate::common::running::*;
use crate::common::*;
use refraxel_train::run::CHECKPOINT;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, SystemTime};

/// A training that would take hours, with these words beside the tiny options.
fn endless(data: &Path, run: &Path, more: &[&str]) -> Running {
    endless_telling(data, run, more, Stdio::piped())
}

fn endless_telling(data: &Path, run: &Path, more: &[&str], to: Stdio) -> Running {
    let mut words = vec!["train", path(data), "--out", path(run), "--refraction", "off"];
    words.extend(TINY);
    words.extend(["--set", "steps=100000000"]);
    words.extend(more);
    Running::start(command(&words).stderr(to))
}

#[test]
fn one_folder_has_one_training_and_a_lock_outlives_nobody() {
    let (_folder, data, run) = ball_and("run");
    let first = endless(&data, &run, &["--set", "save_every=0.1"]);
    wait_until("no checkpoint was saved in a tenth of a second", || run.join(CHECKPOINT).exists());
    let holder = format!("process {} on ", first.0.id());
    for how in [&["--resume"][..], &["--overwrite"], &[]] {
        train(&data, &run, how).refused(3, &[&holder, LOCK, "choose another --out"]);
    }
    refraxel(&["inspect", path(&run)]).done();
    refraxel(&["eval", path(&run), "--quiet"]).done();
    first.kill();
    assert!(run.join(LOCK).exists());
    let leftovers =
        [".log.jsonl.aB3dE6gH.tmp", "eval/.test.png.aB3dE6gH.tmp", "eval/test/.r_0.png.aB3dE6gH.tmp"];
    leftovers.iter().for_each(|name| fs::write(run.join(name), "x").unwrap());
    let saved = step(&run);
    assert!(saved > 0);
    let stop = format!("stop_after={}", saved + 3);
    let second =
        endless(&data, &run, &["--resume", "--set", &stop]).ended().refused(130, &[&holder, "taken over"]);
    assert!(second.err.contains("and saved"), "{}", second.err);
    assert_eq!(step(&run), saved + 3);
    assert!(!has_leftovers(&run) && leftovers.iter().all(|name| !run.join(name).exists()));
}

#[test]
fn a_second_signal_ends_the_program_at_once_and_says_what_is_kept() {
    let (_folder, data, run) = ball_and("run");
    // Steps so long that the first signal is hardly served before the second comes.
    let slow = ["--set", "batch=262144", "--threads", "1"];
    let stopped_twice = |child: Running, since: Option<SystemTime>| {
        let log = || fs::metadata(run.join("log.jsonl")).and_then(|m| m.modified()).ok();
        wait_until("training began", || log().is_some_and(|at| since.is_none_or(|since| at > since)));
        std::thread::sleep(Duration::from_millis(100));
        send(&child, &["INT", "TERM"]);
        child.ended().refused(130, &["without saving"])
    };
    let first = stopped_twice(endless(&data, &run, &slow), None);
    assert!(first.err.contains("nothing of this run is kept"), "{}", first.err);
    assert!(!run.join(CHECKPOINT).exists() && !has_leftovers(&run));
    let stop = [&slow[..], &["--set", "stop_after=3"]].concat();
    endless(&data, &run, &stop).ended().refused(130, &["stopped at step 3 and saved"]);
    let second =
        stopped_twice(endless(&data, &run, &[&slow[..], &["--resume"]].concat()), Some(SystemTime::now()));
    assert!(second.err.contains("is as saved at step 3, and --resume continues"), "{}", second.err);
    assert_eq!((step(&run), has_leftovers(&run)), (3, false));
}

#[test]
fn a_log_that_cannot_be_written_warns_and_the_run_is_trained() {
    let (_folder, data, run) = ball_and("run");
    for taken in ["log.jsonl", "curves.png"] {
        fs::create_dir_all(run.join(taken).join("mine")).unwrap();
    }
    let trained = train(&data, &run, &["--refraction", "off"]).done();
    for word in ["warning: cannot write", "log.jsonl", "curves.png"] {
        assert!(trained.err.contains(word), "{word}: {}", trained.err);
    }
    assert_eq!(step(&run), 40);
}

#[test]
fn a_save_that_fails_on_the_way_is_tried_again_and_the_last_one_must_succeed() {
    let (folder, data, run) = ball_and("run");
    let taken = run.join(CHECKPOINT);
    fs::create_dir_all(taken.join("mine")).unwrap();
    train(&data, &run, &["--overwrite", "--refraction", "off"]).refused(4, &["cannot write", CHECKPOINT]);
    let told = folder.path().join("told.txt");
    let telling = fs::File::create(&told).unwrap().into();
    let child = endless_telling(&data, &run, &["--overwrite", "--set", "save_every=0.1"], telling);
    let warned = || fs::read_to_string(&told).unwrap().contains("warning: cannot write");
    wait_until("no save failed", warned);
    fs::remove_dir_all(&taken).unwrap();
    wait_until("no save succeeded", || taken.is_file());
    send(&child, &["INT"]);
    child.ended();
    let told = fs::read_to_string(&told).unwrap();
    assert!(
        told.contains("training continues and saves again later") && told.contains("and saved"),
        "{told}"
    );
    assert!(step(&run) > 0 && !has_leftovers(&run));
}

#[test]
fn a_run_that_fell_back_to_straight_rays_is_resumed_by_its_own_command() {
    let (_folder, data, run) = ball_and("run");
    for split in ["train", "test", "val"] {
        for mask in fs::read_dir(data.join("masks").join(split)).unwrap() {
            image::GrayImage::new(16, 16).save(mask.unwrap().path()).unwrap(); // nothing is refractive
        }
    }
    train(&data, &run, &["--refraction", "on", "--set", "stop_after=30"]).refused(130, &[]);
    let log = fs::read_to_string(run.join("log.jsonl")).unwrap();
    assert!(log.contains("rays_stay_straight"), "{log}");
    train(&data, &run, &["--refraction", "on", "--resume"]).done();
    assert_eq!(step(&run), 40);
}
