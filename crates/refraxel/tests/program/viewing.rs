//! The live viewer: who is let in, what is painted, and that the ray shown is the ray computed.

use crate::common::*;
use refraxel::viewer::{Painter, Scene, Server};
use refraxel_core::{Camera, Ray, Vec3, vec3};
use refraxel_data::Dataset;
use refraxel_train::cancel::Cancel;
use refraxel_train::evaluation::render;
use refraxel_train::run::Run;
use refraxel_train::schedule::rendering_marching;
use refraxel_train::{Backend, CpuBackend};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::Duration;
use tempfile::TempDir;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// Nothing takes so long; a test that waits in vain fails.
const PATIENCE: Duration = Duration::from_secs(120);

/// A run on a glass ball whose index and shape were given, made once.
fn glass_run() -> &'static (TempDir, PathBuf, PathBuf) {
    static RUN: OnceLock<(TempDir, PathBuf, PathBuf)> = OnceLock::new();
    RUN.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let data = ball(folder.path());
        let (run, scene) = (folder.path().join("run"), data.join("scene.json"));
        let index = ["--refraction", "on", "--index-from", path(&scene), "--set", "index.rate=0"];
        train(&data, &run, &[&index[..], &["--set", "surface.rate=0"]].concat()).done();
        (folder, run, data)
    })
}

/// A server of the run in this process; its address.
fn serve() -> String {
    let (_, run, data) = glass_run();
    let data = Dataset::open(data, &Default::default()).unwrap();
    let scene = Scene::new("ball".to_owned(), Run::load(run).unwrap(), Some(&data));
    let photographs = Arc::clone(scene.photographs());
    let (painter, orders) = Painter::new(scene, 1.0);
    let server = Server::bind(0).unwrap().with_evidence(run.join("evidence.png"));
    let url = server.url();
    server.start(orders, photographs, None);
    thread::spawn(|| painter.work());
    url
}

/// A page without a browser.
struct Page(WebSocket<TcpStream>);

/// A picture that a page receives.
struct Picture {
    header: Value,
    pixels: image::RgbImage,
}

fn host(url: &str) -> &str {
    url.strip_prefix("http://").unwrap().split('/').next().unwrap()
}

impl Page {
    /// A page of this address; its first message is the scene.
    fn open(url: &str) -> (Self, Value) {
        let mut page = Self::knock(url, Some(&format!("http://{}", host(url)))).unwrap();
        let scene = page.told("scene");
        (page, scene)
    }

    fn knock(url: &str, origin: Option<&str>) -> Result<Self, String> {
        let mut request = format!("{}socket", url.replace("http", "ws")).into_client_request().unwrap();
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", origin.parse().unwrap());
        }
        let stream = TcpStream::connect(host(url)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client::client(request, stream).map_err(|e| e.to_string())?;
        Ok(Self(socket))
    }

    fn ask(&mut self, question: Value) {
        self.0.send(Message::text(question.to_string())).unwrap();
    }

    /// The next message of this kind; others are left out.
    fn told(&mut self, kind: &str) -> Value {
        loop {
            if let Message::Text(text) = self.0.read().unwrap() {
                let told: Value = serde_json::from_str(&text).unwrap();
                if told["tell"] == kind {
                    return told;
                }
                assert_ne!(told["tell"], "refused", "{told}");
            }
        }
    }

    /// The text of the next message.
    fn told_or_refused(&mut self) -> String {
        loop {
            if let Message::Text(text) = self.0.read().unwrap() {
                return text.to_string();
            }
        }
    }

    /// The next picture of any kind, acknowledged.
    fn picture(&mut self) -> Picture {
        loop {
            match self.0.read().unwrap() {
                Message::Binary(bytes) => {
                    let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
                    let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
                    let pixels = image::load_from_memory(&bytes[4 + length..]).unwrap().into_rgb8();
                    if header["picture"] == "frame" {
                        self.ask(json!({ "ask": "got", "frame": header["frame"] }));
                    }
                    return Picture { header, pixels };
                }
                Message::Text(text) => assert!(!text.contains("refused"), "{text}"),
                _ => {}
            }
        }
    }

    /// The best picture of a look.
    fn best(&mut self, look: Value) -> Picture {
        let id = look["id"].clone();
        self.ask(look);
        loop {
            let picture = self.picture();
            if picture.header["id"] == id && picture.header["last"] == true {
                return picture;
            }
        }
    }
}

