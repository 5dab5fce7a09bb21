//! The same cameras, written in every format, give the same rays; and what each format states beside them is read.

use crate::fixture::*;
use refraxel_core::{Camera, vec3};
use refraxel_data::{Backdrop, DataError, Dataset, Format, OpenOptions, scene_region};
use serde_json::json;
use std::path::Path;

fn opened(folder: &Path) -> Dataset {
    Dataset::open(folder, &OpenOptions::default()).unwrap()
}

/// Cameras in the order of the image names' numbers.
fn by_number(data: &Dataset) -> Vec<&Camera> {
    let mut views: Vec<_> = data.views.iter().collect();
    views.sort_by_key(|v| v.name.trim_start_matches("r_").trim_end_matches(".png").parse::<usize>().unwrap());
    views.iter().map(|v| &v.camera).collect()
}

#[test]
fn transforms_json_gives_the_cameras_that_wrote_it() {
    let data = open(&transforms_folder(11, |_| {})).unwrap();
    assert_eq!((data.format, data.backdrop), (Format::Transforms, Backdrop::Surroundings));
    assert_same_rays(&by_number(&data), &cameras(11));
}

#[test]
fn blender_files_give_the_cameras_that_wrote_them_and_their_split() {
    let folder = tempfile::tempdir().unwrap();
    let all = cameras(8);
    let angle = 2.0 * (f64::from(WIDTH) / 2.0 / FOCAL).atan();
    for (part, range) in [("train", 0..5), ("test", 5..8)] {
        let frames: Vec<_> = range
            .clone()
            .map(|i| json!({"file_path": format!("./{part}/{}", stem(i)), "rotation": 0.1, "transform_matrix": opengl_rows(&all[i])}))
            .collect();
        let file = json!({"camera_angle_x": angle, "frames": frames});
        write_file(folder.path(), &format!("transforms_{part}.json"), file.to_string());
        range.for_each(|i| write_image(folder.path(), &format!("{part}/{}.png", stem(i)), WIDTH, HEIGHT));
    }
    let data = opened(folder.path());
    assert_same_rays(&by_number(&data), &all);
    assert_eq!((data.split.train.len(), data.split.test.clone()), (5, vec![5, 6, 7]));
    assert_eq!(data.backdrop, Backdrop::Color([1.0; 3]), "rendered RGB stands before white");
}

#[test]
fn colmap_text_and_binary_give_the_same_cameras_in_every_layout() {
    let all = cameras(9);
    for (model, binary) in [
        ("sparse/0", true),
        ("colmap/sparse/0", false),
        ("sparse", true),
        (".", false),
        ("sparse/aligned", true),
    ] {
        let folder = tempfile::tempdir().unwrap();
        match binary {
            true => write_colmap(folder.path(), model, "bin", colmap_binary(&all)),
            false => write_colmap(folder.path(), model, "txt", colmap_text(&all)),
        }
        (0..9).for_each(|i| write_image(folder.path(), &format!("images/{}.png", stem(i)), WIDTH, HEIGHT));
        write_image(folder.path(), "images/unregistered.png", WIDTH, HEIGHT);
        let data = opened(folder.path());
        assert_eq!(data.format, Format::Colmap);
        assert_same_rays(&by_number(&data), &all);
        assert_eq!(data.points[0], vec3(0.1, 0.2, 0.3));
        assert_reports(&data, "9 of 10 images are registered");
        assert_same_rays(&by_number(&opened(&folder.path().join(model))), &all);
    }
}

#[test]
fn a_colmap_model_may_lie_in_a_dataset_that_lies_in_a_folder_called_sparse() {
    let (all, folder) = (cameras(9), tempfile::tempdir().unwrap());
    let scene = folder.path().join("sparse/scene");
    write_colmap(&scene, "sparse/0", "bin", colmap_binary(&all));
    (0..9).for_each(|i| write_image(&scene, &format!("input/{}.png", stem(i)), WIDTH, HEIGHT));
    for given in [scene.clone(), scene.join("sparse/0")] {
        assert_same_rays(&by_number(&opened(&given)), &all);
    }
}

#[test]
fn the_colmap_model_with_most_images_is_used_and_said_so() {
    let folder = tempfile::tempdir().unwrap();
    write_colmap(folder.path(), "sparse/0", "txt", colmap_text(&cameras(3)));
    write_colmap(folder.path(), "sparse/1", "bin", colmap_binary(&cameras(6)));
    (0..6).for_each(|i| write_image(folder.path(), &format!("input/{}.png", stem(i)), WIDTH, HEIGHT));
    let data = opened(folder.path());
    assert_eq!(data.views.len(), 6);
    assert!(reports(&data, "COLMAP made several models"));
}

#[test]
fn colmap_names_may_have_spaces_and_folders_and_clashing_names_stay_apart() {
    let folder = tempfile::tempdir().unwrap();
    let [camera, images, points] = colmap_text(&cameras(4));
    let images = images.replace("r_1.png", "s left/a.png").replace("r_2.png", "s right/a.png");
    write_colmap(folder.path(), "sparse/0", "txt", [camera, images, points]);
    for name in ["r_0.png", "s left/a.png", "s right/a.png", "r_3.png"] {
        write_image(folder.path(), &format!("images/{name}"), WIDTH, HEIGHT);
    }
    let data = opened(folder.path());
    let names: Vec<&str> = data.views.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["r_0.png", "s left_a.png", "s right_a.png", "r_3.png"]);
}

