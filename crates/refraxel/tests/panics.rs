//! A panic ends the process with a message and its exit code, in whatever thread it happens.

use refraxel::exit::{Exit, end_on_panic};
use std::process::Command;
use std::time::{Duration, Instant};

/// What the other test runs in a process of its own.
#[test]
#[ignore = "ends the process"]
fn a_worker_panics_while_another_waits_for_it() {
    end_on_panic();
    let (never_sent, waits) = std::sync::mpsc::channel::<()>();
    std::thread::spawn(|| panic!("a worker has stumbled"));
    let _ = waits.recv();
    drop(never_sent);
}

#[test]
fn a_panic_in_a_worker_ends_the_process_with_a_message() {
    let mut line = Command::new(std::env::current_exe().unwrap());
    line.args(["--ignored", "--exact", "a_worker_panics_while_another_waits_for_it", "--nocapture"]);
    let start = Instant::now();
    let ran = line.output().unwrap();
    let said = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(Exit::Bug as i32), "{said}");
    assert!(
        said.contains("error: the program has a bug at ") && said.contains("a worker has stumbled"),
        "{said}"
    );
    assert!(start.elapsed() < Duration::from_secs(30));
}
