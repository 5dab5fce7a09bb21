//! The start page: who may use it, what it lists, and that its steps are the verbs of the program.
#![cfg(unix)] // programs are interrupted by signals

use super::importing::Place;
use super::pages::*;
use crate::common::running::{Running, send, wait_until};
use crate::common::*;
use refraxel_train::run::Run;
use serde_json::{Value, json};
use std::net::TcpStream;
use std::path::Path;
use tempfile::TempDir;

/// The start page of a folder, and its address.
fn begin(folder: &Path) -> (Running, String) {
    let mut command = command(&["view", "--json"]);
    command.current_dir(folder);
    viewed(&mut command)
}

/// A page of this address, and what it is told first.
fn open(url: &str) -> (Page, Value) {
    let mut page = Page::knock(url, Some(&format!("http://{}", host(url)))).unwrap();
    let home = page.told("home");
    page.told("work");
    (page, home)
}

impl Page {
    /// What becomes of the verb that is at work, once it has ended.
    fn end(&mut self) -> Value {
        self.work(|work| !["works", "stops"].contains(&work["stage"].as_str().unwrap()))
    }

    /// The verb as it is once this is true of it.
    fn work(&mut self, is: impl Fn(&Value) -> bool) -> Value {
        loop {
            let told = self.told("work");
            if told["work"].is_object() && is(&told["work"]) {
                return told["work"].clone();
            }
        }
    }

    fn refused(&mut self, text: &str) -> String {
        self.0.send(tungstenite::Message::text(text)).unwrap();
        loop {
            let told: Value = serde_json::from_str(&self.told_or_refused()).unwrap();
            if let Some(why) = told["why"].as_str() {
                return why.to_owned();
            }
            // What is at work goes on to tell how far it is.
            assert!(told["work"].is_object(), "{text}: {told}");
        }
    }
}

/// Nobody listens there any more.
fn is_closed(url: &str) -> bool {
    TcpStream::connect(host(url)).is_err()
}

fn empty() -> (TempDir, Running, String) {
    let folder = tempfile::tempdir().unwrap();
    let (program, url) = begin(folder.path());
    (folder, program, url)
}

#[test]
fn the_start_page_is_for_who_knows_its_address() {
    let (_folder, _program, url) = empty();
    let (own, known) = (format!("Host: {}", host(&url)), format!("Cookie: {}", cookie(&url)));
    let get =
        |path: &str, more: &[&str]| request(&url, &[&[&*format!("GET {path} HTTP/1.1")], more].concat());
    let page = get("/", &[&own, &known]);
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("form-action 'none'"), "{page}");
    for path in ["/page.js", "/page.css"] {
        assert!(get(path, &[&own, &known]).starts_with("HTTP/1.1 200"), "{path}");
    }
    // There are pictures once `inspect` has drawn them, and never another file.
    for path in ["/inspect_photographs.png", "/film.mp4", "/evidence.png", "/../etc/passwd", "/etc/passwd"] {
        assert!(get(path, &[&own, &known]).starts_with("HTTP/1.1 404"), "{path}");
    }
    for path in ["/", "/page.js", "/inspect_photographs.png"] {
        assert!(get(path, &[&own]).starts_with("HTTP/1.1 404"), "{path}");
        assert!(get(path, &["Host: evil.example", &known]).starts_with("HTTP/1.1 403"), "{path}");
    }
    for (cookie, origin) in [
        (cookie(&url), Some("http://evil.example")),
        (cookie(&url), None),
        ("refraxel-1=0".to_owned(), Some(&*format!("http://{}", host(&url)))),
    ] {
        assert!(Page::knock_with(&url, &cookie, origin).is_err(), "{cookie} {origin:?}");
    }
}

