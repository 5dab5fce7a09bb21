//! Cameras of other pictures than those that are there: what they state contradicts the photographs, and this is said.

use crate::fixture::*;
use image::{Rgb, RgbImage};
use refraxel_core::{Camera, Vec3};
use refraxel_data::{Dataset, OpenOptions};
use serde_json::{Value, json};
use std::path::Path;

const COUNT: usize = 14;

fn in_room(pixel: &Pixel, ball: Option<Vec3<f64>>) -> [u8; 3] {
    ball.map_or(wall(pixel.camera, pixel.x, pixel.y), texture)
}

fn warning<'a>(data: &'a Dataset, text: &str) -> Option<&'a str> {
    warnings(data).into_iter().find(|message| message.contains(text))
}

/// The focal length and principal point of the first view, with a file that states these and no size.
fn scaled(folder: &Path, [fx, cx, cy]: [f64; 3]) -> (Dataset, [f64; 2]) {
    let cameras = arc(COUNT);
    write_balls(folder, &cameras, "png", in_room);
    write_transforms(folder, &cameras, "png", |t| {
        let file = t.as_object_mut().unwrap();
        ["w", "h"].iter().for_each(|key| drop(file.remove(*key)));
        file.extend(
            [("fl_x", fx), ("fl_y", fx), ("cx", cx), ("cy", cy)].map(|(k, v)| (k.to_owned(), json!(v))),
        );
    });
    let data = Dataset::open(folder, &OpenOptions::default()).unwrap();
    let camera = data.views[0].camera;
    (data, [camera.focal[0], camera.center[0]])
}

#[test]
fn cameras_of_larger_pictures_without_a_size_are_scaled_by_their_principal_point() {
    let folder = tempfile::tempdir().unwrap();
    let half = f64::from(EDGE) / 2.0;
    let (data, found) = scaled(folder.path(), [46.0 * 4.0, 4.0 * half, 4.0 * half]);
    assert_eq!(found, [46.0, half]);
    assert!(warning(&data, "state no size of their pictures").is_some(), "{:?}", data.problems);
    let (data, found) = scaled(folder.path(), [46.0 / f64::from(EDGE), 0.5, 0.5]);
    assert_eq!(found.map(|v| v.round()), [46.0, half], "in parts of an edge: {:?}", data.problems);
    let (data, found) = scaled(folder.path(), [46.0, half + 2.0, half]);
    assert_eq!(found, [46.0, half + 2.0], "a principal point that is a little off");
    assert!(warning(&data, "size").is_none(), "{:?}", data.problems);
    for [cx, cy] in [[0.0, 0.0], [0.5, 0.5], [half, 0.2 * half]] {
        let (data, _) = scaled(folder.path(), [46.0, cx, cy]);
        assert!(warning(&data, "far from its middle").is_some(), "{cx} {cy}: {:?}", data.problems);
    }
    let (data, _) = scaled(folder.path(), [46.0, 3.0 * half, half]);
    assert!(warning(&data, "principal point outside").is_some(), "{:?}", data.problems);
    let (data, _) = scaled(folder.path(), [1.0, half, half]);
    assert!(warning(&data, "more than 150 degrees").is_some(), "{:?}", data.problems);
}

type Rows = [[f64; 4]; 4];