fn camera(size: [u32; 2]) -> Camera {
    Camera::look_at(vec3(2.6, 0.4, 1.0), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.6, size)
}

fn look(id: u64, size: [u32; 2], more: Value) -> Value {
    let camera = camera(size);
    let pose = camera.world_from_camera;
    let axes = pose.rotation.columns.map(|c| c.to_array());
    let page = json!({ "eye": pose.translation.to_array(), "axes": axes, "angle": 0.6, "size": size });
    let mut look = json!({ "ask": "look", "id": id, "camera": page });
    look.as_object_mut().unwrap().extend(more.as_object().cloned().unwrap_or_default());
    look
}

/// Mean difference of two pictures, in levels of 255.
fn difference(a: &image::RgbImage, b: &image::RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: f64 = a.iter().zip(b.iter()).map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs()).sum();
    sum / a.len() as f64
}

/// The answer to a request with these lines.
fn request(url: &str, lines: &[&str]) -> String {
    let mut stream = TcpStream::connect(host(url)).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(format!("{}\r\n\r\n", lines.join("\r\n")).as_bytes()).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

#[test]
fn only_the_page_with_the_token_is_let_in() {
    let url = serve();
    let token = url.split('/').nth(3).unwrap().to_owned();
    assert_eq!(token.len(), 32);
    let own = format!("Host: {}", host(&url));
    let get =
        |path: &str, more: &[&str]| request(&url, &[&[&format!("GET {path} HTTP/1.1")[..]], more].concat());
    let page = get(&format!("/{token}/"), &[&own]);
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("default-src 'none'"), "{page}");
    for file in ["page.js", "page.css"] {
        assert!(page.contains(&format!("\"./{file}\"")), "the page names {file}");
        assert!(get(&format!("/{token}/{file}"), &[&own]).starts_with("HTTP/1.1 200"), "{file}");
    }
    // The picture that convinced is there once the run has one; no other file of its folder is.
    let evidence = || get(&format!("/{token}/evidence.png"), &[&own]);
    let there = glass_run().1.join("evidence.png");
    assert!(evidence().starts_with("HTTP/1.1 404"));
    std::fs::write(&there, "as drawn").unwrap();
    let shown = evidence();
    std::fs::remove_file(there).unwrap();
    assert!(shown.starts_with("HTTP/1.1 200") && shown.contains("image/png") && shown.ends_with("as drawn"));
    assert!(get(&format!("/{token}/checkpoint.safetensors"), &[&own]).starts_with("HTTP/1.1 404"));
    let wrong = token.replace(|c: char| c.is_ascii_digit(), "a");
    for path in
        ["/", &format!("/{wrong}x/"), &format!("/{token}/../../etc/passwd"), &format!("/{token}/socket")]
    {
        assert!(get(path, &[&own]).starts_with("HTTP/1.1 404"), "{path}");
    }
    assert!(get(&format!("/{token}/"), &["Host: evil.example"]).starts_with("HTTP/1.1 403"));
    assert!(get(&format!("/{token}/"), &[&own, "Origin: http://evil.example"]).starts_with("HTTP/1.1 403"));
    for (address, origin) in [
        (url.clone(), Some("http://evil.example".to_owned())),
        (url.clone(), None),
        (url.replace(&token, &wrong), Some(format!("http://{}", host(&url)))),
    ] {
        assert!(Page::knock(&address, origin.as_deref()).is_err(), "{address} {origin:?}");
    }
    // Another interface is not listened on.
    let port = host(&url).split(':').nth(1).unwrap().to_owned();
    assert!(TcpStream::connect(format!("127.0.0.2:{port}")).is_err());
}

