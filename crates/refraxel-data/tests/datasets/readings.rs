//! Poses in other conventions than those of their format, and cameras of other pictures: the photographs contradict them, and this is said.

use crate::fixture::*;
use image::RgbImage;
use refraxel_core::{Camera, Mat3, Pose};
use refraxel_data::{Dataset, Severity};
use serde_json::json;
use std::path::Path;
use tempfile::TempDir;

const COUNT: usize = 14;

/// Photographs of a ball in a room whose `transforms.json` states other cameras than those that took them.
fn stated(other: impl Fn(&Camera) -> Camera) -> TempDir {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(COUNT));
    write_balls(folder.path(), &cameras, "png", in_room);
    let others: Vec<Camera> = cameras.iter().map(other).collect();
    write_transforms(folder.path(), &others, "png", |t| {
        t["fl_x"] = json!(others[0].focal[0]);
        t["fl_y"] = json!(others[0].focal[1]);
    });
    folder
}

fn in_room(pixel: &Pixel, ball: Option<refraxel_core::Vec3<f64>>) -> [u8; 3] {
    ball.map_or(wall(pixel.camera, pixel.x, pixel.y), texture)
}

fn posed(camera: &Camera, pose: impl Fn(Pose) -> Pose) -> Camera {
    Camera { world_from_camera: pose(camera.world_from_camera), ..*camera }
}

fn axes(pose: Pose, [x, y, z]: [f64; 3]) -> Pose {
    let [right, down, forward] = pose.rotation.columns;
    Pose { rotation: Mat3 { columns: [right * x, down * y, forward * z] }, ..pose }
}

fn inverse(pose: Pose) -> Pose {
    let rotation = pose.rotation.transpose();
    Pose { rotation, translation: -(rotation * pose.translation) }
}

fn warning<'a>(data: &'a Dataset, text: &str) -> Option<&'a str> {
    let of = |p: &&refraxel_data::Problem| p.severity == Severity::Warning && p.message.contains(text);
    data.problems.iter().find(of).map(|p| p.message.as_str())
}

#[test]
fn poses_in_another_convention_are_named() {
    let right = open(&stated(|c| *c)).unwrap();
    assert!(warning(&right, "their cameras").is_none(), "{:?}", right.problems);
    let others: [(&str, fn(&Camera) -> Camera); 5] = [
        ("the other camera axes are meant", |c| posed(c, |p| axes(p, [1.0, -1.0, -1.0]))),
        ("turned by half a turn", |c| posed(c, |p| axes(p, [-1.0, -1.0, 1.0]))),
        ("the focal length is half", |c| Camera { focal: c.focal.map(|f| 2.0 * f), ..*c }),
        ("the focal length is twice", |c| Camera { focal: c.focal.map(|f| 0.5 * f), ..*c }),
        // What the file then states is the inverse of what it should, with the axes of its format.
        ("the poses lead from world to camera (", |c| {
            posed(c, |p| axes(inverse(axes(p, [1.0, -1.0, -1.0])), [1.0, -1.0, -1.0]))
        }),
    ];
    for (says, other) in others {
        let data = open(&stated(other)).unwrap();
        let said = warning(&data, "contradict their cameras")
            .unwrap_or_else(|| panic!("{says}: {:?}", data.problems));
        assert!(said.contains(says), "{says}: {said}");
    }
}

#[test]
fn quaternions_of_colmap_with_their_scalar_last_are_named() {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(COUNT));
    write_balls(folder.path(), &cameras, "png", in_room);
    let [mut calibration, images, points] = colmap_text(&cameras);
    let f = cameras[0].focal[0];
    calibration = calibration.lines().filter(|l| l.starts_with('#')).collect::<Vec<_>>().join("\n");
    calibration += &format!("\n7 PINHOLE {EDGE} {EDGE} {f} {f} {half} {half}\n", half = EDGE / 2);
    let line = |line: &str| match line.split(' ').collect::<Vec<_>>()[..] {
        [id, w, x, y, z, ref rest @ ..] if line.ends_with(".png") => {
            format!("{id} {x} {y} {z} {w} {}", rest.join(" "))
        }
        _ => line.to_owned(),
    };
    let images = images.lines().map(line).collect::<Vec<_>>().join("\n");
    write_colmap(folder.path(), "sparse/0", "txt", [calibration, images, points]);
    let data = open(&folder).unwrap();
    let said = warning(&data, "contradict their cameras").unwrap_or_else(|| panic!("{:?}", data.problems));
    assert!(said.contains("quaternions are (x, y, z, w)"), "{said}");
}

#[test]
fn photographs_under_the_names_of_others_are_doubted() {
    let folder = stated(|c| *c);
    let name = |i: usize| folder.path().join(format!("images/{}.png", stem(i)));
    let pictures: Vec<RgbImage> = (0..COUNT).map(|i| image::open(name(i)).unwrap().into_rgb8()).collect();
    (0..COUNT).for_each(|i| pictures[5 * i % COUNT].save(name(i)).unwrap());
    let data = open(&folder).unwrap();
    assert!(warning(&data, "poses may be those of other photographs").is_some(), "{:?}", data.problems);
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
    let data = refraxel_data::Dataset::open(folder, &refraxel_data::OpenOptions::default()).unwrap();
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
    let (data, found) = scaled(folder.path(), [46.0, half + 2.0, half]);
    assert_eq!(found, [46.0, half + 2.0], "a principal point that is a little off");
    assert!(warning(&data, "size").is_none(), "{:?}", data.problems);
    let (data, _) = scaled(folder.path(), [46.0, 3.0 * half, half]);
    assert!(warning(&data, "principal point outside").is_some(), "{:?}", data.problems);
    let (data, _) = scaled(folder.path(), [1.0, half, half]);
    assert!(warning(&data, "more than 150 degrees").is_some(), "{:?}", data.problems);
}
