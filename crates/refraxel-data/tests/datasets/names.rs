//! Files whose names are not those that are stated: what is meant beyond doubt is found and said, and nothing else is.

use crate::fixture::*;
use refraxel_data::{DataError, Dataset, OpenOptions};
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

/// A dataset of four views whose `file_path` is `stated(i)` and whose files are `there(i)`.
fn named(stated: impl Fn(usize) -> String, there: impl Fn(usize) -> String) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut value = transforms(&cameras(4));
    for i in 0..4 {
        value["frames"][i]["file_path"] = json!(stated(i));
        write_picture(folder.path(), &there(i));
    }
    write_file(folder.path(), "transforms.json", value.to_string());
    folder
}

/// Writes a PNG, whatever its extension says.
fn write_picture(folder: &Path, name: &str) {
    write_image(folder, "written.png", WIDTH, HEIGHT);
    let to = folder.join(name);
    std::fs::create_dir_all(to.parent().unwrap()).unwrap();
    std::fs::rename(folder.join("written.png"), to).unwrap();
}

/// A name that is stated, the name that is there, and how the note calls the difference.
const SPELLINGS: [(&str, &str, &str); 12] = [
    ("images/v#.png", "images/V#.PNG", "upper and lower case"),
    ("images/V#", "images/v#.jpg", "upper and lower case"),
    ("images/v#.png", "Images/v#.png", "upper and lower case"),
    ("images/v#.jpg", "images/v#.png", "the extension"),
    ("images/v#.HEIC", "images/v#.jpeg", "the extension"),
    ("images/v#.png", "images/v#.png.png", "the extension"),
    ("images/v#.png.png", "images/v#.png", "the extension"),
    ("images/a%20b#.png", "images/a b#.png", "URL encoding"),
    ("images/caf\u{e9}#.png", "images/cafe\u{301}#.png", "the Unicode form of accents"),
    ("/home/other/scene/images/v#.png", "images/v#.png", "the folders before it"),
    (r"C:\Users\me\scene\images\v#.png", "images/v#.PNG", "upper and lower case"),
    ("../scene/v#.png", "images/v#.png", "the folders before it"),
];

#[test]
fn files_that_are_spelled_otherwise_are_found_and_the_difference_is_said_once() {
    for (stated, there, difference) in SPELLINGS {
        let name = |pattern: &str, i: usize| pattern.replace('#', &i.to_string());
        let folder = named(|i| name(stated, i), |i| name(there, i));
        let data = open(&folder).unwrap_or_else(|error| panic!("{stated} for {there}: {error}"));
        assert_eq!((data.views.len(), warnings(&data).len()), (4, 0), "{stated}: {:?}", data.problems);
        let said = data.problems.iter().filter(|p| p.message.contains(difference)).count();
        assert_eq!(said, 1, "{stated}: {:?}", data.problems);
        assert!(reports(&data, "4 files differ from the names that are stated for them: 4 by"));
        assert_same_rays(&data.views.iter().map(|v| &v.camera).collect::<Vec<_>>(), &cameras(4));
    }
}

#[test]
fn reduced_copies_are_used_where_the_images_themselves_are_missing() {
    let folder = named(|i| format!("images/{}.png", stem(i)), |i| format!("images_4/{}.png", stem(i)));
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 4);
    assert_reports(&data, "the folders before it");
}

#[test]
fn photographs_that_lie_there_with_two_extensions_are_said_where_none_is_stated() {
    let two = |stated: fn(usize) -> String| {
        let folder = named(stated, |i| format!("images/v{i}.png"));
        (0..4).for_each(|i| write_picture(folder.path(), &format!("images/v{i}.jpg")));
        open(&folder).unwrap()
    };
    let data = two(|i| format!("images/v{i}"));
    let said = warnings(&data);
    assert!(said.len() == 1 && said[0].starts_with("4 photographs are stated without"), "{said:?}");
    assert!(said[0].contains("v0.png is used, not"), "{said:?}");
    assert!(warnings(&two(|i| format!("images/v{i}.jpg"))).is_empty());
}

#[test]
fn an_absolute_path_into_the_dataset_itself_is_no_difference() {
    let folder = transforms_folder(4, |_| {});
    let real = folder.path().canonicalize().unwrap();
    let mut value = transforms(&cameras(4));
    for i in 0..4 {
        value["frames"][i]["file_path"] = json!(real.join(format!("images/{}.png", stem(i))));
    }
    write_file(folder.path(), "transforms.json", value.to_string());
    assert!(open(&folder).unwrap().problems.is_empty());
}

