//! Files of which only a part can be used: the part is used, what is lost is counted and named, and half is too much.

use crate::fixture::*;
use refraxel_data::Severity;
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

fn pictures(folder: &Path, count: usize) {
    (0..count).for_each(|i| write_image(folder, &format!("images/{}.png", stem(i)), WIDTH, HEIGHT));
}

/// A model of COLMAP whose text files were changed.
fn colmap(count: usize, edit: impl FnOnce(&mut [String; 3])) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut files = colmap_text(&cameras(count));
    edit(&mut files);
    write_colmap(folder.path(), "sparse/0", "txt", files);
    pictures(folder.path(), count);
    folder
}

#[test]
fn images_txt_is_read_with_all_some_or_none_of_its_lines_of_observations() {
    let is_image = |line: &&str| line.ends_with(".png");
    let forms: [(&str, fn(&str) -> String); 5] = [
        ("images only", |text| text.lines().filter(|l| l.ends_with(".png")).collect::<Vec<_>>().join("\n")),
        ("blank lines dropped", |text| text.lines().filter(|l| !l.is_empty()).collect::<Vec<_>>().join("\n")),
        ("a blank line more behind each", |text| text.replace('\n', "\n\n")),
        ("Windows", |text| format!("\u{feff}{}", text.replace('\n', "\r\n"))),
        ("comments between", |text| text.replace(".png\n", ".png\n# observations\n")),
    ];
    for (name, form) in forms {
        let folder = colmap(6, |[_, images, _]| {
            assert_eq!(images.lines().filter(is_image).count(), 6);
            *images = form(images);
        });
        let data = open(&folder).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_same_rays(&data.views.iter().map(|v| &v.camera).collect::<Vec<_>>(), &cameras(6));
        assert!(data.problems.iter().all(|p| p.severity == Severity::Note), "{name}: {:?}", data.problems);
    }
}

#[test]
fn images_whose_names_are_numbers_are_told_from_observations() {
    let folder = colmap(4, |[_, images, _]| {
        *images = images.lines().filter(|l| l.contains("png")).collect::<Vec<_>>().join("\n");
        (0..4).for_each(|i| *images = images.replace(&format!("r_{i}.png"), &format!("000{i}")));
    });
    (0..4).for_each(|i| write_image(folder.path(), &format!("images/000{i}.png"), WIDTH, HEIGHT));
    assert_eq!(open(&folder).unwrap().views.len(), 4);
}

#[test]
fn a_damaged_line_of_images_txt_is_named_and_not_taken_for_observations() {
    let folder = colmap(4, |[_, images, _]| {
        *images = images.lines().filter(|l| l.contains("png")).collect::<Vec<_>>().join("\n");
        *images = images.replacen("2 ", "2 x", 1).replacen("\n2", "\nx", 1);
    });
    assert!(refusal(&folder).contains("IMAGE_ID QW QX QY QZ"), "{}", refusal(&folder));
}

#[test]
fn a_head_that_states_another_number_of_images_is_a_warning() {
    let with = |count: usize| {
        colmap(6, |[_, images, _]| {
            images.insert_str(0, &format!("# Number of images: {count}, mean observations per image: 9.5\n"));
        })
    };
    assert!(!reports(&open(&with(6)).unwrap(), "its head states"));
    assert!(warns(&open(&with(12)).unwrap(), "its head states 12 images, but it lists 6"));
}

#[test]
fn images_of_a_model_whose_position_is_no_number_are_left_out() {
    let folder = colmap(6, |[_, images, _]| {
        let mut lines: Vec<String> = images.lines().map(str::to_owned).collect();
        let line = lines.iter_mut().find(|line| line.ends_with("r_2.png")).unwrap();
        let mut fields: Vec<&str> = line.split(' ').collect();
        fields[6] = "nan";
        *line = fields.join(" ");
        *images = lines.join("\n");
    });
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 5);
    assert!(warns(&data, "1 of 6 views are left out") && warns(&data, "r_2.png"), "{:?}", data.problems);
}

#[test]
fn only_cameras_that_images_use_have_to_make_sense() {
    for unused in
        ["8 NEW_MODEL 24 16 1 2 3", "8 PINHOLE 24 16 nan nan nan nan", "8 PINHOLE 24 sixteen 30 30", "what?"]
    {
        let data = open(&colmap(4, |[cameras, ..]| *cameras += unused)).unwrap();
        assert_eq!(data.views.len(), 4, "{unused}");
    }
    let used = colmap(4, |[cameras, ..]| *cameras = cameras.replace("PINHOLE", "NEW_MODEL"));
    assert!(refusal(&used).contains("unsupported camera model NEW_MODEL"));
    let damaged = colmap(4, |[cameras, ..]| *cameras = cameras.replace(" 16 ", " sixteen "));
    assert!(refusal(&damaged).contains("sixteen"), "{}", refusal(&damaged));
}

