//! The live viewer: who is let in, what is painted, and that the ray shown is the ray computed.

use super::pages::*;
use super::runs::{bent, data, straight};
use crate::common::running::*;
use crate::common::*;
use refraxel::viewer::{Orders, Painter, Scene, Server};
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
use std::path::Path;
use std::process::Stdio;
use std::sync::Arc;
use std::thread;
use std::time::Duration;
use tungstenite::Message;

/// A server of the run in this process; its address.
fn serve() -> String {
    serve_run(Run::load(bent()).unwrap()).0
}

/// A server of a run on the glass ball in this process: its address, and its painter's orders.
fn serve_run(run: Run) -> (String, Orders) {
    let data = Dataset::open(data(), &Default::default()).unwrap();
    let scene = Scene::new("ball".to_owned(), run, Some(&data));
    let photographs = Arc::clone(scene.photographs());
    let (painter, orders) = Painter::new(scene, 1.0);
    let server = Server::bind(0).unwrap().with_files([bent().join("evidence.png")]);
    let url = server.url();
    server.start(orders.clone(), photographs, None);
    thread::spawn(|| painter.work());
    (url, orders)
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

#[test]
fn only_the_page_with_the_token_is_let_in() {
    let url = serve();
    let (token, cookie) = (token(&url), cookie(&url));
    assert_eq!(token.len(), 32);
    let own = format!("Host: {}", host(&url));
    let known = format!("Cookie: {cookie}");
    let get = |path: &str, more: &[&str]| {
        let first = format!("GET {path} HTTP/1.1");
        request(&url, &[&[&first[..]], more].concat())
    };
    let page = get("/", &[&own, &known]);
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("default-src 'none'"), "{page}");
    assert!(page.contains(&format!("connect-src 'self' ws://{};", host(&url))), "{page}");
    for file in ["page.js", "page.css"] {
        assert!(page.contains(&format!("\"./{file}\"")), "the page names {file}");
        assert!(get(&format!("/{file}"), &[&own, &known]).starts_with("HTTP/1.1 200"), "{file}");
        assert!(get(&format!("/{file}"), &[&own]).starts_with("HTTP/1.1 404"), "{file}");
    }
    // The picture that convinced is there once the run has one; no other file of its folder is.
    let evidence = || get("/evidence.png", &[&own, &known]);
    let there = bent().join("evidence.png");
    assert!(evidence().starts_with("HTTP/1.1 404"));
    std::fs::write(&there, "as drawn").unwrap();
    let shown = evidence();
    std::fs::remove_file(there).unwrap();
    assert!(shown.starts_with("HTTP/1.1 200") && shown.contains("image/png") && shown.ends_with("as drawn"));
    assert!(get("/checkpoint.safetensors", &[&own, &known]).starts_with("HTTP/1.1 404"));
    let wrong = token.replace(|c: char| c.is_ascii_digit(), "a");
    let forged = format!("Cookie: {}", cookie.replace(token, &wrong));
    for path in
        ["/", &format!("/{wrong}x/"), &format!("/{token}/../../etc/passwd"), &format!("/{token}/page.js")]
    {
        for cookie in ["X: none", &forged] {
            let refused = get(path, &[&own, cookie]);
            assert!(
                refused.starts_with("HTTP/1.1 404") && refused.contains("that `refraxel` has printed"),
                "{path}"
            );
        }
    }
    for (header, word) in [("Host: evil.example", "evil.example"), ("Host: evil.example:80", "ssh -L")] {
        let refused = get(&format!("/{token}/"), &[header]);
        assert!(refused.starts_with("HTTP/1.1 403") && refused.contains(word), "{refused}");
        assert!(!refused.contains("Set-Cookie"), "{refused}");
    }
    let foreign = get("/", &[&own, &known, "Origin: http://evil.example"]);
    assert!(foreign.starts_with("HTTP/1.1 403") && foreign.contains("another one"), "{foreign}");
    for (cookie, origin) in [
        (cookie.clone(), Some("http://evil.example".to_owned())),
        (cookie.clone(), None),
        (cookie.replace(token, &wrong), Some(format!("http://{}", host(&url)))),
    ] {
        assert!(Page::knock_with(&url, &cookie, origin.as_deref()).is_err(), "{cookie} {origin:?}");
    }
    // Another interface is not listened on.
    let port = host(&url).split(':').nth(1).unwrap().to_owned();
    assert!(TcpStream::connect(format!("127.0.0.2:{port}")).is_err());
}