#[test]
fn a_name_that_may_mean_two_files_is_missing_and_the_message_says_what_is_there() {
    let folder = named(|i| format!("images/v{i}.png"), |i| format!("images/V{i}.PNG"));
    (0..4).for_each(|i| write_picture(folder.path(), &format!("images/v{i}.Png")));
    let message = refusal(&folder);
    assert!(message.contains("none of the 4 images it names exists"), "{message}");
    assert!(message.contains("images holds V0.PNG, V1.PNG, V2.PNG and 5 more"), "{message}");
    let other = named(|i| format!("images/v{i}.png"), |i| format!("images/IMG_{i}.png"));
    assert!(refusal(&other).contains("images holds IMG_0.png, IMG_1.png, IMG_2.png and 1 more"));
}

#[test]
fn two_views_never_share_a_file_that_only_one_of_them_may_mean() {
    let stated = |i: usize| format!("/far/{}/v{}.png", ["a", "b", "a", "a"][i], [0, 0, 2, 3][i]);
    let folder = named(stated, |i| format!("images/v{}.png", [0, 1, 2, 3][i]));
    let message = refusal(&folder);
    assert!(message.contains("2 of 4 views cannot be used"), "{message}");
    assert!(
        message.contains("only the image of another view has a name like theirs: /far/a/v0.png"),
        "{message}"
    );
}

#[test]
fn a_mask_of_another_machine_is_found_in_its_folder_and_no_image_is_taken_for_it() {
    let with = |path: &str| {
        let path = path.to_owned();
        let folder = transforms_folder(4, move |t| t["frames"][0]["mask_path"] = json!(path));
        write_image(folder.path(), "masks/r_0.png", WIDTH, HEIGHT);
        folder
    };
    let data = open(&with("/home/other/scene/masks/r_0.png")).unwrap();
    assert!(data.views[0].has_mask() && reports(&data, "1 by the folders before it"), "{:?}", data.problems);
    let refused = open(&with("/home/other/alpha/r_0.png"));
    assert!(matches!(refused, Err(DataError::OutsideRoot { .. })), "{refused:?}");
}

#[test]
fn nothing_outside_the_folder_is_found_by_what_it_may_mean() {
    let folder = named(|i| format!("../v{i}.png"), |i| format!("elsewhere/v{i}.png"));
    let inner = folder.path().join("scene");
    std::fs::create_dir(&inner).unwrap();
    std::fs::rename(folder.path().join("transforms.json"), inner.join("transforms.json")).unwrap();
    (0..4).for_each(|i| write_picture(folder.path(), &format!("v{i}.png")));
    let refused = Dataset::open(&inner, &OpenOptions::default());
    assert!(matches!(refused, Err(DataError::OutsideRoot { .. })), "{refused:?}");
    let allowed = OpenOptions { allow_outside: true, ..OpenOptions::default() };
    assert_eq!(Dataset::open(&inner, &allowed).unwrap().views.len(), 4);
}

/// What systems put beside files.
fn litter(folder: &Path, images: &str) {
    for i in 0..6 {
        write_file(folder, &format!("{images}/._{}.png", stem(i)), "Mac OS X");
        write_file(folder, &format!("{images}/@eaDir/{}.png", stem(i)), "x");
    }
    for name in [".DS_Store", "Thumbs.db", "desktop.ini", "__MACOSX/._r_0.png"] {
        write_file(folder, &format!("{images}/{name}"), "x");
        write_file(folder, name, "x");
    }
}

#[test]
fn what_systems_leave_in_folders_is_no_photograph() {
    let pictures = |folder: &Path, images: &str| {
        (0..6).for_each(|i| write_image(folder, &format!("{images}/{}.png", stem(i)), WIDTH, HEIGHT));
        litter(folder, images);
    };
    let colmap = tempfile::tempdir().unwrap();
    write_colmap(colmap.path(), "sparse/0", "txt", colmap_text(&cameras(6)));
    pictures(colmap.path(), "images");
    let data = open(&colmap).unwrap();
    assert!(
        reports(&data, "6 of 6 images are registered") && warnings(&data).is_empty(),
        "{:?}",
        data.problems
    );
    let forward = tempfile::tempdir().unwrap();
    write_file(forward.path(), "poses_bounds.npy", llff(&cameras(6)));
    pictures(forward.path(), "images");
    let data = open(&forward).unwrap();
    assert!(data.views.len() == 6 && data.problems.is_empty(), "{:?}", data.problems);
    let nsvf = tempfile::tempdir().unwrap();
    for (i, camera) in cameras(6).iter().enumerate() {
        write_file(nsvf.path(), &format!("pose/{}.txt", stem(i)), nsvf_pose(camera));
        write_file(nsvf.path(), &format!("pose/._{}.txt", stem(i)), "Mac OS X");
    }
    write_file(nsvf.path(), "intrinsics.txt", "30 12 8 0.\n0. 0. 0.\n");
    pictures(nsvf.path(), "rgb");
    let data = open(&nsvf).unwrap();
    assert!(data.views.len() == 6 && data.problems.is_empty(), "{:?}", data.problems);
}