#[test]
fn pictures_get_better_until_they_are_what_render_gives() {
    let (_, run, _) = glass_run();
    let (mut page, scene) = Page::open(&serve());
    assert_eq!(
        (scene["regions"].as_array().unwrap().len(), scene["views"].as_array().unwrap().len()),
        (1, 8)
    );
    page.ask(look(1, [60, 40], json!({})));
    let first = page.picture();
    let mut last = page.picture();
    while last.header["last"] != true {
        last = page.picture();
    }
    assert!(first.header["rays"].as_u64() < last.header["rays"].as_u64());
    assert_eq!((&last.header["rays"], &last.header["size"]), (&json!(4), &json!([60, 40])));
    let Run { options, plan, model, optimiser, .. } = Run::load(run).unwrap();
    let marching = rendering_marching(&options, plan.near);
    let mut backend = CpuBackend::resumed(model, optimiser);
    backend.refresh_occupancy(&marching);
    let expected = render(&backend, &camera([60, 40]), &marching, &Cancel::new()).unwrap();
    let expected = image::RgbImage::from_raw(60, 40, expected.colour.into_flattened()).unwrap();
    // JPEG of quality 92, and four rays instead of one where nothing turns.
    let off = difference(&last.pixels, &expected);
    assert!(off < 4.0, "{off}");
}

#[test]
fn two_pages_look_at_different_things_at_once() {
    let url = serve();
    let ((mut a, _), (mut b, _)) = (Page::open(&url), Page::open(&url));
    a.ask(look(1, [48, 48], json!({})));
    b.ask(look(7, [64, 32], json!({ "straight": true })));
    let best = |page: &mut Page, id: u64, size: [u32; 2]| loop {
        let picture = page.picture();
        assert_eq!(picture.header["id"], id);
        if picture.header["last"] == true {
            assert_eq!(picture.pixels.dimensions(), size.into());
            return picture.pixels;
        }
    };
    let (bent, straight) = (best(&mut a, 1, [48, 48]), best(&mut b, 7, [64, 32]));
    // What one page wishes leaves the other's scene as it is.
    let again = a.best(look(2, [48, 48], json!({})));
    assert_eq!(difference(&again.pixels, &bent), 0.0);
    let bent = b.best(look(8, [64, 32], json!({})));
    assert!(difference(&bent.pixels, &straight) > 0.2);
    drop(a);
    assert_eq!(b.best(look(9, [64, 32], json!({}))).pixels, bent.pixels);
}

#[test]
fn the_index_slider_changes_the_picture_and_can_be_taken_back() {
    let (mut page, scene) = Page::open(&serve());
    assert!((scene["regions"][0]["index"].as_f64().unwrap() - 1.5).abs() < 1e-3);
    let learned = page.best(look(1, [48, 48], json!({}))).pixels;
    let water = page.best(look(2, [48, 48], json!({ "edits": { "index": [1.33] } }))).pixels;
    let air = page.best(look(3, [48, 48], json!({ "edits": { "index": [1.0] } }))).pixels;
    let straight = page.best(look(4, [48, 48], json!({ "straight": true }))).pixels;
    let again = page.best(look(5, [48, 48], json!({ "edits": { "index": [null] } }))).pixels;
    assert!(difference(&learned, &water) > 0.2);
    assert!(difference(&air, &straight) < 0.2 * difference(&learned, &straight));
    assert_eq!(learned, again);
}

#[test]
fn the_ray_shown_is_the_ray_computed() {
    let (_, run, _) = glass_run();
    let (mut page, _) = Page::open(&serve());
    let size = [64, 48];
    page.ask(look(1, size, json!({})));
    let Run { plan, model, .. } = Run::load(run).unwrap();
    let tracer = model.refraction.tracer(&model.field.domain, plan.near);
    let mut bounced = 0;
    for (u, v) in [(0.5, 0.5), (0.45, 0.55), (0.6, 0.5), (0.02, 0.02)] {
        page.ask(json!({ "ask": "ray", "id": 3, "u": u, "v": v }));
        let ray = page.told("ray")["ray"].clone();
        let expected: Ray<f32> = camera(size).ray(u * 64.0, v * 48.0).unwrap().cast();
        let points: Vec<Vec3<f64>> = serde_json::from_value::<Vec<[f64; 3]>>(ray["points"].clone())
            .unwrap()
            .into_iter()
            .map(|[x, y, z]| vec3(x, y, z))
            .collect();
        let direction = (points[points.len() - 1] - points[points.len() - 2]).normalized();
        page.ask(json!({ "ask": "follow", "id": 4, "origin": ray["straight"][0],
            "direction": expected.direction.cast::<f64>().to_array() }));
        assert_eq!(page.told("ray")["ray"]["points"].as_array().unwrap().len(), points.len());
        if !model.refraction.admits(&expected) {
            assert_eq!(points.len(), 2);
            continue;
        }
        let path = tracer.trace(&expected);
        for (point, segment) in points.iter().zip(&path.segments) {
            assert!((*point - segment.start.cast()).length() < 1e-9, "{point:?} {segment:?}");
        }
        assert!((direction - path.exit.direction.cast()).length() < 1e-4, "{direction:?} {:?}", path.exit);
        for bounce in ray["bounces"].as_array().unwrap() {
            // Snell's law, of numbers rounded to f32.
            let value = |key: &str, k: usize| bounce[key][k].as_f64().unwrap();
            let side = |k: usize| value("index", k) * value("angle", k).to_radians().sin();
            assert!((side(0) - side(1)).abs() < 2e-3, "{bounce}");
            bounced += 1;
        }
    }
    assert!(bounced >= 4, "rays through the ball meet its surface twice each: {bounced}");
}

