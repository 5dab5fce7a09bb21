//! Photographs with an orientation tag (EXIF): poses that belong to the pixels as stored, and as the tag turns them.

use crate::fixture::*;
use image::codecs::jpeg::JpegEncoder;
use image::metadata::Orientation as Turn;
use image::{DynamicImage, GrayImage, Luma, Rgb, RgbImage};
use refraxel_core::{Camera, Vec3, vec3};
use refraxel_data::{
    Crop, DataError, Dataset, OpenOptions, Orientation, Photo, PhotoSource, Reduction, Severity,
    load_mask_of, load_photo, open_cameras,
};
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

const SQUARE: [u32; 2] = [32, 32];
const COUNT: usize = 4;

/// The colour of a table at z = 0.
fn table(at: Vec3<f64>) -> [u8; 3] {
    let wave = |a: f64| (128.0 + 110.0 * a.sin()) as u8;
    [wave(2.0 * at.x + 0.7), wave(1.5 * at.y - 2.0 * at.x), wave(2.5 * at.y + 1.1)]
}

/// Cameras around the table, which they see from above.
fn around(size: [u32; 2]) -> Vec<Camera> {
    let eye = |k: usize| {
        let angle = 0.9 * k as f64;
        vec3(1.2 * angle.cos() + 0.2, 1.2 * angle.sin(), 3.0 + 0.1 * k as f64)
    };
    let look = |k| Camera::look_at(eye(k), vec3(0.2, 0.1, 0.0), vec3(0.1, 1.0, 0.0), 0.8, size);
    (0..COUNT).map(look).collect()
}

/// What a camera sees of the table.
fn seen(camera: &Camera) -> RgbImage {
    RgbImage::from_fn(camera.width, camera.height, |x, y| {
        let ray = camera.ray(f64::from(x) + 0.5, f64::from(y) + 0.5).unwrap();
        Rgb(table(ray.origin - ray.direction * (ray.origin.z / ray.direction.z)))
    })
}

/// Where poses belong to upright pixels, the file holds them turned back.
fn stored(upright: RgbImage, tag: u8) -> RgbImage {
    let back = match tag {
        6 => Turn::Rotate270,
        8 => Turn::Rotate90,
        tag => Turn::from_exif(tag).unwrap(),
    };
    let mut image = DynamicImage::from(upright);
    image.apply_orientation(back);
    image.into_rgb8()
}

/// A JPEG with this orientation tag; 0: without tags.
fn jpeg(image: &RgbImage, tag: u8) -> Vec<u8> {
    let mut jpeg = Vec::new();
    image.write_with_encoder(JpegEncoder::new(&mut jpeg)).unwrap();
    if tag == 0 { jpeg } else { with_orientation(&jpeg, tag) }
}

/// What comes with the poses of a model.
#[derive(Clone, Copy, PartialEq)]
enum Points {
    None,
    Coloured,
    WithTracks,
}

/// A COLMAP model whose poses belong to `meant` pixels of images with this tag.
fn colmap(tag: u8, meant: Orientation, points: Points) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let (mut images, cameras) = (String::new(), around(SQUARE));
    for (k, camera) in cameras.iter().enumerate() {
        let ([w, x, y, z], t) = colmap_pose(camera);
        images += &format!("{} {w} {x} {y} {z} {} {} {} 1 v{k}.jpg\n\n", k + 1, t.x, t.y, t.z);
        let upright = seen(camera);
        let image = if meant == Orientation::Stored { upright } else { stored(upright, tag) };
        write_file(folder.path(), &format!("images/v{k}.jpg"), jpeg(&image, tag));
    }
    let ([f, _], mut lines) = (cameras[0].focal, String::new());
    for k in 0..if points == Points::None { 0 } else { 60 } {
        let at = vec3(0.2 * f64::from(k % 8) - 0.6, 0.2 * f64::from(k / 8) - 0.6, 0.0);
        let [r, g, b] = table(at);
        lines += &format!("{} {} {} {} {r} {g} {b} 0.5", k + 1, at.x, at.y, at.z);
        lines += if points == Points::WithTracks { " 1 0 2 0 3 0 4 0\n" } else { "\n" };
        // Something in front, which only another image shows.
        let hidden =
            format!("{} {} {} 1.0 {} {} {} 0.5 9 0\n", 100 + k, at.x, at.y, 255 - r, 255 - g, 255 - b);
        lines += if points == Points::WithTracks { &hidden } else { "" };
    }
    let model = [format!("1 PINHOLE 32 32 {f} {f} 16 16\n"), images, lines];
    write_colmap(folder.path(), "sparse/0", "txt", model);
    folder
}

