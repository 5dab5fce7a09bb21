//! Films and camera paths.
#![cfg(unix)] // a script stands for ffmpeg

use super::runs::straight;
use crate::common::*;
use image::AnimationDecoder;
use image::codecs::gif::GifDecoder;
use refraxel_data::photographs::stored_pixels;
use serde_json::{Value, json};
use std::fs::File;
use std::io::BufReader;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

fn render(out: &Path, more: &[&str]) -> Ran {
    refraxel(&[&["render", path(straight()), "--out", path(out), "--json"], more].concat())
}

fn frames(film: &Path) -> Vec<image::RgbaImage> {
    let decoder = GifDecoder::new(BufReader::new(File::open(film).unwrap())).unwrap();
    decoder.into_frames().map(|frame| frame.unwrap().into_buffer()).collect()
}

/// Starts the program where this script is the only ffmpeg; `None`: where there is none.
fn with_ffmpeg(folder: &Path, script: Option<&str>, out: &Path) -> Ran {
    let programs = folder.join("programs");
    std::fs::create_dir_all(&programs).unwrap();
    if let Some(script) = script {
        let ffmpeg = programs.join("ffmpeg");
        std::fs::write(&ffmpeg, script).unwrap();
        std::fs::set_permissions(&ffmpeg, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let words = ["render", path(straight()), "--orbit", "3", "--out", path(out), "--json"];
    Ran::of(command(&words).env("PATH", &programs).output().unwrap())
}

#[test]
fn a_gif_has_all_frames_and_is_not_replaced_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let film = folder.path().join("film.gif");
    let report = render(&film, &["--orbit", "3", "--fps", "10"]).done().json();
    assert_eq!(report["film"], json!({ "frames": 3, "fps": 10.0, "size": [16, 16] }));
    let shown = frames(&film);
    assert_eq!((shown.len(), shown[0].dimensions()), (3, (16, 16)));
    assert!(shown[0] != shown[1], "the camera moves");
    render(&film, &["--orbit", "2"]).refused(3, &["film.gif", "--overwrite"]);
    render(&film, &["--orbit", "2", "--overwrite", "--size", "24x20"]).done();
    assert_eq!((frames(&film).len(), frames(&film)[0].dimensions()), (2, (24, 20)));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing lies beside it");
}

#[test]
fn ffmpeg_gets_the_frames_and_the_film_its_name_when_it_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let film = folder.path().join("film.mp4");
    // The last argument is the file to write.
    let copies = "#!/bin/sh\nfor last; do :; done\nexec /bin/cat > \"$last\"\n";
    let report = with_ffmpeg(folder.path(), Some(copies), &film).done().json();
    assert_eq!(report["film"]["fps"], 24.0);
    assert_eq!(std::fs::read(&film).unwrap().len(), 3 * 16 * 16 * 3, "three frames, three bytes per pixel");
    let other = folder.path().join("other.webm");
    let fails = "#!/bin/sh\necho 'Unknown encoder libvpx-vp9' >&2\nexit 1\n";
    with_ffmpeg(folder.path(), Some(fails), &other).refused(4, &["other.webm", "Unknown encoder", ".gif"]);
    assert!(!other.exists());
    let none = tempfile::tempdir().unwrap();
    with_ffmpeg(none.path(), None, &other).refused(3, &["ffmpeg is not installed", "apt-get install ffmpeg"]);
}

#[test]
fn films_and_folders_have_their_own_options() {
    let folder = tempfile::tempdir().unwrap();
    let (film, views) = (folder.path().join("film.gif"), folder.path().join("views"));
    render(&film, &["--orbit", "2", "--slices"]).refused(2, &["--slices"]);
    render(&film, &["--orbit", "2", "--outputs", "colour,depth"]).refused(2, &["one layer"]);
    render(&views, &["--orbit", "2", "--fps", "10"]).refused(2, &["--fps"]);
    render(&folder.path().join("film.mov"), &["--orbit", "2"]).refused(2, &[".mp4, .webm or .gif"]);
    render(&film, &["--orbit", "2", "--size", "0x9"]).refused(2, &["--size"]);
    render(&folder.path().join("no/film.gif"), &["--orbit", "2"]).refused(4, &["no/film.gif"]);
    render(&film, &["--orbit", "2", "--outputs", "depth"]).done();
    assert_eq!(frames(&film).len(), 2);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn camera_paths_are_rendered_where_they_lead() {
    let folder = tempfile::tempdir().unwrap();
    let views = folder.path().join("views");
    render(&views, &["--spiral", "5"]).done();
    let cameras: Value =
        serde_json::from_slice(&std::fs::read(views.join("transforms.json")).unwrap()).unwrap();
    let place = |frame: &Value| [0, 1, 2].map(|k| frame["transform_matrix"][k][3].as_f64().unwrap());
    let spiral: Vec<[f64; 3]> = cameras["frames"].as_array().unwrap().iter().map(place).collect();
    assert_eq!(spiral.len(), 5);
    assert!(spiral.windows(2).all(|w| w[0] != w[1]));
    // A smooth path through these cameras begins and ends with them.
    let (through, file) = (folder.path().join("through"), views.join("transforms.json"));
    render(&through, &["--keyframes", path(&file), "--frames", "9"]).done();
    let again: Value =
        serde_json::from_slice(&std::fs::read(through.join("transforms.json")).unwrap()).unwrap();
    let path_places: Vec<[f64; 3]> = again["frames"].as_array().unwrap().iter().map(place).collect();
    assert_eq!(path_places.len(), 9);
    for (a, b) in [(0, 0), (8, 4), (4, 2)] {
        assert!((0..3).all(|k| (path_places[a][k] - spiral[b][k]).abs() < 1e-6), "{a}");
    }
    // The same cameras as a path of nerfstudio show the same pictures.
    let frame = &cameras["frames"][0];
    let matrix: Vec<f64> =
        (0..16).map(|k| frame["transform_matrix"][k / 4][k % 4].as_f64().unwrap()).collect();
    let fov = 2.0 * (0.5 * 16.0 / frame["fl_y"].as_f64().unwrap()).atan().to_degrees();
    let document = json!({ "camera_type": "perspective", "render_width": 16, "render_height": 16, "fps": 12,
        "camera_path": [{ "camera_to_world": matrix, "fov": fov, "aspect": 1.0 }] });
    let written = folder.path().join("camera_path.json");
    std::fs::write(&written, document.to_string()).unwrap();
    let one = folder.path().join("one");
    render(&one, &["--camera-path", path(&written)]).done();
    let pixels = |file: PathBuf| stored_pixels(file).unwrap().into_rgb8();
    assert_eq!(pixels(one.join("0000.png")), pixels(views.join("0000.png")));
    let film = folder.path().join("path.gif");
    let report = render(&film, &["--camera-path", path(&written)]).done().json();
    assert_eq!(report["film"]["fps"], 12.0, "as the path says");
    render(&film, &["--camera-path", path(&file), "--overwrite"])
        .refused(3, &["transforms.json", "nerfstudio"]);
    render(&film, &["--camera-path", "/no/path.json", "--overwrite"]).refused(3, &["/no/path.json"]);
    render(&film, &["--frames", "9", "--orbit", "2", "--overwrite"]).refused(2, &["--frames", "--orbit"]);
}
