//! Cameras of other pictures than those that are there: what they state contradicts the photographs, and this is said.

use crate::fixture::*;
use refraxel_core::Vec3;
use refraxel_data::{Dataset, OpenOptions, Problem, Severity};
use serde_json::json;
use std::path::Path;

const COUNT: usize = 14;

fn in_room(pixel: &Pixel, ball: Option<Vec3<f64>>) -> [u8; 3] {
    ball.map_or(wall(pixel.camera, pixel.x, pixel.y), texture)
}

fn warning<'a>(data: &'a Dataset, text: &str) -> Option<&'a str> {
    let of = |p: &&Problem| p.severity == Severity::Warning && p.message.contains(text);
    data.problems.iter().find(of).map(|p| p.message.as_str())
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
    let (data, found) = scaled(folder.path(), [46.0, half + 2.0, half]);
    assert_eq!(found, [46.0, half + 2.0], "a principal point that is a little off");
    assert!(warning(&data, "size").is_none(), "{:?}", data.problems);
    let (data, _) = scaled(folder.path(), [46.0, 3.0 * half, half]);
    assert!(warning(&data, "principal point outside").is_some(), "{:?}", data.problems);
    let (data, _) = scaled(folder.path(), [1.0, half, half]);
    assert!(warning(&data, "more than 150 degrees").is_some(), "{:?}", data.problems);
}