#[test]
fn a_new_camera_takes_the_place_of_the_one_that_is_painted() {
    let (mut page, _) = Page::open(&serve());
    page.ask(look(1, [2000, 2000], json!({})));
    assert_eq!(page.picture().header["id"], 1);
    let small = page.best(look(2, [32, 32], json!({})));
    assert_eq!(small.header["id"], 2);
    // A camera that moves gets one picture for each place that is painted, and none is left over.
    page.ask(look(3, [32, 32], json!({ "moving": true })));
    let moving = page.picture();
    assert_eq!((&moving.header["id"], &moving.header["last"]), (&json!(3), &json!(true)));
}

#[test]
fn lines_on_the_glass_lie_in_its_box_and_clear_glass_becomes_grey() {
    let (mut page, _) = Page::open(&serve());
    page.ask(json!({ "ask": "surface", "region": 0 }));
    let told = page.told("surface");
    let pieces = told["pieces"].as_array().unwrap();
    assert!(pieces.len() > 100, "{}", pieces.len());
    for piece in pieces {
        let numbers: Vec<i64> = piece.as_array().unwrap().iter().map(|v| v.as_i64().unwrap()).collect();
        assert!(numbers[..6].iter().all(|x| (0..=4095).contains(x)), "{numbers:?}");
        let square: i64 = numbers[6..].iter().map(|x| x * x).sum();
        assert!((9800..10_200).contains(&square), "{numbers:?}");
    }
    let clear = page.best(look(1, [48, 48], json!({}))).pixels;
    let grey = page.best(look(2, [48, 48], json!({ "edits": { "absorption": [3.0] } }))).pixels;
    let sum = |p: &image::RgbImage| p.iter().map(|x| u64::from(*x)).sum::<u64>();
    assert!(sum(&grey) < sum(&clear), "{} {}", sum(&grey), sum(&clear));
    page.ask(json!({ "ask": "surface", "region": 7 }));
    assert!(page.told_or_refused().contains("refractive region 7: the scene has 1"));
}

#[test]
fn layers_photographs_and_slices_are_shown() {
    let (mut page, _) = Page::open(&serve());
    let mut pictures = Vec::new();
    for (k, layer) in
        ["colour", "depth", "opacity", "index", "normal", "reflection", "transmission"].iter().enumerate()
    {
        let id = k as u64 + 1;
        pictures.push(page.best(look(id, [40, 40], json!({ "shown": layer }))).pixels);
    }
    for k in [1, 2, 3, 4] {
        assert!(difference(&pictures[0], &pictures[k]) > 2.0, "layer {k}");
    }
    page.ask(json!({ "ask": "photo", "view": 0 }));
    let photo = page.picture();
    assert_eq!((&photo.header["picture"], photo.pixels.dimensions()), (&json!("photo"), (16, 16)));
    page.ask(json!({ "ask": "slice", "region": 0, "axis": 2, "at": 0.5 }));
    let slice = page.picture();
    let [low, high] = [0, 1].map(|k| slice.header["range"][k].as_f64().unwrap());
    assert!(low == 1.0 && (high - 1.5).abs() < 1e-3);
    let middle = slice.pixels.get_pixel(slice.pixels.width() / 2, slice.pixels.height() / 2).0;
    assert!(middle[0] > 200 && middle[2] < 100, "glass is yellow: {middle:?}");
}