#[test]
fn llff_gives_the_cameras_that_wrote_it_and_its_depth_bounds() {
    let folder = tempfile::tempdir().unwrap();
    write_file(folder.path(), "poses_bounds.npy", llff(&cameras(9)));
    (0..9).for_each(|i| write_image(folder.path(), &format!("images/{}.png", stem(i)), WIDTH, HEIGHT));
    let data = opened(folder.path());
    assert_same_rays(&by_number(&data), &cameras(9));
    assert_eq!((data.format, data.depth_range), (Format::Llff, Some([1.5, 6.0])));
    write_image(folder.path(), "images/extra.png", WIDTH, HEIGHT);
    let message = Dataset::open(folder.path(), &OpenOptions::default()).unwrap_err().to_string();
    assert!(message.contains("9, but images holds 10 images"), "{message}");
}

#[test]
fn nsvf_gives_the_cameras_that_wrote_it_its_box_and_its_prefix_split() {
    let folder = tempfile::tempdir().unwrap();
    let all = cameras(6);
    for (i, camera) in all.iter().enumerate() {
        write_file(folder.path(), &format!("pose/{}_{i}.txt", i / 2), nsvf_pose(camera));
        write_image(folder.path(), &format!("rgb/{}_{i}.png", i / 2), WIDTH, HEIGHT);
    }
    write_file(folder.path(), "intrinsics.txt", format!("{FOCAL} 12.0 8.0 0.\n0. 0. 0.\n0.\n1.\n16 24\n"));
    write_file(folder.path(), "bbox.txt", "-1 -1 -0.5 1 1 0.5 0.1\n");
    let data = opened(folder.path());
    let found: Vec<&Camera> = data.views.iter().map(|v| &v.camera).collect();
    assert_same_rays(&found, &all);
    assert_eq!(
        (&data.split.train, &data.split.val, &data.split.test),
        (&vec![0, 1], &vec![2, 3], &vec![4, 5])
    );
    assert_eq!(data.backdrop, Backdrop::Color([1.0; 3]));
    assert_eq!(scene_region(&data).bounds, data.stated_box.unwrap());
    let matrix = format!("{FOCAL} 0 12 0\n0 {FOCAL} 8 0\n0 0 1 0\n0 0 0 1\n");
    write_file(folder.path(), "intrinsics.txt", matrix);
    assert_same_rays(&[&opened(folder.path()).views[0].camera], &all[..1]);
}

#[test]
fn one_prefix_of_nsvf_alone_is_no_split() {
    let folder = tempfile::tempdir().unwrap();
    for (i, camera) in cameras(10).iter().enumerate() {
        write_image(folder.path(), &format!("rgb/0_{i:04}.png"), WIDTH, HEIGHT);
        write_file(folder.path(), &format!("pose/0_{i:04}.txt"), nsvf_pose(camera));
    }
    write_file(folder.path(), "intrinsics.txt", "30 12 8 0.\n");
    assert!(!opened(folder.path()).split.test.is_empty());
}

#[test]
fn scannet_has_the_poses_of_nsvf_beside_other_folders() {
    let (folder, all) = (tempfile::tempdir().unwrap(), cameras(4));
    for (i, camera) in all.iter().enumerate() {
        write_image(folder.path(), &format!("color/{i}.jpg.png"), WIDTH, HEIGHT);
        write_image(folder.path(), &format!("depth/{i}.png"), WIDTH / 2, HEIGHT / 2);
        write_file(folder.path(), &format!("pose/{i}.txt"), nsvf_pose(camera));
    }
    let matrix = format!("{FOCAL} 0 12 0\n0 {FOCAL} 8 0\n0 0 1 0\n0 0 0 1\n");
    write_file(folder.path(), "intrinsic/intrinsic_color.txt", matrix);
    let cameras: Vec<_> = opened(folder.path()).views.into_iter().map(|view| view.camera).collect();
    assert_same_rays(&cameras.iter().collect::<Vec<_>>(), &all);
}

#[test]
fn a_folder_without_a_dataset_says_what_was_looked_for() {
    let folder = tempfile::tempdir().unwrap();
    assert!(refusal(&folder).contains("transforms.json"));
    let absent = folder.path().join("absent");
    assert!(matches!(Dataset::open(absent, &OpenOptions::default()), Err(DataError::NotFound { .. })));
    let scrap = folder.path().join("notes.md");
    std::fs::write(&scrap, "hello").unwrap();
    assert!(matches!(Dataset::open(scrap, &OpenOptions::default()), Err(DataError::UnknownFormat { .. })));
}

#[test]
fn matrices_of_neus_are_named_with_the_way_to_convert_them() {
    let folder = tempfile::tempdir().unwrap();
    write_file(folder.path(), "cameras_sphere.npz", "PK");
    write_image(folder.path(), "image/000000.png", WIDTH, HEIGHT);
    let refused = refusal(&folder);
    assert!(refused.contains("cameras_sphere.npz") && refused.contains("transforms.json"), "{refused}");
}
