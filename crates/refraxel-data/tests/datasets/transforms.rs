//! The dialects of `transforms.json`, and everything that can be wrong with one.

use crate::fixture::*;
use refraxel_core::{Lens, vec3};
use refraxel_data::{Backdrop, Dataset, MaskMeaning, OpenOptions};
use serde_json::{Value, json};

#[test]
fn a_focal_length_that_contradicts_the_angle_wins_with_a_warning() {
    let data = open(&transforms_folder(4, |t| t["camera_angle_x"] = json!(1.0))).unwrap();
    assert_eq!(data.views[0].camera.focal, [FOCAL, FOCAL]);
    assert_reports(&data, "fl_x is 30.000, but the field of view says 21.966");
    let consistent = 2.0 * (12.0 / FOCAL).atan();
    assert!(
        open(&transforms_folder(4, |t| t["camera_angle_x"] = json!(consistent))).unwrap().problems.is_empty()
    );
}

#[test]
fn intrinsics_of_a_frame_override_those_of_the_file() {
    let data = open(&transforms_folder(4, |t| {
        t["frames"][1]["fl_x"] = json!(50.0);
        t["frames"][1]["fl_y"] = json!(51.0);
        t["frames"][2]["x_fov"] = json!(90.0);
        t["frames"][3]["k1"] = json!(0.1);
    }));
    let focal: Vec<[f64; 2]> = data.as_ref().unwrap().views.iter().map(|v| v.camera.focal).collect();
    assert_eq!(focal[..2], [[30.0, 30.0], [50.0, 51.0]]);
    assert!((focal[2][0] - 12.0).abs() < 1e-12, "90 degrees across 24 pixels");
    assert!(matches!(data.unwrap().views[3].camera.lens, Lens::OpenCv { k, .. } if k[0] == 0.1));
}

#[test]
fn intrinsics_are_scaled_to_the_size_the_image_really_has() {
    let data = open(&transforms_folder(4, |t| {
        t["w"] = json!(48.0);
        t["h"] = json!(32.0);
    }))
    .unwrap();
    let camera = &data.views[0].camera;
    assert_eq!(
        ([camera.width, camera.height], camera.focal, camera.center),
        ([24, 16], [15.0; 2], [6.0, 4.0])
    );
    assert_reports(&data, "48x32 stated, 24x16 found");
}

#[test]
fn each_camera_model_becomes_its_lens() {
    let lens = |edit: &dyn Fn(&mut Value)| open(&transforms_folder(3, edit)).unwrap().views[0].camera.lens;
    let k = [0.1, 0.02, 0.003, 0.0004];
    let params = json!([k[0], k[1], k[2], k[3], 0.01, 0.02]);
    let brown = Lens::OpenCv { k, p: [0.01, 0.02] };
    assert_eq!(lens(&|t| t["distortion_params"] = params.clone()), brown);
    assert_eq!(lens(&|t| t["camera_model"] = json!("pinhole")), Lens::Pinhole);
    let fisheye = Lens::Fisheye { k: [0.1, 0.0, 0.0, 0.0] };
    for model in ["OPENCV_FISHEYE", "opencv_fisheye"] {
        assert_eq!(lens(&|t| (t["camera_model"], t["k1"]) = (json!(model), json!(0.1))), fisheye);
    }
    assert_eq!(lens(&|t| (t["is_fisheye"], t["k1"]) = (json!(true), json!(0.1))), fisheye);
    let rational = lens(&|t| (t["camera_model"], t["k4"]) = (json!("FULL_OPENCV"), json!(0.1)));
    assert_eq!(rational, Lens::FullOpenCv { k: [0.0, 0.0, 0.0, 0.1, 0.0, 0.0], p: [0.0; 2] });
    assert_eq!(lens(&|t| t["camera_model"] = json!("EQUIRECTANGULAR")), Lens::Equirectangular);
}