#[test]
fn the_token_becomes_a_cookie_of_the_port_that_the_browser_sees() {
    let url = serve();
    let path = format!("GET /{}/ HTTP/1.1", token(&url));
    for (name, port) in
        [("127.0.0.1:9", "9"), ("localhost:8080", "8080"), ("localhost", "80"), ("[::1]:1", "1")]
    {
        let answer = request(&url, &[&path, &format!("Host: {name}")]);
        assert!(answer.starts_with("HTTP/1.1 303") && answer.contains("\r\nLocation: /\r\n"), "{answer}");
        let expected = format!("refraxel-{port}={}; HttpOnly; SameSite=Strict; Path=/\r\n", token(&url));
        assert!(answer.contains(&expected), "{answer}");
        let cookie = format!("Cookie: refraxel-{port}={}", token(&url));
        let page = request(&url, &["GET / HTTP/1.1", &format!("Host: {name}"), &cookie]);
        assert!(page.starts_with("HTTP/1.1 200") && page.contains(&format!("ws://{name};")), "{page}");
    }
    // Of two viewers on one host, each has its own.
    let other = serve();
    let both = format!("Cookie: {}; {}", cookie(&url), cookie(&other));
    for url in [url, other] {
        let page = request(&url, &["GET / HTTP/1.1", &format!("Host: {}", host(&url)), &both]);
        assert!(page.starts_with("HTTP/1.1 200"), "{page}");
    }
}

#[test]
fn who_asks_for_a_socket_learns_what_is_missing() {
    let url = serve();
    let (own, known) = (format!("Host: {}", host(&url)), format!("Cookie: {}", cookie(&url)));
    let origin = format!("Origin: http://{}", host(&url));
    let ask =
        |more: &[&str]| request(&url, &[&["GET /socket HTTP/1.1", &own, &known, &origin], more].concat());
    let key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    for (headers, status, word) in [
        (vec![], "426", "version 13"),
        (
            vec!["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 8", key],
            "426",
            "version 13",
        ),
        (
            vec!["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13"],
            "400",
            "Sec-WebSocket-Key",
        ),
        (vec!["Upgrade: websocket", "Sec-WebSocket-Version: 13", key], "400", "Connection: Upgrade"),
    ] {
        let refused = ask(&headers);
        assert!(refused.starts_with(&format!("HTTP/1.1 {status}")) && refused.contains(word), "{refused}");
    }
}