#[test]
fn questions_that_make_no_sense_are_refused_and_change_nothing() {
    let (mut page, _) = Page::open(&serve());
    let before = page.best(look(1, [32, 32], json!({}))).pixels;
    for (question, word) in [
        (json!({ "ask": "file", "path": "/etc/passwd" }), "not understood"),
        (json!({ "ask": "photo", "view": 99 }), "photograph 99"),
        (json!({ "ask": "slice", "region": 3, "axis": 0, "at": 0.5 }), "region 3"),
        (json!({ "ask": "slice", "region": 0, "axis": 9, "at": 0.5 }), "axis 9"),
        (json!({ "ask": "stop" }), "nothing is trained"),
        (json!({ "ask": "follow", "id": 1, "origin": [0, 0, 0], "direction": [0, 0, 0] }), "direction"),
        (json!({ "ask": "ray", "id": 1, "u": 2.0, "v": 0.5 }), "no ray"),
        (look(2, [32, 32], json!({ "edits": { "index": [99.0] } })), "edits.index[0]"),
        (look(3, [32, 32], json!({ "edits": { "index": [1.3, 1.3] } })), "region 1"),
        (look(4, [32, 32], json!({ "photo": 77 })), "photograph 77"),
        (look(5, [32, 3], json!({})), "camera.size"),
    ] {
        page.ask(question.clone());
        let told = loop {
            match page.0.read().unwrap() {
                Message::Text(text) => break serde_json::from_str::<Value>(&text).unwrap(),
                _ => continue,
            }
        };
        assert_eq!(told["tell"], "refused", "{question}");
        assert!(told["why"].as_str().unwrap().contains(word), "{question}: {told}");
    }
    assert_eq!(page.best(look(6, [32, 32], json!({}))).pixels, before);
}

/// A program that serves a page, and the page's address, which it prints on one of its streams.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
    }
}

impl Program {
    fn interrupt(&self) {
        let kill = std::process::Command::new("kill").args(["-INT", &self.0.id().to_string()]).status();
        assert!(kill.unwrap().success());
    }
}

#[cfg(unix)]
#[test]
fn view_prints_its_address_and_ends_when_interrupted() {
    let (_, run, _) = glass_run();
    let child = command(&["view", path(run), "--json"]).stdout(Stdio::piped()).spawn().unwrap();
    let mut program = Program(child);
    let mut text = String::new();
    let mut out = BufReader::new(program.0.stdout.take().unwrap());
    while !text.contains('}') {
        assert!(out.read_line(&mut text).unwrap() > 0, "{text}");
    }
    let url = serde_json::from_str::<Value>(&text).unwrap()["url"].as_str().unwrap().to_owned();
    let (mut page, _) = Page::open(&url);
    page.best(look(1, [32, 32], json!({})));
    let port = host(&url).split(':').nth(1).unwrap();
    refraxel(&["view", path(run), "--port", port]).refused(4, &["cannot listen", port]);
    program.interrupt();
    assert_eq!(program.0.wait().unwrap().code(), Some(0));
}

#[test]
fn of_many_slices_the_last_is_shown_and_pictures_go_on() {
    let (mut page, _) = Page::open(&serve());
    page.best(look(1, [16, 16], json!({})));
    let at = |at: f64| json!({ "ask": "slice", "region": 0, "axis": 2, "at": at });
    page.ask(at(1.0));
    let last = page.picture().header;
    (0..200).for_each(|k| page.ask(at(f64::from(k) / 200.0)));
    page.ask(at(1.0));
    let mut slices = 1;
    while page.picture().header["corners"] != last["corners"] {
        slices += 1;
    }
    assert!(slices < 100, "{slices} slices are computed of which nobody wants but the last");
}

#[test]
fn slow_requests_are_closed() {
    let url = serve();
    let mut slow = TcpStream::connect(host(&url)).unwrap();
    slow.set_read_timeout(Some(PATIENCE)).unwrap();
    // A byte at a time; the server ends it long before the head could be whole.
    let mut writing = slow.try_clone().unwrap();
    writing.write_all(b"GET / HTTP/1.1\r\nX: ").unwrap();
    let writer = thread::spawn(move || {
        while writing.write_all(b"a").is_ok() {
            thread::sleep(Duration::from_millis(200));
        }
    });
    assert!(matches!(slow.read(&mut [0; 64]), Ok(0) | Err(_)), "nothing is answered");
    writer.join().unwrap();
    Page::open(&url);
}