/// A `transforms.json` of images of this stored size, changed by `edit`.
fn transforms_of(size: [u32; 2], tag: u8, meant: Orientation, edit: impl FnOnce(&mut Value)) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let is_turned = meant == Orientation::Upright && tag >= 5;
    let cameras = around(if is_turned { [size[1], size[0]] } else { size });
    let frame =
        |k: usize| json!({"file_path": format!("v{k}.jpg"), "transform_matrix": opengl_rows(&cameras[k])});
    let frames: Vec<Value> = (0..COUNT).map(frame).collect();
    let Camera { focal: [f, _], center: [x, y], .. } = cameras[0];
    let mut file =
        json!({"fl_x": f, "cx": x, "cy": y, "w": cameras[0].width, "h": cameras[0].height, "frames": frames});
    edit(&mut file);
    write_file(folder.path(), "transforms.json", file.to_string());
    for (k, camera) in cameras.iter().enumerate() {
        let upright = seen(camera);
        let image = if meant == Orientation::Stored { upright } else { stored(upright, tag) };
        write_file(folder.path(), &format!("v{k}.jpg"), jpeg(&image, tag));
    }
    folder
}

fn open(folder: &Path, orientation: Option<Orientation>) -> Dataset {
    Dataset::open(folder, &OpenOptions { orientation, ..OpenOptions::default() }).unwrap()
}

/// Mean difference between the photographs of a dataset and what their cameras see [0..255].
fn difference(data: &Dataset) -> f64 {
    let of = |k: usize| {
        let view = &data.views[k];
        let (photo, truth) = (load_photo(view).unwrap(), seen(&view.camera));
        let pixel = |p: usize| {
            let rgba = photo.image.rgba(p);
            (0..3)
                .map(|c| (f64::from(rgba[c]) * 255.0 - f64::from(truth.as_raw()[3 * p + c])).abs())
                .sum::<f64>()
        };
        (0..photo.image.len()).map(pixel).sum::<f64>() / (3 * photo.image.len()) as f64
    };
    (0..data.views.len()).map(of).sum::<f64>() / data.views.len() as f64
}

/// JPEG of smooth pictures stays below, a wrong orientation above.
const SAME: f64 = 8.0;

fn said(data: &Dataset) -> (Severity, String) {
    let about = |p: &&refraxel_data::Problem| p.message.contains("EXIF orientation");
    let problem = data.problems.iter().find(about).expect("the tags are spoken of");
    (problem.severity, problem.message.clone())
}

#[test]
fn poses_of_colmap_belong_to_stored_pixels_where_nothing_else_tells() {
    for tag in 2..=8 {
        let folder = colmap(tag, Orientation::Stored, Points::None);
        let data = open(folder.path(), None);
        assert!(difference(&data) < SAME, "tag {tag}: {}", difference(&data));
        let (severity, message) = said(&data);
        assert_eq!(severity, Severity::Note);
        assert!(message.contains("4 of 4 images") && message.contains("--orientation upright"), "{message}");
        let otherwise = open(folder.path(), Some(Orientation::Upright));
        assert!(difference(&otherwise) > SAME, "tag {tag}");
    }
    let untagged = open(colmap(0, Orientation::Stored, Points::None).path(), None);
    assert!(untagged.problems.iter().all(|p| !p.message.contains("EXIF")));
}