#[test]
fn unused_cameras_of_a_binary_model_may_be_of_unknown_models() {
    let binary = |model: i32, is_first: bool| {
        let folder = tempfile::tempdir().unwrap();
        let [mut camera, images, points] = colmap_binary(&cameras(4));
        let mut other = 8_u32.to_le_bytes().to_vec();
        other.extend(model.to_le_bytes());
        other.extend([24_u64, 16].iter().flat_map(|v| v.to_le_bytes()));
        other.extend([f64::NAN; 4].iter().flat_map(|v| v.to_le_bytes()));
        let at = if is_first { 8 } else { camera.len() };
        camera.splice(at..at, other);
        camera[0] = 2;
        write_colmap(folder.path(), "sparse/0", "bin", [camera, images, points]);
        pictures(folder.path(), 4);
        open(&folder).map(|data| data.views.len()).map_err(|error| error.to_string())
    };
    assert_eq!((binary(1, true), binary(1, false), binary(99, false)), (Ok(4), Ok(4), Ok(4)));
    assert!(binary(99, true).unwrap_err().contains("unsupported camera model number 99"));
}

#[test]
fn images_behind_the_stated_number_are_read_too() {
    let folder = tempfile::tempdir().unwrap();
    let [camera, mut images, points] = colmap_binary(&cameras(6));
    images[0] = 3;
    write_colmap(folder.path(), "sparse/0", "bin", [camera, images, points]);
    pictures(folder.path(), 6);
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 6);
    assert!(warns(&data, "it states 3 images") && warns(&data, "which hold 3 more"), "{:?}", data.problems);
}

#[test]
fn points_that_cannot_be_read_are_a_warning() {
    let data = open(&colmap(4, |[.., points]| *points = "1 0.1 zero 0.3".into())).unwrap();
    assert!(data.points.is_empty() && warns(&data, "the points are not used"), "{:?}", data.problems);
}

#[test]
fn a_model_that_cannot_be_read_does_not_hide_another() {
    let folder = colmap(4, |_| {});
    write_colmap(folder.path(), "sparse/1", "txt", ["", "broken", ""]);
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 4);
    assert_warns(&data, "one of the models of COLMAP is not used");
}

#[test]
fn images_listed_again_with_the_same_camera_are_used_once() {
    let folder = colmap(4, |[_, images, _]| {
        let again = images.clone();
        *images += &again;
    });
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 4);
    assert!(warns(&data, "4 frames state a view again, with the same camera, and are used once: r_0.png"));
}

#[test]
fn llff_takes_the_folder_that_holds_as_many_images_as_there_are_poses() {
    let folder = tempfile::tempdir().unwrap();
    write_file(folder.path(), "poses_bounds.npy", llff(&cameras(6)));
    pictures(folder.path(), 9);
    (0..6).for_each(|i| {
        write_image(folder.path(), &format!("images_4/{}.png", stem(i)), WIDTH / 2, HEIGHT / 2)
    });
    (0..9).for_each(|i| {
        write_image(folder.path(), &format!("images_8/{}.png", stem(i)), WIDTH / 4, HEIGHT / 4)
    });
    let data = open(&folder).unwrap();
    assert_eq!((data.views.len(), data.views[0].camera.width), (6, WIDTH / 2));
    assert_warns(&data, "images holds 9 images for 6 poses; those of images_4");
    std::fs::remove_dir_all(folder.path().join("images_4")).unwrap();
    let message = refusal(&folder);
    assert!(message.contains("6, but images holds 9 images, images_8 holds 9 images"), "{message}");
}

#[test]
fn masks_beside_the_photographs_of_llff_are_no_photographs() {
    let folder = tempfile::tempdir().unwrap();
    write_file(folder.path(), "poses_bounds.npy", llff(&cameras(4)));
    pictures(folder.path(), 4);
    (0..4).for_each(|i| write_image(folder.path(), &format!("images/{}_mask.png", stem(i)), WIDTH, HEIGHT));
    assert_eq!(open(&folder).unwrap().views.len(), 4);
}