#[test]
fn questions_to_the_start_page_that_make_no_sense_begin_nothing() {
    let (folder, _program, url) = empty();
    let (mut page, home) = open(&url);
    assert_eq!(
        (&home["runs"], &home["folder"]),
        (&json!([]), &json!(path(&folder.path().canonicalize().unwrap())))
    );
    let train = |more: &str| format!(r#"{{"ask":"begin","verb":"train","path":"/tmp",{more}}}"#);
    for (text, word) in [
        ("", "not understood"),
        ("{", "not understood"),
        (r#"{"ask":"shell","words":["rm"]}"#, "not understood"),
        (r#"{"ask":"look","id":1}"#, "not understood"),
        (r#"{"ask":"folder","path":"photos"}"#, "from the root"),
        (r#"{"ask":"folder","path":"/tmp/../etc"}"#, "without \"..\""),
        (r#"{"ask":"folder","path":"/etc/passwd"}"#, "cannot read /etc/passwd"),
        (r#"{"ask":"folder","path":"/a\u0000b"}"#, "cannot read"),
        (r#"{"ask":"open","path":"/tmp/../tmp"}"#, "without \"..\""),
        (r#"{"ask":"open","path":"/proc"}"#, "no run"),
        (r#"{"ask":"begin","verb":"inspect","path":"--help"}"#, "from the root"),
        (r#"{"ask":"begin","verb":"export","path":"/tmp"}"#, "not understood"),
        (&train(r#""minutes":1,"refraction":"perhaps""#), "not understood"),
        (&train(r#""minutes":1,"refraction":"off","out":"/""#), "not understood"),
        (&train(r#""minutes":0,"refraction":"off""#), "minutes: found 0"),
        (&train(r#""minutes":1e300,"refraction":"off""#), "minutes"),
        (&train(r#""minutes":1"#), "refraction"),
    ] {
        let why = page.refused(text);
        assert!(why.contains(word), "{text}: {why}");
    }
    page.ask(json!({ "ask": "stop" }));
    assert!(page.told("work")["work"].is_null());
    assert!(is_without_files(folder.path()));
}

#[test]
fn photographs_are_inspected_trained_and_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let data = ball(folder.path());
    let (mut program, url) = begin(folder.path());
    let (mut page, _) = open(&url);
    page.ask(json!({ "ask": "folder", "path": path(folder.path()) }));
    assert_eq!(page.told("folder")["folders"][0]["name"], "ball");

    page.ask(json!({ "ask": "begin", "verb": "inspect", "path": path(&data) }));
    let inspected = page.end();
    let found = inspected["found"].as_str().unwrap();
    assert!(found.contains("\nviews      8: 5 training, 1 validation, 2 test"), "{inspected}");
    let picture = request(
        &url,
        &[
            "GET /inspect_photographs.png?1 HTTP/1.1",
            &format!("Host: {}", host(&url)),
            &format!("Cookie: {}", cookie(&url)),
        ],
    );
    assert!(picture.starts_with("HTTP/1.1 200") && picture.contains("image/png"), "{picture}");

    page.ask(
        json!({ "ask": "begin", "verb": "train", "path": path(&data), "minutes": 10, "refraction": "off" }),
    );
    let training = page.work(|work| work["live"].is_string() && work["pace"]["task"] == "training");
    assert!(training["pace"]["left"].as_str().unwrap().contains(':'), "{training}");
    let run = folder.path().canonicalize().unwrap().join("ball-run");
    assert_eq!(training["out"], path(&run));
    assert!(
        training["command"].as_str().unwrap().contains("--out ball-run --minutes 10 --refraction off"),
        "{training}"
    );
    let why = page.refused(&json!({ "ask": "begin", "verb": "import", "path": "/tmp" }).to_string());
    assert!(why.contains("is at work"), "{why}");
    // Who comes later is told where it stands.
    let mut late = Page::knock(&url, Some(&format!("http://{}", host(&url)))).unwrap();
    assert_eq!(late.work(|_| true)["number"], training["number"]);

    page.ask(json!({ "ask": "stop" }));
    page.ask(json!({ "ask": "stop" }));
    let stopped = page.end();
    assert_eq!((&stopped["stage"], &stopped["run"]), (&json!("stopped"), &json!(path(&run))));
    assert!(stopped["why"].as_str().unwrap().contains("saved; the same command with --resume"), "{stopped}");
    let step = Run::load(&run).unwrap().state.step;
    assert_eq!(page.told("home")["runs"][0]["name"], "ball-run");

    let mut addresses = Vec::new();
    for _ in 0..2 {
        page.ask(json!({ "ask": "open", "path": path(&run) }));
        addresses.push(page.told("opened")["url"].as_str().unwrap().to_owned());
    }
    assert_eq!(addresses[0], addresses[1], "one viewer is enough for a run");
    let (scene, described) = Page::open(&addresses[0]);
    assert_eq!(described["step"], step);

    // The end of one is the end of all.
    send(&program, &["INT"]);
    assert_eq!(page.told("ended")["tell"], "ended");
    assert!(scene.rest().0.iter().any(|told| told["tell"] == "ended"));
    assert_eq!(program.code(), 0);
    assert!(is_closed(&addresses[0]) && is_closed(&url));
}

#[test]
fn a_training_is_saved_when_the_start_page_ends_or_is_killed() {
    for signal in ["INT", "KILL"] {
        let folder = tempfile::tempdir().unwrap();
        let data = ball(folder.path());
        let (mut program, url) = begin(folder.path());
        let (mut page, _) = open(&url);
        page.ask(json!({ "ask": "begin", "verb": "train", "path": path(&data), "minutes": 100, "refraction": "off" }));
        let live = page.work(|work| work["pace"]["task"] == "training")["live"].as_str().unwrap().to_owned();
        send(&program, &[signal]);
        program.code();
        wait_until("the training ends", || is_closed(&live));
        let run = folder.path().join("ball-run");
        wait_until("the training is saved", || Run::load(&run).is_ok_and(|run| run.state.step > 0));
        wait_until("its lock is gone", || !run.join("training.lock").exists());
    }
}

#[test]
fn photographs_without_poses_are_imported_first_and_errors_are_told_in_full() {
    let place = Place::new();
    let (_program, url) = viewed(&mut place.command(&["view", "--json"]));
    let (mut page, _) = open(&url);
    let photos = place.at("photos");
    let begin = |verb: &str| json!({ "ask": "begin", "verb": verb, "path": path(&photos) });
    page.ask(begin("inspect"));
    let inspected = page.end();
    assert_eq!((&inspected["stage"], &inspected["needs_poses"]), (&json!("failed"), &json!(true)));

    std::fs::write(place.at("bin/mapper.fails"), "").unwrap();
    page.ask(begin("import"));
    let failed = page.end();
    let why = failed["why"].as_str().unwrap();
    assert!(why.starts_with("error: ") && why.contains("no overlap at all"), "{why}");
    assert!(why.contains("the same command continues from there"), "the last line, too: {why}");

    std::fs::remove_file(place.at("bin/mapper.fails")).unwrap();
    page.ask(begin("import"));
    let imported = page.end();
    assert_eq!(imported["stage"], "done", "{imported}");
    assert!(imported["found"].as_str().unwrap().contains("3 of 4 photographs posed"), "{imported}");
    page.ask(json!({ "ask": "begin", "verb": "inspect", "path": imported["out"] }));
    assert!(page.end()["found"].as_str().unwrap().contains("\nviews      3"));
    page.ask(json!({ "ask": "forget" }));
    assert!(page.told("work")["work"].is_null());
}