#[test]
fn colours_of_points_tell_which_pixels_are_meant() {
    for (tag, meant) in [
        (3, Orientation::Stored),
        (3, Orientation::Upright),
        (6, Orientation::Upright),
        (7, Orientation::Upright),
    ] {
        for points in [Points::Coloured, Points::WithTracks] {
            let folder = colmap(tag, meant, points);
            let data = open(folder.path(), None);
            assert!(difference(&data) < SAME, "tag {tag}, {meant:?}: {}", difference(&data));
            assert!(said(&data).1.contains("points of the scene"), "{:?}", said(&data));
        }
    }
}

#[test]
fn coloured_points_of_a_ply_file_tell_it_too() {
    let with_points = |file: &mut Value| file["ply_file_path"] = json!("points.ply");
    let folder = transforms_of(SQUARE, 3, Orientation::Upright, with_points);
    let mut ply =
        "ply\nformat ascii 1.0\nelement vertex 60\nproperty float x\nproperty float y\nproperty float z\n\
                   property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
            .to_owned();
    for k in 0..60 {
        let at = vec3(0.2 * f64::from(k % 8) - 0.6, 0.2 * f64::from(k / 8) - 0.6, 0.0);
        let [r, g, b] = table(at);
        ply += &format!("{} {} 0 {r} {g} {b}\n", at.x, at.y);
    }
    write_file(folder.path(), "points.ply", ply);
    let data = open(folder.path(), None);
    assert!(difference(&data) < SAME && said(&data).1.contains("points of the scene"), "{:?}", said(&data));
}

#[test]
fn the_shape_that_cameras_state_tells_before_everything_else() {
    for tag in [6, 8] {
        for meant in [Orientation::Stored, Orientation::Upright] {
            let folder = transforms_of([32, 24], tag, meant, |_| {});
            let data = open(folder.path(), None);
            assert!(difference(&data) < SAME, "tag {tag}, {meant:?}: {}", difference(&data));
            assert_eq!(said(&data).0, Severity::Note);
            let cameras = open_cameras(folder.path(), &OpenOptions::default()).unwrap();
            assert!(cameras.iter().zip(&data.views).all(|(c, v)| c.camera == v.camera));
        }
    }
    let without_size = |file: &mut Value| {
        file.as_object_mut().unwrap().retain(|key, _| key != "w" && key != "h");
    };
    for meant in [Orientation::Stored, Orientation::Upright] {
        let folder = transforms_of([32, 24], 6, meant, without_size);
        let data = open(folder.path(), None);
        assert!(difference(&data) < SAME, "the principal point states the shape of {meant:?}");
    }
}

#[test]
fn what_nothing_tells_is_doubted_aloud_and_can_be_said() {
    let folder = transforms_of(SQUARE, 3, Orientation::Upright, |_| {});
    let doubted = open(folder.path(), None);
    let (severity, message) = said(&doubted);
    assert!(severity == Severity::Warning && message.contains("--orientation upright"), "{message}");
    let told = open(folder.path(), Some(Orientation::Upright));
    assert!(difference(&told) < SAME && said(&told).0 == Severity::Note);
}

#[test]
fn images_without_a_tag_among_others_stay() {
    let folder = colmap(3, Orientation::Stored, Points::None);
    let cameras = around(SQUARE);
    write_file(folder.path(), "images/v2.jpg", jpeg(&seen(&cameras[2]), 0));
    let data = open(folder.path(), None);
    assert!(difference(&data) < SAME && said(&data).1.contains("3 of 4 images"));
}