/// A textured ball in a room, in pictures in which patches can be compared, with rows of poses that are changed.
fn misread(rows: impl Fn(Rows) -> Rows) -> Dataset {
    const LARGE: u32 = 2 * EDGE;
    let folder = tempfile::tempdir().unwrap();
    let cameras: Vec<Camera> = arc(COUNT).iter().map(|c| c.resized(LARGE, LARGE)).collect();
    std::fs::create_dir(folder.path().join("images")).unwrap();
    for (i, camera) in cameras.iter().enumerate() {
        let at = |x, y| on_ball(camera, x, y).map_or_else(|| wall(camera, x, y), texture);
        let picture = RgbImage::from_fn(LARGE, LARGE, |x, y| Rgb(at(x, y)));
        picture.save(folder.path().join(format!("images/{}.png", stem(i)))).unwrap();
    }
    write_transforms(folder.path(), &cameras, "png", |t| {
        for frame in t["frames"].as_array_mut().unwrap() {
            let stated: Rows = serde_json::from_value(frame["transform_matrix"].take()).unwrap();
            frame["transform_matrix"] = json!(rows(stated));
        }
        let f = cameras[0].focal[0];
        let of = |(key, value): (&str, Value)| (key.to_owned(), value);
        let stated =
            [("w", json!(LARGE)), ("h", json!(LARGE)), ("fl_x", json!(f)), ("fl_y", json!(f))].map(of);
        t.as_object_mut().unwrap().extend(stated);
    });
    Dataset::open(folder.path(), &OpenOptions::default()).unwrap()
}

fn other_axes(rows: Rows) -> Rows {
    rows.map(|[x, y, z, t]| [x, -y, -z, t])
}

/// With the z axis of the world and that of the camera turned round.
fn left_handed([a, b, [x, y, z, t], last]: Rows) -> Rows {
    let row = |[x, y, z, t]: [f64; 4]| [x, y, -z, t];
    [row(a), row(b), row([-x, -y, -z, -t]), last]
}

fn inverse([a, b, c, last]: Rows) -> Rows {
    let row = |k: usize| [a[k], b[k], c[k], -(a[k] * a[3] + b[k] * b[3] + c[k] * c[3])];
    [row(0), row(1), row(2), last]
}

#[test]
fn poses_in_another_convention_are_named() {
    let as_it_is = misread(|rows| rows);
    assert!(warning(&as_it_is, "").is_none(), "{:?}", as_it_is.problems);
    for (rows, says) in [
        (other_axes as fn(Rows) -> Rows, "if the other camera axes are meant"),
        (inverse, "if the poses lead from world to camera ("),
        (|rows| inverse(other_axes(rows)), "if the poses lead from world to camera, with the axes of OpenCV"),
        (
            |[[a, b, c, x], [d, e, f, y], [g, h, i, z], last]| {
                [[a, d, g, x], [b, e, h, y], [c, f, i, z], last]
            },
            "if rotations are those from world to camera, and positions from camera to world",
        ),
        (|rows| rows.map(|[x, y, z, t]| [-x, y, -z, t]), "if camera axes are left, up and forward"),
        (left_handed, "if coordinates are left-handed, with camera axes right, up and forward"),
    ] {
        let data = misread(rows);
        assert!(warning(&data, says).is_some(), "{says}: {:?}", data.problems);
    }
}

#[test]
fn one_identity_far_from_all_other_poses_is_named() {
    let identity = json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);
    let folder = transforms_folder(40, |t| t["frames"][5]["transform_matrix"] = identity.clone());
    assert_warns(&open(&folder).unwrap(), "the pose of images/r_5.png is the identity");
    let relative_to_the_first = transforms_folder(8, |t| {
        for i in 0..8 {
            t["frames"][i]["transform_matrix"] = identity.clone();
            t["frames"][i]["transform_matrix"][0][3] = json!(0.3 * i as f64);
        }
    });
    assert!(!reports(&open(&relative_to_the_first).unwrap(), "the identity"));
}

#[test]
fn files_of_a_split_with_other_focal_lengths_are_named() {
    let folder = blender_folder([4, 3], 7);
    assert!(!reports(&open(&folder).unwrap(), "focal lengths are"));
    let path = folder.path().join("transforms_test.json");
    let mut test: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    (test["fl_x"], test["fl_y"]) = (json!(33.0), json!(33.0));
    write_file(folder.path(), "transforms_test.json", test.to_string());
    assert_reports(&open(&folder).unwrap(), "focal lengths are 1.250 of the width in");
}