#[test]
fn frames_that_were_not_posed_are_left_out_and_half_of_them_is_an_error() {
    let unposed = |count: usize| {
        transforms_folder(7, move |t| {
            for i in 0..count {
                let frame = &mut t["frames"][i];
                match i % 4 {
                    0 => frame["transform_matrix"] = Value::Null,
                    1 => drop(frame.as_object_mut().unwrap().remove("file_path")),
                    2 => drop(frame.as_object_mut().unwrap().remove("transform_matrix")),
                    _ => frame["transform_matrix"] = json!(vec![vec![Value::Null; 4]; 4]),
                }
            }
        })
    };
    let data = open(&unposed(3)).unwrap();
    assert_eq!(data.views.len(), 4);
    assert!(warns(
        &data,
        "2 of 7 views are left out because the file states no pose for them: images/r_0.png"
    ));
    assert!(warns(
        &data,
        "1 of 7 views are left out because their frame names no image (file_path): frames[1]"
    ));
    let message = refusal(&unposed(4));
    assert!(
        message.contains("4 of 7 views cannot be used") && message.contains("images/r_3.png"),
        "{message}"
    );
}

#[test]
fn poses_of_nsvf_that_are_infinite_are_those_of_no_view() {
    let folder = tempfile::tempdir().unwrap();
    for (i, camera) in cameras(5).iter().enumerate() {
        write_file(folder.path(), &format!("pose/{}.txt", stem(i)), nsvf_pose(camera));
    }
    write_file(folder.path(), "pose/r_2.txt", "-inf -inf -inf -inf\n".repeat(4));
    write_file(folder.path(), "intrinsics.txt", "30 12 8 0.\n0. 0. 0.\n");
    pictures(folder.path(), 5);
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 4);
    assert_warns(&data, "states no pose for them: images/r_2");
}

#[test]
fn files_that_hold_no_whole_picture_are_left_out_and_named() {
    let png = |i: usize, folder: &TempDir| folder.path().join(format!("images/r_{i}.png"));
    let folder = transforms_folder(12, |_| {});
    let whole = std::fs::read(png(5, &folder)).unwrap();
    let contents: [(&[u8], &str); 5] = [
        (b"", "their image has 0 bytes: images/r_0.png"),
        (&whole[..whole.len() - 14], "their image is cut off: images/r_1.png"),
        (b"version https://git-lfs.github.com/spec/v1", "run git lfs pull"),
        (b"<!DOCTYPE html>", "page of the web"),
        (b"no picture", "their image cannot be decoded: images/r_"),
    ];
    for (i, (content, _)) in contents.iter().enumerate() {
        std::fs::write(png(i, &folder), content).unwrap();
    }
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 7);
    for (_, said) in contents {
        assert!(warns(&data, said), "{said}: {:?}", data.problems);
    }
    std::fs::write(png(5, &folder), b"").unwrap();
    let message = refusal(&folder);
    assert!(message.contains("6 of 12 views cannot be used") && message.contains("0 bytes"), "{message}");
}

#[test]
fn descriptions_that_were_not_downloaded_are_named_so() {
    for (content, says) in [
        ("version https://git-lfs.github.com/spec/v1\n", "run git lfs pull"),
        ("<!DOCTYPE html>", "a page of the web: download it again"),
        ("frames", "not valid JSON"),
    ] {
        let folder = transforms_folder(4, |_| {});
        write_file(folder.path(), "transforms.json", content);
        let message = refusal(&folder);
        assert!(message.contains("transforms.json") && message.contains(says), "{message}");
    }
    let folder = tempfile::tempdir().unwrap();
    let pointer = "version https://git-lfs.github.com/spec/v1\n";
    write_colmap(folder.path(), "sparse/0", "bin", [pointer; 3]);
    assert!(refusal(&folder).contains("run git lfs pull"), "any file");
}

#[cfg(unix)]
#[test]
fn folders_that_cannot_be_read_are_named() {
    use std::os::unix::fs::PermissionsExt;
    let permit = |path: &Path, mode| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    };
    let of_transforms = transforms_folder(4, |_| {});
    let of_colmap = tempfile::tempdir().unwrap();
    write_colmap(of_colmap.path(), "sparse/0", "txt", colmap_text(&cameras(4)));
    pictures(of_colmap.path(), 4);
    for (folder, closed) in [(of_transforms, "images"), (of_colmap, "sparse/0")] {
        let path = folder.path().join(closed);
        permit(&path, 0);
        // The superuser reads every folder.
        if std::fs::read_dir(&path).is_err() {
            let message = refusal(&folder);
            assert!(message.contains(&format!("{closed}: cannot be read: ")), "{message}");
        }
        permit(&path, 0o700);
    }
}

#[test]
fn addresses_are_not_followed_and_long_names_are_cut() {
    assert!(refusal(&all_named("s3://bucket/a.png")).contains("nothing is downloaded"));
    assert!(refusal(&all_named(&format!("data:image/png;base64,{}", "A".repeat(5000)))).len() < 1000);
}