#[test]
fn frames_that_name_what_macos_puts_beside_images_are_no_views() {
    let folder = transforms_folder(4, |t| {
        let frames = t["frames"].as_array_mut().unwrap();
        for mut frame in frames.clone() {
            frame["file_path"] = json!(frame["file_path"].as_str().unwrap().replace("r_", "._r_"));
            frames.push(frame);
        }
    });
    litter(folder.path(), "images");
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 4);
    assert_reports(&data, "4 frames name what macOS puts beside images");
}

#[test]
fn an_image_of_another_machine_that_is_missing_is_left_out_where_others_are_found() {
    let folder = named(|i| format!("/far/scene/images/v{i}.png"), |i| format!("images/v{i}.png"));
    std::fs::remove_file(folder.path().join("images/v2.png")).unwrap();
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 3);
    assert!(reports(
        &data,
        "1 of 4 views are left out because their image does not exist: /far/scene/images/v2.png"
    ));
}

#[test]
fn descriptions_are_found_in_upper_and_lower_case() {
    let opened = |write: &dyn Fn(&Path)| {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path());
        (0..4).for_each(|i| write_image(folder.path(), &format!("images/{}.png", stem(i)), WIDTH, HEIGHT));
        open(&folder).unwrap().views.len()
    };
    let value: Value = transforms(&cameras(4));
    assert_eq!(opened(&|at| write_file(at, "TRANSFORMS.JSON", value.to_string())), 4);
    assert_eq!(opened(&|at| write_file(at, "Transforms_Train.json", value.to_string())), 4);
    assert_eq!(opened(&|at| write_file(at, "Poses_Bounds.NPY", llff(&cameras(4)))), 4);
    let [camera, images, points] = colmap_text(&cameras(4));
    let colmap = |at: &Path| {
        write_file(at, "Sparse/0/Cameras.txt", &camera);
        write_file(at, "Sparse/0/IMAGES.TXT", &images);
        write_file(at, "Sparse/0/Points3D.txt", &points);
    };
    assert_eq!(opened(&colmap), 4);
}

#[test]
fn colmap_names_are_matched_in_the_folder_that_holds_most_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let [camera, images, points] = colmap_text(&cameras(6));
    let images = images.replace("r_", "/data/me/IMAGES/R_").replace(".png", ".jpg");
    write_colmap(folder.path(), "sparse/0", "txt", [camera, images, points]);
    (0..6).for_each(|i| write_image(folder.path(), &format!("images_2/{}.png", stem(i)), WIDTH, HEIGHT));
    write_image(folder.path(), "input/r_0.png", WIDTH, HEIGHT);
    let data = open(&folder).unwrap();
    assert_eq!((data.views.len(), warnings(&data).len()), (6, 0), "{:?}", data.problems);
    assert_reports(&data, "6 by the extension");
}

#[test]
fn photographs_in_a_folder_for_each_camera_are_found_under_flat_names() {
    let of = |folders: [&str; 4]| {
        let folder = tempfile::tempdir().unwrap();
        write_colmap(folder.path(), "sparse/0", "txt", colmap_text(&cameras(4)));
        for (i, below) in folders.iter().enumerate() {
            write_image(folder.path(), &format!("images/{below}/{}.png", stem(i)), WIDTH, HEIGHT);
        }
        folder
    };
    let folder = of(["left", "left", "right", "right"]);
    let data = open(&folder).unwrap();
    assert_eq!((data.views.len(), warnings(&data).len()), (4, 0), "{:?}", data.problems);
    assert_reports(&data, "4 by the folders before it");
    write_image(folder.path(), "images/right/r_0.png", WIDTH, HEIGHT);
    assert_eq!(open(&folder).unwrap().views.len(), 3, "one of two that may be meant is none");
    assert!(open(&of(["masks"; 4])).is_err(), "masks are no photographs");
}