#[test]
fn a_page_that_takes_nothing_is_closed() {
    let url = serve();
    let (mut page, _) = Page::open(&url);
    page.0.get_mut().set_write_timeout(Some(PATIENCE)).unwrap();
    // Pongs are not read; what waits for this page is bounded, and it is closed.
    let ping = || Message::Ping(vec![7; 100].into());
    let sent = (0..2_000_000).take_while(|_| page.0.send(ping()).is_ok()).count();
    assert!(sent < 2_000_000, "pings without end are taken");
    Page::open(&url);
}

#[test]
fn view_needs_a_run() {
    refraxel(&["view", "/no/run"]).refused(3, &["/no/run"]);
    refraxel(&["view", "/no/run", "--port", "0"]).refused(2, &["--port"]);
}

#[test]
fn a_training_is_seen_and_stopped_from_its_page() {
    let folder = tempfile::tempdir().unwrap();
    let (data, run) = (ball(folder.path()), folder.path().join("seen"));
    let (mut program, mut page, rest) = endless(&data, &run);
    page.best(look(1, [32, 32], json!({})));
    let record = loop {
        let told = page.told("training");
        if told["kind"] == "record" {
            break told;
        }
    };
    assert!(record["step"].as_u64().unwrap() > 0 && record["train_psnr"].as_f64().is_some(), "{record}");
    page.ask(json!({ "ask": "pause", "paused": true }));
    while page.told("training")["text"] != "waits" {}
    page.ask(json!({ "ask": "pause", "paused": false }));
    while page.told("training")["kind"] != "record" {}
    page.ask(json!({ "ask": "stop" }));
    assert_eq!(program.0.wait().unwrap().code(), Some(130));
    assert!(rest.join().unwrap().contains("saved; the same command with --resume"));
    assert!(Run::load(&run).unwrap().state.step > 0);
}

#[test]
fn a_training_that_waits_is_saved_and_ends_when_it_is_told_to() {
    let folder = tempfile::tempdir().unwrap();
    let (data, run) = (ball(folder.path()), folder.path().join("ended"));
    let (mut program, mut page, _) = endless(&data, &run);
    page.ask(json!({ "ask": "pause", "paused": true }));
    while page.told("training")["text"] != "waits" {}
    page.ask(json!({ "ask": "stop" }));
    assert_eq!(program.0.wait().unwrap().code(), Some(130));
    assert!(Run::load(&run).unwrap().state.step > 0);
}

#[test]
fn a_training_ends_also_when_it_was_about_to_wait() {
    let folder = tempfile::tempdir().unwrap();
    let (data, run) = (ball(folder.path()), folder.path().join("ended"));
    let (mut program, mut page, _) = endless(&data, &run);
    for paused in [true, false, true] {
        page.ask(json!({ "ask": "pause", "paused": paused }));
    }
    page.ask(json!({ "ask": "stop" }));
    assert_eq!(program.0.wait().unwrap().code(), Some(130));
}

/// A training without end, its page, and what it says until it ends.
fn endless(data: &Path, run: &Path) -> (Program, Page, thread::JoinHandle<String>) {
    let steps =
        ["--refraction", "off", "--view", "--set", "run.steps=1000000", "--set", "grid.resolution=16"];
    let words = [&["train", path(data), "--out", path(run)], &steps[..]].concat();
    let mut program = Program(command(&words).stderr(Stdio::piped()).spawn().unwrap());
    let mut errors = BufReader::new(program.0.stderr.take().unwrap());
    let url = address(&mut errors);
    let rest = thread::spawn(move || errors.lines().map_while(Result::ok).collect::<Vec<_>>().join("\n"));
    let (mut page, _) = Page::open(&url);
    while page.told("training")["kind"] != "record" {}
    (program, page, rest)
}

/// The address in the first line that has one.
fn address(lines: &mut impl BufRead) -> String {
    let mut line = String::new();
    loop {
        line.clear();
        assert!(lines.read_line(&mut line).unwrap() > 0, "no address");
        if let Some((_, url)) = line.split_once("live view: ") {
            return url.trim().to_owned();
        }
    }
}
