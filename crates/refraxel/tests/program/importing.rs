//! `refraxel import` with stand-ins for COLMAP and ffmpeg, which write what the real ones would.
#![cfg(unix)] // the stand-ins are shell scripts

use crate::common::*;
use refraxel_data::photographs::stored_pixels;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A COLMAP 3.8 that logs its calls beside itself and poses every image, the cameras in a row.
const COLMAP: &str = r#"#!/bin/sh
here=$(dirname "$0")
case "$*" in
-h) echo "COLMAP 3.8 -- a stand-in"; exit ;;
*" -h") echo "  --SiftExtraction.use_gpu arg (=1)"; exit ;;
esac
echo "$*" >> "$here/calls"
verb=$1
while [ $# -gt 0 ]; do
    case $1 in
    --image_path) images=$2 ;;
    --output_path) out=$2 ;;
    --database_path) echo x >> "$2" ;;
    --ImageReader.mask_path) cp -r "$2" "$here/seen_masks" ;;
    esac
    shift
done
[ -e "$here/$verb.fails" ] && { echo "no overlap at all" >&2; exit 3; }
[ -e "$here/$verb.hangs" ] && exec sleep 60
[ "$verb" = feature_extractor ] && echo "Processed file [1/4]"
[ "$verb" = mapper ] || exit 0
mkdir -p "$out/0" "$out/1"
for model in 0 1; do
    echo "1 OPENCV 16 16 20 20 8 8 0 0 0 0" > "$out/$model/cameras.txt"
    echo "1 0 0 4 9 9 9 0.5 1 1" > "$out/$model/points3D.txt"
    : > "$out/$model/images.txt"