#[test]
fn one_photograph_with_a_tag_is_compared_with_its_neighbours() {
    const ONE: usize = 4;
    for meant in [Orientation::Stored, Orientation::Upright] {
        let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(10));
        write_transforms(folder.path(), &cameras, "jpg", |_| {});
        for (k, camera) in cameras.iter().enumerate() {
            let at = |x, y| Rgb(on_ball(camera, x, y).map_or_else(|| wall(camera, x, y), texture));
            let upright = RgbImage::from_fn(EDGE, EDGE, at);
            let is_turned = k == ONE && meant == Orientation::Upright;
            let pixels = if is_turned { stored(upright, 3) } else { upright };
            let tag = if k == ONE { 3 } else { 0 };
            write_file(folder.path(), &format!("images/{}.jpg", stem(k)), jpeg(&pixels, tag));
        }
        let data = open(folder.path(), None);
        let PhotoSource::Files { orientation, .. } = &data.views[ONE].source else { panic!("of files") };
        assert_eq!(*orientation, meant, "{:?}", data.problems);
        assert!(said(&data).1.contains("neighbouring photographs"), "{:?}", data.problems);
    }
}

#[test]
fn masks_are_turned_as_their_photographs() {
    // White on the left third of what poses mean.
    let white = |w: u32, h: u32| GrayImage::from_fn(w, h, |x, _| Luma([if 3 * x < w { 255 } else { 0 }]));
    for meant in [Orientation::Stored, Orientation::Upright] {
        let folder = transforms_of([32, 24], 6, meant, |_| {});
        let [w, h] = if meant == Orientation::Stored { [32, 24] } else { [24, 32] };
        // The one belongs to the pixels that are meant, the other to those of the other orientation.
        let mut other = DynamicImage::from(white(w, h));
        other.apply_orientation(if meant == Orientation::Stored { Turn::Rotate90 } else { Turn::Rotate270 });
        white(w, h).save(folder.path().join("v0_mask.png")).unwrap();
        other.into_luma8().save(folder.path().join("v1_mask.png")).unwrap();
        let data = open(folder.path(), None);
        for view in &data.views[..2] {
            let mask = load_mask_of(view).unwrap().unwrap();
            assert_eq!(
                (mask.width, mask.height, &mask.coverage),
                (w, h, &white(w, h).into_raw()),
                "{meant:?}"
            );
            assert_eq!(load_photo(view).unwrap().mask.unwrap(), mask);
        }
    }
    let folder = transforms_of([32, 24], 6, Orientation::Stored, |_| {});
    white(30, 24).save(folder.path().join("v0_mask.png")).unwrap();
    let refused = Dataset::open(folder.path(), &OpenOptions::default());
    assert!(matches!(refused, Err(DataError::MaskSize { .. })), "{refused:?}");
}

#[test]
fn masks_whose_shape_does_not_tell_whether_they_were_turned_are_doubted() {
    for (size, is_open) in [([32, 32], true), ([32, 24], false)] {
        let folder = transforms_of(size, 6, Orientation::Stored, |_| {});
        GrayImage::new(size[0], size[1]).save(folder.path().join("v0_mask.png")).unwrap();
        let doubts = |data: &Dataset| data.problems.iter().any(|p| p.message.contains("fits either way"));
        assert_eq!(doubts(&open(folder.path(), None)), is_open, "{size:?}");
    }
}

#[test]
fn views_that_are_cut_and_reduced_are_oriented_as_whole_ones() {
    let folder = colmap(6, Orientation::Stored, Points::None);
    let mut small = open(folder.path(), None);
    let whole: Vec<Photo> = small.views.iter().map(|v| load_photo(v).unwrap()).collect();
    small.reduce(&[0, 1, 2, 3], Reduction::Divide(2));
    let crop = Crop { left: 8, top: 2, right: 0, bottom: 0 };
    let cut = Dataset::open(folder.path(), &OpenOptions { crop, ..OpenOptions::default() }).unwrap();
    for (k, photo) in whole.iter().enumerate() {
        assert_eq!(load_photo(&small.views[k]).unwrap(), photo.reduced([16, 16]));
        let part = load_photo(&cut.views[k]).unwrap();
        assert_eq!(part.image.rgba(0), photo.image.rgba(2 * 32 + 8));
    }
}