#[test]
fn what_would_silently_give_wrong_rays_is_refused_by_name() {
    let cases: [(&str, Value, &str); 10] = [
        ("camera_model", json!("ORTHOPHOTO"), "unsupported camera model ORTHOPHOTO; supported are"),
        ("orthographic", json!(true), "unsupported camera model orthographic"),
        ("ftheta_p0", json!(0.1), "unsupported camera model ftheta_p0"),
        ("rolling_shutter", json!([0.0, 0.0, 0.5, 0.0]), "rolling_shutter is not supported"),
        ("transform_matrix_start", json!([[1, 0, 0, 0]]), "transform_matrix_start is not supported"),
        ("k5", json!(0.01), "FULL_OPENCV"),
        ("fl_x", json!(-1.0), "frames[0].fl_x is -1.0; expected a focal length > 0"),
        ("fl_y", json!(-3.0), "frames[0].fl_y is -3.0; expected a focal length > 0"),
        ("k1", json!("much"), "frames[0].k1 is \"much\"; expected a finite number"),
        ("file_path", json!(7), "frames[0].file_path is 7; expected a text"),
    ];
    for (key, value, expected) in cases {
        let message = refusal(&transforms_folder(3, |t| t["frames"][0][key] = value));
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn poses_that_are_not_rigid_are_refused_by_frame() {
    type Edit = fn(&mut Value);
    let cases: [(&str, Edit, &str); 5] = [
        (
            "mirrored",
            |m| {
                for r in 0..3 {
                    m[r][2] = json!(-m[r][2].as_f64().unwrap())
                }
            },
            "mirrors the world",
        ),
        (
            "scaled",
            |m| {
                for r in 0..3 {
                    m[r][0] = json!(1.5 * m[r][0].as_f64().unwrap())
                }
            },
            "contains scale or shear",
        ),
        (
            "singular",
            |m| {
                for r in 0..3 {
                    m[r][0] = m[r][1].clone()
                }
            },
            "singular",
        ),
        ("not a number", |m| m[0][3] = Value::Null, "matrix of 3 or 4 rows"),
        ("short", |m| *m = json!([[1, 0, 0, 0]]), "matrix of 3 or 4 rows"),
    ];
    for (name, edit, expected) in cases {
        let message = refusal(&transforms_folder(3, |t| edit(&mut t["frames"][1]["transform_matrix"])));
        assert!(message.contains(expected) && message.contains("frames[1]"), "{name}: {message}");
    }
}

/// Changes all matrices of a dataset of four views.
fn with_matrices(edit: impl Fn([[f64; 4]; 4]) -> [[f64; 4]; 4]) -> Dataset {
    let folder = transforms_folder(4, |t| {
        for frame in t["frames"].as_array_mut().unwrap() {
            let matrix = serde_json::from_value(frame["transform_matrix"].take()).unwrap();
            frame["transform_matrix"] = json!(edit(matrix));
        }
    });
    open(&folder).unwrap()
}

#[test]
fn transposed_matrices_are_read_as_such_with_a_warning() {
    let data = with_matrices(|m| [0, 1, 2, 3].map(|column| m.map(|row| row[column])));
    assert_same_rays(&data.views.iter().map(|v| &v.camera).collect::<Vec<_>>(), &cameras(4));
    assert_warns(&data, "4 matrices have their position in the last row");
}

#[test]
fn a_scale_in_rotations_is_left_out_with_a_warning() {
    let data = with_matrices(|m| m.map(|row| [2.5 * row[0], 2.5 * row[1], 2.5 * row[2], row[3]]));
    assert_same_rays(&data.views.iter().map(|v| &v.camera).collect::<Vec<_>>(), &cameras(4));
    assert_warns(&data, "4 rotations contain a scale (2.5000 the first)");
}

#[test]
fn a_stated_box_that_no_photograph_shows_is_doubted() {
    let with = |corner: f64| {
        let corners = json!([[corner, corner, corner], [corner + 0.5, corner + 0.5, corner + 0.5]]);
        open(&transforms_folder(4, |t| t["aabb"] = corners)).unwrap()
    };
    assert!(!warns(&with(0.0), "box"));
    let data = with(100.0);
    assert_warns(&data, "no photograph shows anything of the box");
}

#[test]
fn a_field_of_view_across_the_height_alone_gives_both_focal_lengths() {
    let folder = transforms_folder(4, |t| {
        let file = t.as_object_mut().unwrap();
        ["fl_x", "fl_y"].iter().for_each(|key| drop(file.remove(*key)));
        file.insert("camera_angle_y".into(), json!(2.0 * (0.5 * f64::from(HEIGHT) / FOCAL).atan()));
    });
    let focal = open(&folder).unwrap().views[0].camera.focal;
    assert!(focal.iter().all(|f| (f - FOCAL).abs() < 1e-9), "{focal:?}");
}

#[test]
fn a_field_of_view_across_the_height_is_compared_with_the_focal_length_along_it() {
    let angle = 2.0 * (0.5 * f64::from(HEIGHT) / FOCAL).atan();
    let with = |fl_x: f64, fl_y: f64| {
        let edit = |t: &mut Value| {
            (t["fl_x"], t["fl_y"], t["camera_angle_y"]) = (json!(fl_x), json!(fl_y), json!(angle));
        };
        open(&transforms_folder(4, edit)).unwrap()
    };
    assert!(!warns(&with(1.2 * FOCAL, FOCAL), "the field of view says"), "pixels that are not square");
    assert!(warns(&with(FOCAL, 1.2 * FOCAL), "fl_y is"));
}

#[test]
fn slightly_wrong_rotations_are_repaired_with_a_note() {
    let stretch = |t: &mut Value| {
        let m = &mut t["frames"][1]["transform_matrix"];
        (0..3).for_each(|r| m[r][0] = json!(1.002 * m[r][0].as_f64().unwrap()));
    };
    assert!(reports(&open(&transforms_folder(3, stretch)).unwrap(), "were repaired"));
}

#[test]
fn missing_images_are_left_out_with_one_warning_and_half_of_them_is_an_error() {
    let folder = transforms_folder(6, |_| {});
    std::fs::remove_file(folder.path().join("images/r_4.png")).unwrap();
    let data = open(&folder).unwrap();
    assert_eq!(data.views.len(), 5);
    assert!(reports(&data, "1 of 6 views are left out because their image does not exist: images/r_4.png"));
    std::fs::remove_file(folder.path().join("images/r_0.png")).unwrap();
    assert_eq!(open(&folder).unwrap().views.len(), 4);
    std::fs::remove_file(folder.path().join("images/r_1.png")).unwrap();
    assert!(
        refusal(&folder).contains("3 of 6 views cannot be used: their image does not exist: images/r_0.png")
    );
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    assert!(
        refusal(&folder).contains("none of the 6 images it names exists; the first is \"images/r_0.png\"")
    );
}

#[test]
fn duplicate_frames_and_coinciding_cameras_are_refused() {
    let twice = transforms_folder(3, |t| t["frames"][2]["file_path"] = json!("images/r_1.png"));
    assert!(refusal(&twice).contains("frames[2] names the image"));
    let same = transforms_folder(3, |t| {
        let pose = t["frames"][0]["transform_matrix"].clone();
        (1..3).for_each(|i| t["frames"][i]["transform_matrix"] = pose.clone());
    });
    assert!(refusal(&same).contains("all 3 views have the same pose"));
}

#[test]
fn the_split_follows_lists_in_the_file_then_text_lists_then_every_eighth() {
    let folder = transforms_folder(10, |t| {
        t["train_filenames"] = json!(["images/r_0.png", "./images/r_1.png"]);
        t["test_filenames"] = json!(["images/r_9.png"]);
    });
    let data = open(&folder).unwrap();
    assert_eq!((data.split.train, data.split.test), (vec![0, 1], vec![9]));
    assert!(data.problems.iter().any(|p| p.message.contains("7 views are in no list")));

    let folder = transforms_folder(10, |_| {});
    let names = |options| {
        let data = Dataset::open(folder.path(), &options).unwrap();
        data.split.test.iter().map(|&i| data.views[i].name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(names(OpenOptions::default()), ["r_0.png", "r_8.png"]);
    assert_eq!(
        names(OpenOptions { holdout: Some(3), ..Default::default() }),
        ["r_0.png", "r_3.png", "r_6.png", "r_9.png"]
    );
    assert!(names(OpenOptions { holdout: Some(0), ..Default::default() }).is_empty());
    write_file(folder.path(), "test_list.txt", "r_5\nimages/r_7.png\n");
    assert_eq!(names(OpenOptions::default()), ["r_5.png", "r_7.png"]);
}

#[test]
fn the_backdrop_is_what_the_file_says_or_the_user_overrides() {
    let backdrop =
        |key: &str, value: Value| open(&transforms_folder(3, |t| t[key] = value)).unwrap().backdrop;
    assert_eq!(backdrop("background", json!([255, 0, 51])), Backdrop::Color([1.0, 0.0, 0.2]));
    assert_eq!(backdrop("background", json!("transparent")), Backdrop::Transparent);
    assert_eq!(backdrop("black_transparent", json!(true)), Backdrop::Color([0.0; 3]));
    assert!(
        refusal(&transforms_folder(3, |t| t["background"] = json!([0, 0, 900]))).contains("from 0 to 255")
    );
    let options = OpenOptions { backdrop: Some(Backdrop::Transparent), ..Default::default() };
    let data = Dataset::open(transforms_folder(3, |_| {}).path(), &options).unwrap();
    assert_eq!(data.backdrop, Backdrop::Transparent);
}

#[test]
fn masks_of_unknown_meaning_mark_a_thing_where_little_is_white_and_pixels_to_use_where_most_is() {
    let meaning = |white: u32| {
        let folder = transforms_folder(3, |t| {
            for k in 0..3 {
                t["frames"][k]["mask_path"] = json!(format!("m/{k}.png"));
            }
        });
        std::fs::create_dir(folder.path().join("m")).unwrap();
        let shade = |x: u32| image::Luma([if x < white { 255_u8 } else { 0 }]);
        for k in 0..3 {
            let mask = image::GrayImage::from_fn(WIDTH, HEIGHT, |x, _| shade(x));
            mask.save(folder.path().join(format!("m/{k}.png"))).unwrap();
        }
        let data = open(&folder).unwrap();
        (data.views[0].mask_meaning, reports(&data, "--mask-meaning"))
    };
    assert_eq!(meaning(WIDTH / 5), (MaskMeaning::Refractive, true));
    assert_eq!(meaning(WIDTH * 4 / 5), (MaskMeaning::Keep, true));
}

#[test]
fn masks_in_a_folder_of_glass_masks_mark_glass() {
    let folder = transforms_folder(3, |_| {});
    write_image(folder.path(), "glass_masks/r_1.png", WIDTH, HEIGHT);
    let data = open(&folder).unwrap();
    assert!(data.views[1].has_mask() && data.views[1].mask_meaning == MaskMeaning::Refractive);
    assert!(!data.views[0].has_mask());
}

#[test]
fn masks_are_found_by_key_and_by_place_and_their_meaning_is_stated() {
    let folder = transforms_folder(3, |t| t["frames"][0]["mask_path"] = json!("m/zero.png"));
    write_image(folder.path(), "m/zero.png", WIDTH, HEIGHT);
    write_image(folder.path(), "masks/r_1.png", WIDTH, HEIGHT);
    write_image(folder.path(), "images/dynamic_mask_r_2.png", WIDTH, HEIGHT);
    let meanings = |data: &Dataset| data.views.iter().map(|v| v.mask_meaning).collect::<Vec<_>>();
    let data = open(&folder).unwrap();
    assert!(data.views.iter().all(|v| v.has_mask()));
    assert_eq!(meanings(&data), [MaskMeaning::Keep, MaskMeaning::Keep, MaskMeaning::Ignore]);
    assert_reports(&data, "2 masks, white = use, black = ignore");
    write_file(folder.path(), "scene.json", r#"{"refractive": [{"shape": "sphere"}]}"#);
    assert_eq!(meanings(&open(&folder).unwrap())[1], MaskMeaning::Refractive);
    let options = OpenOptions { mask_meaning: Some(MaskMeaning::Ignore), ..Default::default() };
    assert_eq!(meanings(&Dataset::open(folder.path(), &options).unwrap()), [MaskMeaning::Ignore; 3]);
    write_image(folder.path(), "masks/r_1.png", WIDTH, HEIGHT + 1);
    assert!(refusal(&folder).contains("the mask is 24x17, but its image"));
}

#[test]
fn stated_boxes_come_back_in_world_coordinates() {
    let stated = |key: &str, value: Value| {
        open(&transforms_folder(3, |t| t[key] = value)).unwrap().stated_box.unwrap()
    };
    let bounds = stated("aabb", json!([[1, 2, 3], [-1, -2, -3]]));
    assert_eq!((bounds.min, bounds.max), (vec3(-1.0, -2.0, -3.0), vec3(1.0, 2.0, 3.0)));
    // instant-ngp's unit cube: q = cycle(0.33 p + 0.5), so p = 0 is its middle and its z axis is our x axis... cycled.
    let bounds = stated("render_aabb", json!([[0.5, 0.5, 0.5], [0.83, 1.16, 1.49]]));
    assert!((bounds.max - vec3(3.0, 1.0, 2.0)).length() < 1e-9 && bounds.min.length() < 1e-9, "{bounds:?}");
}

#[test]
fn comments_windows_paths_and_points_are_read() {
    let folder = transforms_folder(3, |t| {
        t["ply_file_path"] = json!("points.ply");
        (0..3).for_each(|i| t["frames"][i]["file_path"] = json!(format!("images\\r_{i}")));
    });
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
    write_file(folder.path(), "points.ply", ply);
    let text = std::fs::read_to_string(folder.path().join("transforms.json")).unwrap();
    write_file(folder.path(), "transforms.json", format!("\u{feff}// made on Windows\r\n{text}/* end */"));
    let data = open(&folder).unwrap();
    assert_eq!(data.points, [vec3(1.0, 2.0, 3.0)]);
    assert_eq!(data.views[1].name, "r_1.png");
}

#[test]
fn images_and_masks_outside_the_folder_need_permission() {
    for (key, stated) in
        [("file_path", "../secret.png"), ("mask_path", "/etc/hostname"), ("file_path", "C:\\x.png")]
    {
        let folder = transforms_folder(4, |t| t["frames"][0][key] = json!(stated));
        let message = refusal(&folder);
        assert!(
            message.contains(&format!("frames[0].{key} names")) && message.contains("outside"),
            "{message}"
        );
    }
    let outer = tempfile::tempdir().unwrap();
    write_image(outer.path(), "a.png", WIDTH, HEIGHT);
    let absolute = outer.path().join("a.png");
    let folder = transforms_folder(3, |t| t["frames"][0]["file_path"] = json!(absolute));
    let options = OpenOptions { allow_outside: true, ..Default::default() };
    assert_eq!(Dataset::open(folder.path(), &options).unwrap().views[0].name, "a.png");
}

#[test]
fn cameras_are_read_without_their_images() {
    let folder = tempfile::tempdir().unwrap();
    let mut value = transforms(&cameras(2));
    write_file(folder.path(), "path.json", value.to_string());
    let read = refraxel_data::open_cameras(folder.path().join("path.json"), &OpenOptions::default()).unwrap();
    assert_eq!(read.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["r_0", "r_1"]);
    let (found, expected) = (read[1].camera, cameras(2)[1]);
    assert_eq!((found.width, found.height), (expected.width, expected.height));
    assert!((found.forward() - expected.forward()).length() < 1e-9);
    for key in ["w", "h"] {
        value.as_object_mut().unwrap().remove(key);
    }
    write_file(folder.path(), "path.json", value.to_string());
    let error =
        refraxel_data::open_cameras(folder.path().join("path.json"), &OpenOptions::default()).unwrap_err();
    assert!(error.to_string().contains("frames[0].w is missing; expected w and h"), "{error}");
}

#[test]
fn cameras_of_several_splits_keep_their_folders() {
    let folder = tempfile::tempdir().unwrap();
    for part in ["train", "test"] {
        let mut value = transforms(&cameras(2));
        for (i, frame) in value["frames"].as_array_mut().unwrap().iter_mut().enumerate() {
            frame["file_path"] = format!("./{part}/r_{i}").into();
        }
        write_file(folder.path(), &format!("transforms_{part}.json"), value.to_string());
    }
    let read = refraxel_data::open_cameras(folder.path(), &OpenOptions::default()).unwrap();
    assert_eq!(
        read.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(),
        ["train_r_0", "train_r_1", "test_r_0", "test_r_1"]
    );
}