#[test]
fn pictures_get_better_until_they_are_what_render_gives() {
    let run = bent();
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
fn a_picture_is_of_one_state_of_the_training_and_says_of_which() {
    const SIZE: [u32; 2] = [240, 240];
    let state = |folder: &Path, step: u64| {
        let mut run = Run::load(folder).unwrap();
        run.state.step = step;
        run
    };
    let states = || [state(bent(), 1), state(straight(), 2)];
    // Pictures whose pixels all have a ray are the same whenever they are painted.
    let whole = |picture: &Picture| picture.header["rays"] != 0;
    let key = |picture: &Picture| (picture.header["step"].as_u64(), picture.header["rays"].as_u64());
    let mut known = Vec::new();
    for run in states() {
        let (mut page, _) = Page::open(&serve_run(run).0);
        page.ask(look(1, SIZE, json!({})));
        loop {
            let picture = page.picture();
            let is_last = picture.header["last"] == true;
            known.extend(Some(picture).filter(whole));
            if is_last {
                break;
            }
        }
    }
    assert_eq!(known.iter().map(key).map(|(step, _)| step).collect::<Vec<_>>(), [1, 1, 2, 2].map(Some));
    assert!(difference(&known[1].pixels, &known[3].pixels) > 1.0, "the states look alike");
    let [first, _] = states();
    let (url, orders) = serve_run(first);
    let (mut page, _) = Page::open(&url);
    page.ask(look(1, SIZE, json!({})));
    let mut seen = Vec::new();
    for k in 0..6 {
        seen.push(page.picture());
        let [a, b] = states();
        orders.renew(if k % 2 == 0 { b } else { a });
    }
    orders.renew(state(straight(), 2));
    while seen.last().is_none_or(|p: &Picture| p.header["last"] != true || p.header["step"] != 2) {
        seen.push(page.picture());
    }
    let mut compared = 0;
    for picture in seen.iter().filter(|picture| whole(picture)) {
        let same = known.iter().find(|known| key(known) == key(picture)).unwrap();
        assert_eq!(picture.pixels, same.pixels, "{}", picture.header);
        compared += 1;
    }
    assert!(compared >= 3, "{compared} pictures of {}", seen.len());
}

#[test]
fn a_state_waits_for_no_page_that_takes_no_pictures() {
    let (url, orders) = serve_run(Run::load(bent()).unwrap());
    let (mut deaf, _) = Page::open(&url);
    // It says of no picture that it has received it, and gets three.
    deaf.ask(look(1, [2000, 2000], json!({})));
    for _ in 0..3 {
        while !deaf.0.read().unwrap().is_binary() {}
    }
    let mut run = Run::load(bent()).unwrap();
    run.state.step += 1;
    let step = run.state.step;
    orders.renew(run).recv_timeout(PATIENCE).unwrap();
    let (mut page, scene) = Page::open(&url);
    assert_eq!(scene["step"], step);
    assert_eq!(page.best(look(1, [32, 32], json!({}))).header["step"], step);
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
fn a_crop_hides_what_lies_outside_of_its_box_and_can_be_taken_back() {
    let (mut page, scene) = Page::open(&serve());
    let corner = |side: &str| [0, 1, 2].map(|k| scene[side][k].as_f64().unwrap());
    let (low, high) = (corner("min"), corner("max"));
    let shown = |page: &mut Page, id: u64, crop: Value| {
        page.best(look(
            id,
            [48, 48],
            json!({ "shown": "opacity", "straight": true, "edits": { "crop": crop } }),
        ))
        .pixels
    };
    let whole = shown(&mut page, 1, Value::Null);
    // Nothing is where nothing is left; and all of it where the box is larger than the scene.
    let nothing = shown(&mut page, 2, json!([high, high.map(|x| x + 1.0)]));
    let all = shown(&mut page, 3, json!([low.map(|x| x - 1.0), high.map(|x| x + 1.0)]));
    let middle = [0, 1, 2].map(|k| 0.5 * (low[k] + high[k]));
    let half = shown(&mut page, 4, json!([low, [high[0], middle[1], high[2]]]));
    let again = shown(&mut page, 5, Value::Null);
    let sum = |p: &image::RgbImage| p.iter().map(|x| u64::from(*x)).sum::<u64>();
    assert!(sum(&nothing) < sum(&whole) / 100, "{} of {}", sum(&nothing), sum(&whole));
    assert!(
        (sum(&whole) / 10..sum(&whole) * 9 / 10).contains(&sum(&half)),
        "{} of {}",
        sum(&half),
        sum(&whole)
    );
    assert_eq!((&all, &again), (&whole, &whole));
}

#[test]
fn the_ray_shown_is_the_ray_computed() {
    let run = bent();
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
    assert!(page.told_or_refused().contains("refractive region 8: the scene has 1"));
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
        (json!({ "ask": "photo", "view": 8 }), "photograph 9: the scene has 8"),
        (json!({ "ask": "slice", "region": 3, "axis": 0, "at": 0.5 }), "region 4: the scene has 1"),
        (json!({ "ask": "slice", "region": 0, "axis": 9, "at": 0.5 }), "axis 9"),
        (json!({ "ask": "stop" }), "nothing is trained"),
        (film("{}", json!({})), "once the training has ended"),
        (film("{}", json!({ "format": "mov" })), "not understood"),
        (film("{}", json!({ "out": "/tmp/film.gif" })), "not understood"),
        (json!({ "ask": "stop_film" }), "once the training has ended"),
        (json!({ "ask": "follow", "id": 1, "origin": [0, 0, 0], "direction": [0, 0, 0] }), "direction"),
        (json!({ "ask": "ray", "id": 1, "u": 2.0, "v": 0.5 }), "no ray"),
        (look(2, [32, 32], json!({ "edits": { "index": [99.0] } })), "edits.index[0]"),
        (look(3, [32, 32], json!({ "edits": { "index": [1.3, 1.3] } })), "region 2: the scene has 1"),
        (look(3, [32, 32], json!({ "edits": { "crop": [[0, 0, 0], [1, -1, 1]] } })), "edits.crop"),
        (look(3, [32, 32], json!({ "edits": { "crop": [[0, 0, 0]] } })), "not understood"),
        (look(4, [32, 32], json!({ "photo": 77 })), "photograph 78"),
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

#[cfg(unix)]
#[test]
fn view_prints_its_address_and_ends_when_interrupted() {
    let run = bent();
    let (mut program, url) = viewed(&mut command(&["view", path(run), "--json"]));
    let (mut page, _) = Page::open(&url);
    page.best(look(1, [32, 32], json!({})));
    let port = host(&url).split(':').nth(1).unwrap();
    refraxel(&["view", path(run), "--port", port]).refused(4, &["cannot listen", port]);
    send(&program, &["INT"]);
    let (told, _) = page.rest();
    let why = told.last().unwrap();
    assert_eq!(why["tell"], "ended");
    assert!(why["why"].as_str().unwrap().contains("was ended in its terminal"), "{why}");
    assert_eq!(program.code(), 0);
}

/// The wish for a film along a path.
fn film(path: &str, more: Value) -> Value {
    let mut wish = json!({ "ask": "film", "path": path, "format": "gif", "shown": "colour", "straight": false, "index": null });
    wish.as_object_mut().unwrap().extend(more.as_object().cloned().unwrap());
    wish
}

#[cfg(unix)]
#[test]
fn a_film_is_rendered_for_a_page_fetched_and_stopped() {
    let run = bent();
    let temporary = tempfile::tempdir().unwrap();
    let mut command = command(&["view", path(run), "--json"]);
    let (mut program, url) = viewed(command.env("TMPDIR", temporary.path()));
    let (mut page, _) = Page::open(&url);
    let frame = json!({ "camera_to_world": [1, 0, 0, 0, 0, 0, -1, -3, 0, 1, 0, 0, 0, 0, 0, 1], "fov": 40 });
    let along = |frames: usize, size: u32| {
        let frames = vec![frame.clone(); frames];
        json!({ "render_width": size, "render_height": size, "fps": 10, "camera_path": frames }).to_string()
    };
    let end = |page: &mut Page| loop {
        let told = page.told("film");
        if told["film"] != "renders" {
            return told;
        }
    };
    page.ask(film(&along(3, 24), json!({ "index": 1.3 })));
    assert_eq!(end(&mut page), json!({ "tell": "film", "film": "ready", "file": "film.gif" }));
    let (own, known) = (format!("Host: {}", host(&url)), format!("Cookie: {}", cookie(&url)));
    let fetched = request(&url, &["GET /film.gif?1 HTTP/1.1", &own, &known]);
    assert!(
        fetched.starts_with("HTTP/1.1 200")
            && fetched.contains("image/gif\r\n")
            && fetched.contains("GIF89a")
    );
    assert!(request(&url, &["GET /film.gif HTTP/1.1", &own]).starts_with("HTTP/1.1 404"));

    page.ask(film("{}", json!({})));
    let failed = end(&mut page);
    let why = failed["why"].as_str().unwrap();
    assert!(why.contains("error: ") && why.contains("render_width"), "{failed}");

    page.ask(film(&along(3000, 200), json!({ "straight": true })));
    while page.told("film")["pace"].is_null() {}
    page.ask(film(&along(3, 24), json!({})));
    while !page.told_or_refused().contains("a film is rendered already") {}
    page.ask(json!({ "ask": "stop_film" }));
    assert_eq!(end(&mut page)["film"], "stopped");

    page.ask(film(&along(3000, 200), json!({})));
    while page.told("film")["pace"].is_null() {}
    send(&program, &["INT"]);
    assert_eq!(program.code(), 0);
    assert!(is_without_files(temporary.path()), "what was made for films is removed");
}

#[test]
fn pages_learn_that_the_painter_has_failed() {
    let (url, orders) = serve_run(Run::load(bent()).unwrap());
    let (page, _) = Page::open(&url);
    // A state whose optimiser is that of another model is refused by a panic.
    let Run { optimiser, .. } = Run::load(straight()).unwrap();
    orders.renew(Run { optimiser, ..Run::load(bent()).unwrap() });
    let late = |told: &[Value]| told.last().unwrap()["why"].as_str().unwrap().contains("has a bug");
    assert!(late(&page.rest().0));
    let page = Page::knock(&url, Some(&format!("http://{}", host(&url)))).unwrap();
    assert!(late(&page.rest().0));
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
fn a_page_that_asks_without_end_makes_no_other_wait() {
    let url = serve();
    let (mut page, _) = Page::open(&url);
    let (mut busy, _) = Page::open(&url);
    for question in [
        json!({ "ask": "slice", "region": 0, "axis": 2, "at": 0.5 }),
        json!({ "ask": "surface", "region": 0 }),
        json!({ "ask": "photo", "view": 0 }),
        look(1, [640, 640], json!({})),
        json!({ "ask": "ray", "id": 1, "u": 0.5, "v": 0.5 }),
    ] {
        for _ in 0..2000 {
            busy.ask(question.clone());
        }
    }
    busy.ask(json!({ "ask": "slice", "region": 9, "axis": 2, "at": 0.5 }));
    // The picture of the other one comes while those questions are worked at, or after the few that are.
    page.best(look(1, [32, 32], json!({})));
    let mut answers = 0;
    while !busy.0.read().unwrap().to_text().is_ok_and(|text| text.contains("refused")) {
        answers += 1;
        assert!(answers < 2000, "{answers} questions are answered of which nobody wants but the last");
    }
}

#[test]
fn silent_connections_keep_nobody_out() {
    let url = serve();
    let silent: Vec<TcpStream> = (0..500).map(|_| TcpStream::connect(host(&url)).unwrap()).collect();
    let (mut page, _) = Page::open(&url);
    page.best(look(1, [32, 32], json!({})));
    // The oldest have made room for newer ones.
    let mut oldest = &silent[0];
    oldest.set_read_timeout(Some(PATIENCE)).unwrap();
    assert!(matches!(oldest.read(&mut [0; 1]), Ok(0) | Err(_)));
}

#[test]
fn sixteen_pages_are_open_at_once_and_the_next_one_learns_why_it_is_not() {
    let url = serve();
    let mut pages: Vec<Page> = (0..16).map(|_| Page::open(&url).0).collect();
    for (k, page) in pages.iter_mut().enumerate() {
        page.ask(look(k as u64, [24, 24], json!({})));
    }
    for (k, page) in pages.iter_mut().enumerate() {
        while page.picture().header["last"] != true {}
        assert_eq!(page.best(look(100 + k as u64, [16, 16], json!({}))).header["id"], 100 + k);
    }
    let refused = Page::knock(&url, Some(&format!("http://{}", host(&url)))).err().unwrap();
    assert!(refused.contains("503"), "{refused}");
    pages.pop();
    // Its place is free once the server has noticed.
    while Page::knock(&url, Some(&format!("http://{}", host(&url)))).is_err() {
        thread::sleep(Duration::from_millis(20));
    }
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
fn view_refuses_a_run_that_is_not_there() {
    refraxel(&["view", "/no/run"]).refused(3, &["/no/run"]);
    refraxel(&["view", "/no/run", "--port", "0"]).refused(2, &["--port"]);
}

#[test]
fn a_training_is_seen_and_stopped_from_its_page() {
    let (_folder, data, run) = ball_and("seen");
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
    assert_eq!(program.code(), 130);
    assert!(rest.join().unwrap().contains("saved; the same command with --resume"));
    assert!(Run::load(&run).unwrap().state.step > 0);
}

#[test]
fn the_last_picture_of_a_training_is_of_its_end_and_pages_learn_why_it_ended() {
    let (_folder, data, run) = ball_and("finished");
    let options = ["--refraction", "off", "--view", "--set", "run.steps=300", "--set", "grid.resolution=16"];
    let words = [&["train", path(&data), "--out", path(&run)], &options[..]].concat();
    let mut program = Running(command(&words).stderr(Stdio::piped()).spawn().unwrap());
    let mut errors = BufReader::new(program.0.stderr.take().unwrap());
    let (mut page, _) = Page::open(&address(&mut errors));
    let rest = thread::spawn(move || drop(errors.lines().map_while(Result::ok).collect::<Vec<_>>()));
    page.ask(look(1, [64, 64], json!({})));
    let (told, headers) = page.rest();
    assert_eq!(program.code(), 0);
    rest.join().unwrap();
    let last = headers.last().unwrap();
    assert_eq!((&last["step"], &last["last"], &last["rays"]), (&json!(300), &json!(true), &json!(4)));
    let ended = told.iter().find(|told| told["tell"] == "ended").expect("a reason");
    let why = ended["why"].as_str().unwrap();
    assert!(why.contains("finished after 300 steps") && why.contains(path(&run)), "{why}");
    // Steps are counted in steps.
    let records: Vec<&Value> = told.iter().filter(|told| told["kind"] == "record").collect();
    let last = records.last().unwrap();
    assert_eq!((&last["step"], &last["steps"]), (&json!(300), &json!(300)));
    assert!(
        told.iter().all(|told| !told["text"].as_str().unwrap_or_default().contains("training ")),
        "{told:?}"
    );
}

#[test]
fn a_training_that_waits_is_saved_and_ends_when_it_is_told_to() {
    let (_folder, data, run) = ball_and("ended");
    let (mut program, mut page, _) = endless(&data, &run);
    page.ask(json!({ "ask": "pause", "paused": true }));
    while page.told("training")["text"] != "waits" {}
    page.ask(json!({ "ask": "stop" }));
    assert_eq!(program.code(), 130);
    assert!(Run::load(&run).unwrap().state.step > 0);
}

#[test]
fn a_training_ends_also_when_it_was_about_to_wait() {
    let (_folder, data, run) = ball_and("ended");
    let (mut program, mut page, _) = endless(&data, &run);
    for paused in [true, false, true] {
        page.ask(json!({ "ask": "pause", "paused": paused }));
    }
    page.ask(json!({ "ask": "stop" }));
    assert_eq!(program.code(), 130);
}

/// A training without end, its page, and what it says until it ends.
fn endless(data: &Path, run: &Path) -> (Running, Page, thread::JoinHandle<String>) {
    let steps =
        ["--refraction", "off", "--view", "--set", "run.steps=1000000", "--set", "grid.resolution=16"];
    let words = [&["train", path(data), "--out", path(run)], &steps[..]].concat();
    let mut program = Running(command(&words).stderr(Stdio::piped()).spawn().unwrap());
    let mut errors = BufReader::new(program.0.stderr.take().unwrap());
    let url = address(&mut errors);
    let rest = thread::spawn(move || errors.lines().map_while(Result::ok).collect::<Vec<_>>().join("\n"));
    let (mut page, _) = Page::open(&url);
    while page.told("training")["kind"] != "record" {}
    (program, page, rest)
}