#[test]
fn jpegs_that_break_off_are_named_and_those_with_something_behind_them_are_whole() {
    let folder = transforms_folder(5, |t| {
        (0..5).for_each(|i| t["frames"][i]["file_path"] = json!(format!("images/r_{i}.jpg")));
    });
    (0..5).for_each(|i| write_image(folder.path(), &format!("images/r_{i}.jpg"), WIDTH, HEIGHT));
    let whole = std::fs::read(folder.path().join("images/r_1.jpg")).unwrap();
    std::fs::write(folder.path().join("images/r_1.jpg"), &whole[..whole.len() - 20]).unwrap();
    std::fs::write(folder.path().join("images/r_2.jpg"), [&whole[..], b"appended by a phone"].concat())
        .unwrap();
    let data = open(&folder).unwrap();
    assert!(
        data.views.len() == 4 && warns(&data, "cut off: images/r_1.jpg (its headers"),
        "{:?}",
        data.problems
    );
    let folder = blender_folder([6, 2], 8);
    write_file(folder.path(), "transforms.json", transforms(&cameras(8)).to_string());
    assert!(
        !reports(&open(&folder).unwrap(), "several descriptions"),
        "one of all views beside those of the split"
    );
}

#[test]
fn held_out_views_may_all_be_missing_where_the_others_are_there() {
    let data = open(&blender_folder([4, 8], 4)).unwrap();
    assert_eq!(data.views.len(), 4);
    assert_warns(&data, "8 of 12 views are left out");
}

#[test]
fn photographs_without_a_pose_are_a_note_and_what_belongs_to_others_is_not() {
    let folder = transforms_folder(4, |_| {});
    for name in ["r_8", "r_9", "r_0_depth"] {
        write_image(folder.path(), &format!("images/{name}.png"), WIDTH, HEIGHT);
    }
    image::GrayImage::from_fn(WIDTH, HEIGHT, |x, _| image::Luma([if x < 4 { 0 } else { 255 }]))
        .save(folder.path().join("images/r_1.mask.png"))
        .unwrap();
    let data = open(&folder).unwrap();
    assert_reports(&data, "2 photographs have no pose and are not used");
    assert!(data.problems.iter().all(|p| p.severity == Severity::Note));
}

#[test]
fn points_that_are_missing_or_elsewhere_are_a_warning() {
    for path in ["gone.ply", "/elsewhere/gone.ply"] {
        let data = open(&transforms_folder(4, |t| t["ply_file_path"] = json!(path))).unwrap();
        assert_warns(&data, "gone.ply");
    }
}

#[test]
fn pictures_that_lie_on_their_side_are_left_out_and_named() {
    let folder = transforms_folder(8, |_| {});
    write_image(folder.path(), "images/r_3.png", HEIGHT, WIDTH);
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 7);
    assert_warns(&data, "1 of 8 views are left out because their image lies on its side");
    (0..8).for_each(|i| write_image(folder.path(), &format!("images/{}.png", stem(i)), HEIGHT, WIDTH));
    let refused = refusal(&folder);
    assert!(
        refused.contains("8 of 8") && refused.contains("turn the image back, or correct w and h"),
        "{refused}"
    );
}

#[test]
fn width_and_height_that_changed_places_are_read_the_right_way_round() {
    let folder = transforms_folder(6, |t| {
        (t["w"], t["h"]) = (json!(HEIGHT), json!(WIDTH));
        (t["cx"], t["cy"]) = (json!(0.5 * f64::from(WIDTH)), json!(0.5 * f64::from(HEIGHT)));
    });
    let data = open(&folder).unwrap();
    assert_same_rays(&data.views.iter().map(|v| &v.camera).collect::<Vec<_>>(), &cameras(6));
    assert_warns(&data, "the width and height of 6 cameras have changed places");
}

#[test]
fn half_a_model_of_colmap_is_named() {
    for missing in ["cameras", "images"] {
        let folder = colmap(4, |_| {});
        std::fs::remove_file(folder.path().join(format!("sparse/0/{missing}.txt"))).unwrap();
        let refused = refusal(&folder);
        assert!(refused.contains(&format!("incomplete: {missing}.bin or {missing}.txt")), "{refused}");
    }
}

#[test]
fn descriptions_that_are_not_read_are_named() {
    let folder = colmap(6, |_| {});
    write_file(folder.path(), "poses_bounds.npy", llff(&cameras(6)));
    let data = open(&folder).unwrap();
    assert!(
        reports(&data, "several descriptions of cameras") && reports(&data, "poses_bounds.npy"),
        "{:?}",
        data.problems
    );
}