done
i=0
for image in "$images"/*; do
    i=$((i + 1))
    model=1
    [ $i -eq 1 ] && model=0
    printf '%s 1 0 0 0 %s 0 0 1 %s\n\n' $i $i "$(basename "$image")" >> "$out/$model/images.txt"
done
"#;

/// An ffmpeg that copies the picture beside itself as twelve frames.
const FFMPEG: &str = r#"#!/bin/sh
here=$(dirname "$0")
[ "$1" = -version ] && exit
echo "$*" >> "$here/calls"
for last; do :; done
for i in 01 02 03 04 05 06 07 08 09 10 11 12; do cp "$here/frame.jpg" "$(dirname "$last")/000$i.jpg"; done
echo "frame=   12 fps=0.0"
"#;

const FFPROBE: &str = "#!/bin/sh\necho avg_frame_rate=30/1\necho duration=2.0\n";

/// A folder with four photographs in `photos`, and stand-ins in `bin`.
pub struct Place {
    pub folder: TempDir,
}

impl Place {
    pub fn new() -> Self {
        let place = Self { folder: tempfile::tempdir().unwrap() };
        for folder in ["photos", "bin"] {
            fs::create_dir(place.at(folder)).unwrap();
        }
        for i in 0..4 {
            write_image(&place.at(&format!("photos/p{i}.png")), 16, 16);
        }
        place.program("colmap", COLMAP);
        place
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn program(&self, name: &str, text: &str) {
        let path = self.at("bin").join(name);
        fs::write(&path, text).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    pub fn command(&self, words: &[&str]) -> Command {
        let mut command = command(words);
        let path = format!("{}:/usr/bin:/bin", self.at("bin").display());
        command.current_dir(self.folder.path()).env("PATH", path);
        command
    }

    fn run(&self, words: &[&str]) -> Ran {
        Ran::of(self.command(words).output().unwrap())
    }

    /// Without any program on the PATH.
    fn run_alone(&self, words: &[&str]) -> Ran {
        let mut command = self.command(words);
        Ran::of(command.env("PATH", self.at("photos")).output().unwrap())
    }

    /// Names in a folder, sorted.
    fn names(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.at(folder)).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn calls(&self) -> String {
        fs::read_to_string(self.at("bin/calls")).unwrap()
    }
}

#[test]
fn photographs_become_a_dataset_that_the_program_opens() {
    let place = Place::new();
    let result = place.run(&["import", "photos", "--out", "scene", "--json", "--threads", "1"]).done().json();
    assert_eq!((&result["photographs"], &result["posed"]), (&4.into(), &3.into()));
    assert_eq!(result["not_posed"][0], "p0.png");
    assert_eq!((&result["models"][0], &result["models"][1]), (&3.into(), &1.into()));
    assert_eq!(result["mean_reprojection_error"], 0.5);
    assert_eq!(place.names("scene"), ["images", "import.json", "import.log", "sparse"]);
    assert_eq!(place.names("scene/sparse"), ["0"]);
    assert_eq!(place.names("."), ["bin", "photos", "scene"]);
    let found = place.run(&["inspect", "scene", "--json"]).done().json();
    assert_eq!(found["views"]["total"], 3);
    let log = fs::read_to_string(place.at("scene/import.log")).unwrap();
    assert!(log.contains("$ colmap mapper") && log.contains("Processed file [1/4]"), "{log}");
}

#[test]
fn the_result_says_what_to_do_next() {
    let place = Place::new();
    let ran = place.run(&["import", "photos", "--out", "my scene"]).done();
    for words in [
        "3 of 4 photographs posed",
        "not posed  p0.png",
        "0.50 pixels",
        "refraxel train 'my scene' --out run",
    ] {
        assert!(ran.out.contains(words), "{words}: {}", ran.out);
    }
    assert!(ran.err.contains("features started"), "{}", ran.err);
}

#[test]
fn features_on_glass_are_hidden_from_colmap_and_the_dataset_keeps_the_masks() {
    let place = Place::new();
    fs::create_dir(place.at("photos/masks")).unwrap();
    let glass = |x: u32, _| image::Luma([if x < 5 { 255 } else { 0 }]);
    for i in 0..3 {
        image::GrayImage::from_fn(16, 16, glass).save(place.at(&format!("photos/masks/p{i}.png"))).unwrap();
    }
    let result = place.run(&["import", "photos", "--out", "scene", "--json"]).done().json();
    assert_eq!((&result["masks"], &result["mask_meaning"]), (&2.into(), &"refractive".into()));
    assert_eq!(place.names("scene/glass_masks"), ["p0.png.png", "p1.png.png", "p2.png.png"]);
    assert_eq!(place.names("bin/seen_masks"), ["p0.png.png", "p1.png.png", "p2.png.png", "p3.png.png"]);
    let seen = |name: &str| stored_pixels(place.at("bin/seen_masks").join(name)).unwrap().into_luma8();
    assert_eq!((seen("p0.png.png").get_pixel(0, 0).0, seen("p0.png.png").get_pixel(9, 0).0), ([0], [255]));
    assert_eq!(seen("p3.png.png").get_pixel(0, 0).0, [255]);
    let found = place.run(&["inspect", "scene", "--json"]).done().json();
    assert_eq!(found["masks"]["meaning"], "refractive");
}

#[test]
fn masks_of_what_to_ignore_become_masks_of_what_to_use() {
    let place = Place::new();
    fs::create_dir(place.at("people")).unwrap();
    for i in 0..4 {
        let mask = image::GrayImage::from_fn(16, 16, |x, _| image::Luma([if x < 5 { 255 } else { 0 }]));
        mask.save(place.at(&format!("people/p{i}.png"))).unwrap();
    }
    let words =
        ["import", "photos", "--out", "scene", "--masks", "people", "--mask-meaning", "ignore", "--json"];
    let result = place.run(&words).done().json();
    assert!(result["next"].as_str().unwrap().contains("--mask-meaning keep"), "{result}");
    let stored = stored_pixels(place.at("scene/masks/p1.png.png")).unwrap().into_luma8();
    assert_eq!((stored.get_pixel(0, 0).0, stored.get_pixel(9, 0).0), ([0], [255]));
    let seen = stored_pixels(place.at("bin/seen_masks/p1.png.png")).unwrap().into_luma8();
    assert_eq!(seen, stored);
}

#[test]
fn photographs_of_several_sizes_get_a_camera_for_each_size() {
    let place = Place::new();
    write_image(&place.at("photos/wide.png"), 24, 16);
    place.run(&["import", "photos", "--out", "scene", "--dry-run"]).done();
    let ran = place.run(&["import", "photos", "--out", "scene", "--dry-run"]).done();
    assert!(ran.out.contains("single_camera_per_folder 1"), "{}", ran.out);
    assert!(ran.out.contains("cp photos/wide.png scene.importing/images/24x16/"), "{}", ran.out);
}

#[test]
fn a_dry_run_prints_commands_and_writes_nothing() {
    let place = Place::new();
    let ran = place.run(&["import", "photos", "--out", "scene", "--dry-run"]).done();
    let lines: Vec<&str> = ran.out.lines().collect();
    assert_eq!(lines[1], "cp photos/*.png scene.importing/images/");
    assert_eq!(lines[lines.len() - 1], "mv scene.importing scene");
    assert!(ran.out.contains("colmap exhaustive_matcher") && ran.out.contains("--SiftMatching.use_gpu 0"));
    assert_eq!(place.names("."), ["bin", "photos"]);
    assert!(!place.at("bin/calls").exists());
    // What it prints makes the same dataset.
    let status = place.shell(&ran.out);
    assert!(status, "{}", ran.out);
    assert_eq!(place.run(&["inspect", "scene", "--json"]).done().json()["views"]["total"], 3);
}

impl Place {
    fn shell(&self, script: &str) -> bool {
        let path = format!("{}:/usr/bin:/bin", self.at("bin").display());
        let mut shell = Command::new("sh");
        shell.args(["-ec", script]).current_dir(self.folder.path()).env("PATH", path);
        shell.stdout(Stdio::null()).status().unwrap().success()
    }
}

#[test]
fn without_colmap_the_message_has_the_installation_and_the_commands() {
    let place = Place::new();
    let words = ["COLMAP is not installed", "apt-get install colmap", "brew install colmap", "colmap mapper"];
    place.run_alone(&["import", "photos", "--out", "scene"]).refused(3, &words);
    fs::write(place.at("walk.mp4"), "x").unwrap();
    let words =
        ["COLMAP and ffmpeg are not installed", "install colmap ffmpeg", "$(ffprobe", "colmap mapper"];
    place.run_alone(&["import", "walk.mp4", "--out", "scene"]).refused(3, &words);
    assert_eq!(place.names("."), ["bin", "photos", "walk.mp4"]);
}

#[test]
fn a_tool_that_fails_shows_its_last_lines_and_the_same_command_goes_on() {
    let place = Place::new();
    fs::write(place.at("bin/mapper.fails"), "").unwrap();
    let import = ["import", "photos", "--out", "scene"];
    let words = [
        "colmap failed at the poses",
        "| no overlap at all",
        "scene.importing/import.log",
        "continues from there",
    ];
    place.run(&import).refused(3, &words);
    assert_eq!(place.names("."), ["bin", "photos", "scene.importing"]);
    fs::remove_file(place.at("bin/mapper.fails")).unwrap();
    let before = fs::read(place.at("scene.importing/features.db")).unwrap().len();
    let ran = place.run(&[&import[..], &["--threads", "1"]].concat()).done();
    assert!(ran.err.contains("continuing from the finished steps in scene.importing"), "{}", ran.err);
    assert!(before > 0);
    assert_eq!(place.names("."), ["bin", "photos", "scene"]);
}

#[test]
fn a_refinement_that_fails_leaves_the_poses_of_the_mapper() {
    let place = Place::new();
    fs::write(place.at("bin/bundle_adjuster.fails"), "").unwrap();
    let result = place.run(&["import", "photos", "--out", "scene", "--json"]).done().json();
    assert_eq!(result["posed"], 3);
    assert!(result["warnings"][0].as_str().unwrap().contains("principal point"), "{result}");
}

#[test]
fn too_few_posed_photographs_are_refused() {
    let place = Place::new();
    fs::remove_file(place.at("photos/p3.png")).unwrap();
    let words = ["COLMAP posed 2 photographs", "at least 3", "import.log"];
    place.run(&["import", "photos", "--out", "scene"]).refused(3, &words);
    assert!(!place.at("scene").exists());
}

#[test]
fn only_an_imported_dataset_is_replaced_and_only_when_asked() {
    let place = Place::new();
    let import = ["import", "photos", "--out", "scene"];
    place.run(&import).done();
    let before = place.calls();
    place.run(&import).refused(3, &["scene holds an imported dataset already", "--overwrite"]);
    assert_eq!(place.calls(), before);
    fs::write(place.at("bin/mapper.fails"), "").unwrap();
    let again = [&import[..], &["--overwrite"]].concat();
    place.run(&again).refused(3, &["failed"]);
    place.run(&["inspect", "scene"]).done();
    fs::remove_file(place.at("bin/mapper.fails")).unwrap();
    place.run(&again).done();
    place
        .run(&["import", "photos", "--out", "photos", "--overwrite"])
        .refused(3, &["no import wrote", "p0.png"]);
    assert_eq!(place.names("photos").len(), 4);
}

#[test]
fn an_interrupt_ends_the_tool_and_keeps_the_work() {
    let place = Place::new();
    fs::write(place.at("bin/exhaustive_matcher.hangs"), "").unwrap();
    let mut command = place.command(&["import", "photos", "--out", "scene"]);
    let mut child = command.stderr(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    while !fs::read_to_string(place.at("bin/calls")).unwrap_or_default().contains("exhaustive_matcher") {
        assert!(start.elapsed() < Duration::from_secs(30), "the matcher was not started");
        assert!(child.try_wait().unwrap().is_none(), "ended early");
        std::thread::sleep(Duration::from_millis(20));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let words = ["stopped while colmap was at work", "scene.importing"];
    Ran::of(child.wait_with_output().unwrap()).refused(130, &words);
    assert!(start.elapsed() < Duration::from_secs(50), "the hanging tool was waited for");
    assert!(place.at("scene.importing/features.db").exists());
}

#[test]
fn a_video_gives_the_sharpest_of_its_frames() {
    let place = Place::new();
    place.program("ffmpeg", FFMPEG);
    place.program("ffprobe", FFPROBE);
    write_image(&place.at("bin/frame.png"), 16, 16);
    stored_pixels(place.at("bin/frame.png")).unwrap().save(place.at("bin/frame.jpg")).unwrap();
    fs::write(place.at("walk.mp4"), "x").unwrap();
    let words = ["import", "walk.mp4", "--out", "scene", "--photographs", "4", "--json"];
    let result = place.run(&words).done().json();
    assert_eq!((&result["photographs"], &result["posed"]), (&4.into(), &3.into()));
    assert_eq!(place.names("scene/images").len(), 4);
    let calls = place.calls();
    assert!(calls.contains("fps=6.000000 -frames:v 12") && calls.contains("sequential_matcher"), "{calls}");
}

#[test]
fn plain_photographs_and_videos_are_told_how_to_get_poses() {
    let place = Place::new();
    let folder = place.at("my photos");
    fs::rename(place.at("photos"), &folder).unwrap();
    fs::write(place.at("walk.mp4"), "x").unwrap();
    let import = "refraxel import 'my photos' --out scene";
    for verb in [&["inspect", "my photos"][..], &["train", "my photos", "--out", "run"]] {
        place
            .run(verb)
            .refused(3, &["4 photographs without poses", import, "refraxel train scene --out run"]);
    }
    place.run(&["inspect", "walk.mp4"]).refused(3, &["a video", "refraxel import walk.mp4 --out scene"]);
    assert!(!place.at("run").exists());
}

#[test]
fn what_cannot_be_imported_is_refused() {
    let place = Place::new();
    let import =
        |source: &str, more: &[&str]| place.run(&[&["import", source, "--out", "scene"], more].concat());
    import("nowhere", &[]).refused(3, &["nowhere", "no such file or folder"]);
    fs::write(place.at("notes.txt"), "x").unwrap();
    import("notes.txt", &[]).refused(3, &["neither a folder of photographs nor a video"]);
    fs::create_dir(place.at("phone")).unwrap();
    fs::write(place.at("phone/a.HEIC"), "x").unwrap();
    import("phone", &[]).refused(3, &["a.HEIC", "heif-convert a.HEIC a.jpg"]);
    import("photos", &["--masks", "nowhere"]).refused(3, &["nowhere"]);
    import("photos", &["--masks", "phone"]).refused(3, &["no mask of any photograph", "p0.png"]);
    import("photos", &["--photographs", "9"]).refused(2, &["--photographs is for videos"]);
    fs::write(place.at("photos/p2.png"), "not an image").unwrap();
    import("photos", &[]).refused(3, &["p2.png", "cannot decode"]);
    place.run(&["import", "photos", "--out", ".."]).refused(3, &["no import wrote"]);
}

#[test]
fn photographs_with_an_orientation_tag_are_copied_upright() {
    let place = Place::new();
    for i in 0..4 {
        fs::remove_file(place.at(&format!("photos/p{i}.png"))).unwrap();
        write_turned(&place.at(&format!("photos/p{i}.jpg")));
    }
    place.run(&["import", "photos", "--out", "scene"]).done();
    let copy = stored_pixels(place.at("scene/images/p1.jpg")).unwrap().into_rgb8();
    assert_eq!(copy.dimensions(), (16, 24));
    // The stored left edge is red; turned by a quarter to the right it is the upper edge.
    let [red, _, blue] = copy.get_pixel(8, 1).0;
    assert!(red > 150 && blue < 100, "{red} {blue}");
}

/// A JPEG of 24 × 16 stored pixels, red on the left and blue on the right, to be turned by a quarter to the right.
fn write_turned(path: &Path) {
    use image::ImageEncoder;
    let pixel = |x: u32, _| image::Rgb(if x < 12 { [220, 10, 10] } else { [10, 10, 220] });
    let picture = image::RgbImage::from_fn(24, 16, pixel);
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 95);
    // TIFF header, one entry: tag 0x0112 (orientation), type SHORT, one value, 6.
    let tag = [0x12, 0x01, 3, 0, 1, 0, 0, 0, 6, 0, 0, 0];
    let exif = [&b"II*\0\x08\0\0\0\x01\0"[..], &tag, &[0; 4]].concat();
    encoder.set_exif_metadata(exif).unwrap();
    encoder.write_image(picture.as_raw(), 24, 16, image::ExtendedColorType::Rgb8).unwrap();
    fs::write(path, bytes).unwrap();
}
