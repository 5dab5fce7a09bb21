//! Cameras that other tools write give the same rays as `transforms.json` of the same cameras; and what is said about them.

use crate::fixture::*;
use refraxel_core::{Camera, Lens, vec3};
use refraxel_data::{DataError, Dataset, Format, OpenOptions};
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

const LENS: Lens = Lens::OpenCv { k: [0.03, -0.02, 0.004, 0.0], p: [2e-3, -3e-3] };
const FISHEYE: Lens = Lens::Fisheye { k: [0.02, -0.01, 0.003, -0.001] };

/// Cameras whose focal lengths and principal points lie off the middle.
fn off_center(count: usize, lens: Lens) -> Vec<Camera> {
    let camera = |(i, camera): (usize, Camera)| {
        let aside = 0.1 * i as f64;
        Camera { lens, focal: [FOCAL + aside, FOCAL - 1.0], center: [12.7 + aside, 7.2], ..camera }
    };
    cameras(count).into_iter().enumerate().map(camera).collect()
}

/// The same with square pixels.
fn square(cameras: Vec<Camera>) -> Vec<Camera> {
    cameras.into_iter().map(|c| Camera { focal: [c.focal[0]; 2], ..c }).collect()
}

fn folder(pictures: &str, count: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    (0..count).for_each(|i| write_image(folder.path(), &format!("{pictures}{}.png", stem(i)), WIDTH, HEIGHT));
    folder
}

fn opened(path: &Path) -> Dataset {
    Dataset::open(path, &OpenOptions::default()).unwrap()
}

/// Asserts that a dataset has the rays of `transforms.json` of these cameras.
fn assert_as_transforms(data: &Dataset, cameras: &[Camera]) {
    let reference = folder("images/", cameras.len());
    write_file(reference.path(), "transforms.json", transforms_with_lenses(cameras).to_string());
    let reference = opened(reference.path());
    assert_eq!(data.views.len(), reference.views.len());
    for view in &reference.views {
        let found = data.views.iter().find(|v| v.name == view.name);
        let (a, b) = (&found.unwrap_or_else(|| panic!("{} is missing", view.name)).camera, &view.camera);
        assert_eq!((a.width, a.height), (b.width, b.height));
        assert_same_rays_of(&view.name, a, b);
    }
}

#[test]
fn opensfm_gives_the_cameras_of_transforms_json_in_the_layouts_of_both_programs() {
    for (lens, place, given) in [
        (LENS, "", ""),
        (FISHEYE, "opensfm/", ""),
        (Lens::Pinhole, "opensfm/", "opensfm"),
        (LENS, "", "reconstruction.json"),
    ] {
        let (all, folder) = (off_center(5, lens), folder("images/", 5));
        write_file(folder.path(), &format!("{place}reconstruction.json"), opensfm(&all).to_string());
        let data = opened(&folder.path().join(given));
        assert_eq!((data.format, data.points[0]), (Format::OpenSfm, vec3(0.1, 0.2, 0.3)));
        assert_eq!(data.up, Some(vec3(0.0, 0.0, 1.0)), "east, north, up");
        assert_as_transforms(&data, &all);
        assert_reports(&data, "several reconstructions, of 0, 5 photographs");
    }
}

#[test]
fn opensfm_models_of_few_coefficients_are_read_and_others_refused() {
    let folder = folder("images/", 3);
    let mut file = opensfm(&cameras(3));
    let write = |file: &Value| write_file(folder.path(), "reconstruction.json", file.to_string());
    for i in 0..3 {
        file[1]["cameras"][format!("v2 phone {i}")] = json!({ "projection_type": "perspective", "width": 24, "height": 16,
                                                             "focal": 1.25, "k1": 0.01, "k2": 0.02, "k3": 0.5 });
    }
    write(&file);
    let camera = opened(folder.path()).views[0].camera;
    assert_eq!(camera.lens, Lens::OpenCv { k: [0.01, 0.02, 0.0, 0.0], p: [0.0; 2] });
    assert_eq!((camera.focal, camera.center), ([30.0, 30.0], [12.0, 8.0]));
    file[1]["cameras"]["v2 phone 1"]["projection_type"] = json!("spherical");
    write(&file);
    assert_eq!(opened(folder.path()).views[1].camera.lens, Lens::Equirectangular);
    file[1]["cameras"]["v2 phone 1"]["projection_type"] = json!("dual");
    write(&file);
    assert!(refusal(&folder).contains("cameras.v2 phone 1.projection_type: unsupported camera model dual"));
    file[1]["shots"]["r_1.png"]["camera"] = json!("none");
    write(&file);
    assert!(refusal(&folder).contains("shots.r_1.png.camera is \"none\"; expected the id of a camera"));
}

#[test]
fn metashape_gives_the_cameras_of_transforms_json_with_its_order_of_tangential_coefficients() {
    for lens in [LENS, FISHEYE] {
        let (all, folder) = (off_center(5, lens), folder("images/", 5));
        write_file(folder.path(), "my cameras.xml", metashape(&all));
        let data = opened(folder.path());
        assert_eq!(data.format, Format::Metashape);
        assert_as_transforms(&data, &all);
        assert_reports(&data, "5 of 7 cameras are used; 1 are not aligned, 1 are disabled");
        assert_eq!(opened(&folder.path().join("my cameras.xml")).views.len(), 5);
    }
}

#[test]
fn metashape_as_its_manual_projects_a_point() {
    let (folder, point) = (folder("", 3), vec3(0.11_f64, -0.07, 0.6));
    let text = metashape(&cameras(3)).replace("<b1>0</b1>", "<b1>0.5</b1><b2>0.2</b2>");
    let lens = [("k1", 0.05), ("k2", -0.02), ("k3", 0.01), ("k4", -0.03), ("p1", 0.004), ("p2", -0.006)];
    let text = lens.iter().fold(text, |text, (key, value)| {
        text.replace(&format!("<{key}>0</{key}>"), &format!("<{key}>{value}</{key}>"))
    });
    write_file(folder.path(), "cameras.xml", text);
    let data = opened(folder.path());
    let (x, y) = (point.x / point.z, point.y / point.z);
    let r2: f64 = x * x + y * y;
    let radial = 1.0 + 0.05 * r2 - 0.02 * r2.powi(2) + 0.01 * r2.powi(3) - 0.03 * r2.powi(4);
    let x1 = x * radial + 0.004 * (r2 + 2.0 * x * x) + 2.0 * -0.006 * x * y;
    let y1 = y * radial + -0.006 * (r2 + 2.0 * y * y) + 2.0 * 0.004 * x * y;
    let [u, v] = [12.0 + x1 * 30.0 + x1 * 0.5, 8.0 + y1 * 30.0]; // without b2, which is small
    let camera = &data.views[0].camera;
    let [found_u, found_v] = camera
        .project(camera.world_from_camera.rotation * point + camera.world_from_camera.translation)
        .unwrap();
    assert!((found_u - u).abs() < 1e-9 && (found_v - v).abs() < 1e-9, "{found_u} {u}, {found_v} {v}");
    assert_reports(&data, "the shear b2 is left out; it moves pixels by at most 0.05");
}

#[test]
fn what_metashape_states_and_rays_do_not_have_is_refused() {
    let folder = folder("images/", 3);
    let text = metashape(&off_center(3, LENS));
    for (from, to, says) in [
        ("</k4>", "</k4><p3>0.1</p3>", "without P3"),
        ("</k4>", "</k4><b2>9</b2>", "without B2"),
        ("type=\"frame\"", "type=\"cylindrical\"", "cylindrical (Metashape)"),
        ("sensor_id=\"1\"", "sensor_id=\"8\"", "camera 1 (r_1): sensor_id is \"8\""),
        ("</document>", "", "not valid XML"),
        ("<transform>", "<transform>x ", "sixteen finite numbers"),
    ] {
        write_file(folder.path(), "cameras.xml", text.replace(from, to));
        let message = refusal(&folder);
        assert!(message.contains(says) && message.contains("cameras.xml"), "{from}: {message}");
    }
}

#[test]
fn metashape_of_the_whole_earth_has_an_origin_near_by_and_knows_which_way_is_up() {
    let folder = folder("images/", 3);
    let text = metashape(&cameras(3)).replace(">1 -2 0.25<", ">0 6371000 0<");
    write_file(folder.path(), "cameras.xml", text);
    let data = opened(folder.path());
    assert!(data.views.iter().all(|v| v.camera.world_from_camera.translation.length() < 20.0));
    assert_eq!(data.up, Some(vec3(0.0, 1.0, 0.0)));
    assert!(reports(&data, "counted from the centre of the earth"));
}

#[test]
fn realitycapture_gives_the_cameras_of_transforms_json() {
    for pictures in ["", "images/", "photos/", "DCIM/"] {
        let (all, folder) = (square(off_center(5, LENS)), folder(pictures, 5));
        write_file(folder.path(), "export.csv", realitycapture(&all));
        let data = opened(folder.path());
        assert_eq!(data.format, Format::RealityCapture);
        assert_as_transforms(&data, &all);
    }
}

#[test]
fn realitycapture_may_have_been_saved_by_a_spreadsheet() {
    let (all, folder) = (square(off_center(5, LENS)), folder("images/", 5));
    let quoted = |line: &str| match line.split_once(',') {
        Some((name, rest)) if !line.starts_with('#') => format!("\"{name}\",{rest}\n"),
        _ => format!("{line}\n"),
    };
    let text: String = realitycapture(&all).lines().map(quoted).collect();
    for text in [text.clone(), text.replace(',', ";")] {
        write_file(folder.path(), "export.csv", text);
        assert_as_transforms(&opened(folder.path()), &all);
    }
}

#[test]
fn realityscan_calls_columns_otherwise() {
    let (all, folder) = (square(off_center(5, LENS)), folder("images/", 5));
    let text =
        realitycapture(&all).replace("heading,pitch,roll,f,px,py", "yaw,pitch,roll,f_35mm,px_norm,py_norm");
    write_file(folder.path(), "export.csv", text);
    assert_as_transforms(&opened(folder.path()), &all);
}

#[test]
fn realitycapture_may_have_commas_in_names_and_in_numbers() {
    let (all, folder) = (square(off_center(5, LENS)), tempfile::tempdir().unwrap());
    (0..5).for_each(|i| write_image(folder.path(), &format!("images/a, {}.png", stem(i)), WIDTH, HEIGHT));
    let text = realitycapture(&all);
    let named = |line: &str| match line.split_once(',') {
        Some((name, rest)) if !line.starts_with('#') => format!("\"a, {name}\",{rest}\n"),
        _ => format!("{line}\n"),
    };
    let with_commas = text.lines().map(named).collect::<String>();
    let with_decimals = |line: &str| match line.split_once(".png,") {
        Some((name, rest)) => format!("\"a, {name}.png\";{}\n", rest.replace(',', ";").replace('.', ",")),
        None => format!("{}\n", line.replace(',', ";")),
    };
    for text in [with_commas, text.lines().map(with_decimals).collect()] {
        write_file(folder.path(), "export.csv", text);
        let mut data = opened(folder.path());
        data.views.iter_mut().for_each(|view| view.name = view.name.replace("a, ", ""));
        assert_as_transforms(&data, &all);
    }
}

#[test]
fn a_damaged_photograph_of_realitycapture_is_left_out_as_any_other() {
    let (all, folder) = (square(off_center(5, LENS)), folder("images/", 5));
    write_file(folder.path(), "export.csv", realitycapture(&all));
    write_file(folder.path(), "images/r_2.png", "no picture");
    let data = opened(folder.path());
    assert_eq!(data.views.len(), 4);
    assert_warns(&data, "cannot be decoded: r_2.png");
}

#[test]
fn positions_in_degrees_are_doubted() {
    let rows = |unit: f64| -> String {
        let row = |i: usize| {
            let along = i as f64 * unit;
            format!("{}.png,{},{},{},0,0,0,54\n", stem(i), 8.2 + along, 47.1 - along, 400.0 + i as f64)
        };
        (0..4).map(row).collect()
    };
    for (unit, is_doubted) in [(1e-5, true), (1.0, false)] {
        let folder = folder("", 4);
        write_file(folder.path(), "a.csv", format!("#name,x,y,alt,heading,pitch,roll,f\n{}", rows(unit)));
        let data = opened(folder.path());
        assert_eq!(warns(&data, "may be longitude and latitude"), is_doubted, "{:?}", data.problems);
    }
}

#[test]
fn realitycapture_without_rotation_looks_down_with_north_on_top() {
    let folder = folder("", 3);
    let row = |i: usize| format!("{}.png,{i},2,3,0,0,0,54\n", stem(i));
    let text = format!("#name,x,y,alt,heading,pitch,roll,f\n{}{}{}", row(0), row(1), row(2));
    write_file(folder.path(), "a.csv", &text);
    let camera = opened(folder.path()).views[1].camera;
    assert_eq!(
        camera.world_from_camera.rotation.columns.map(|c| c + vec3(0.0, 0.0, 0.0)),
        [vec3(1.0, 0.0, 0.0), vec3(0.0, -1.0, 0.0), vec3(0.0, 0.0, -1.0)]
    );
    assert_eq!(camera.focal[0], 36.0);
    write_file(folder.path(), "a.csv", text.replace("1,2,3", "1,two,3"));
    assert!(refusal(&folder).contains("line 3 (y) is \"two\"; expected a finite number"));
    write_file(folder.path(), "b.csv", &text);
    let message = refusal(&folder);
    assert!(
        message.contains("a.csv") && message.contains("b.csv") && message.contains("give one of them"),
        "{message}"
    );
}

#[test]
fn record3d_gives_the_cameras_of_transforms_json_in_the_order_of_numbers() {
    for (metadata, pictures) in
        [("metadata", "rgbd"), ("metadata.json", "rgb"), ("EXR_RGBD/metadata.json", "EXR_RGBD/rgb")]
    {
        let (all, folder) = (off_center(12, Lens::Pinhole), tempfile::tempdir().unwrap());
        write_file(folder.path(), metadata, record3d(&all).to_string());
        (0..12).for_each(|i| write_image(folder.path(), &format!("{pictures}/{i}.png"), WIDTH, HEIGHT));
        let mut data = opened(folder.path());
        assert_eq!((data.format, data.up), (Format::Record3d, Some(vec3(0.0, 1.0, 0.0))));
        data.views.iter_mut().for_each(|view| view.name = format!("r_{}", view.name));
        assert_as_transforms(&data, &all);
    }
}

#[test]
fn a_phone_that_was_held_on_its_side_is_doubted() {
    let folder = tempfile::tempdir().unwrap();
    write_file(folder.path(), "metadata", record3d(&cameras(4)).to_string()); // their z axis is upwards
    (1..=4).for_each(|i| write_image(folder.path(), &format!("rgb/{i:05}.png"), WIDTH, HEIGHT));
    let data = open(&folder).unwrap();
    assert_reports(&data, "degrees away from what the phone says is up");
    assert!(reports(&data, "numbered from 1") && data.views[0].name == "00001.png", "{:?}", data.problems);
}

#[test]
fn polycam_gives_the_cameras_of_transforms_json_corrected_where_it_can_be() {
    let (all, folder) = (off_center(4, Lens::Pinhole), folder("keyframes/corrected_images/", 4));
    write_polycam(folder.path(), &all);
    write_file(folder.path(), "keyframes/cameras/r_0.json", polycam(&all[1]).to_string());
    write_image(folder.path(), "keyframes/images/r_0.png", WIDTH, HEIGHT);
    for given in [folder.path().to_owned(), folder.path().join("keyframes")] {
        let data = opened(&given);
        assert_eq!((data.format, data.up), (Format::Polycam, Some(vec3(0.0, 1.0, 0.0))));
        assert_as_transforms(&data, &all);
        assert!(
            reports(&data, "4 of 4 photographs have a blur_score below 25")
                && reports(&data, "--crop 15,15,15,15")
        );
    }
}

#[test]
fn polycam_may_leave_out_sizes_of_corrected_photographs_and_these_photographs() {
    let (all, folder) = (off_center(4, Lens::Pinhole), folder("keyframes/corrected_images/", 4));
    for (i, camera) in all.iter().enumerate() {
        let mut keyframe = polycam(camera);
        let map = keyframe.as_object_mut().unwrap();
        map.remove("width");
        map.remove("height");
        write_file(
            folder.path(),
            &format!("keyframes/corrected_cameras/{}.json", stem(i)),
            keyframe.to_string(),
        );
        write_file(
            folder.path(),
            &format!("keyframes/cameras/{}.json", stem(i)),
            polycam(camera).to_string(),
        );
    }
    write_file(folder.path(), "keyframes/cameras/r_9.json", polycam(&all[0]).to_string());
    write_file(folder.path(), "keyframes/depth/r_0.png", "");
    let data = opened(folder.path());
    assert_as_transforms(&data, &all);
    assert_reports(&data, "corrected 4 of 5 cameras");
    assert_reports(&data, "depth maps of Polycam are not used");
    std::fs::rename(folder.path().join("keyframes/corrected_images"), folder.path().join("keyframes/images"))
        .unwrap();
    let data = opened(folder.path());
    assert_as_transforms(&data, &all);
    assert!(!reports(&data, "--crop"), "these are not the corrected ones");
}

#[test]
fn what_a_training_of_gaussian_splatting_wrote_is_not_its_data() {
    let folder = tempfile::tempdir().unwrap();
    write_file(folder.path(), "cameras.json", gaussians(&cameras(4)).to_string());
    write_file(folder.path(), "cfg_args", "Namespace(sh_degree=3, source_path='/home/a/vase', eval=True)");
    let message = refusal(&folder);
    assert!(message.contains("from the data in /home/a/vase") && message.contains("cfg_args"), "{message}");
}

#[test]
fn cameras_that_are_not_read_are_named_with_what_can_be_done() {
    for (file, content, says) in [
        ("bundle.out", "# Bundle file v0.3\n", "cameras of Bundler is not supported: export"),
        ("bundle/bundle.out", "# Bundle file v0.3\n", "bundle/bundle.out"),
        ("model.nvm", "NVM_V3\n", "VisualSFM"),
        ("images/r_0.xmp", "<x xcr:Version=\"3\"/>", "Internal/External camera parameters"),
        ("images/cameras.csv", "#name,x,y,alt\n", "Internal/External camera parameters"),
        ("cameras.sfm", "{}", "aliceVision_exportColmap"),
        ("pose/0.txt", "1 0 0 0", "intrinsics.txt"),
        ("cams/00000000_cam.txt", "extrinsic", "MVSNet"),
        ("lowres_wide.traj", "0 0 0 0 0 0 0", "transform_matrix"),
        ("metadata.json", "{\"camera\": {\"quaternions\": []}}", "Kubric"),
        ("odometry.csv", "timestamp, frame, x, y, z\n", "Stray Scanner"),
        ("images/r_0.json", "{\"cameraPoseARFrame\": []}", "3D Scanner App"),
    ] {
        let folder = folder("images/", 4);
        write_file(folder.path(), file, content);
        let message = refusal(&folder);
        assert!(message.contains(says), "{file}: {message}");
        // The file itself may be given.
        let path = folder.path().join(file);
        let named = Dataset::open(&path, &OpenOptions::default()).unwrap_err().to_string();
        assert!(
            named.contains(says) || file.contains("0.txt") || file.contains("cam.txt"),
            "{file}: {named}"
        );
    }
    let folder = folder("images/", 4);
    for (file, content) in
        [("notes.xmp", "<x/>"), ("table.csv", "a,b"), ("mesh.ply", "ply"), ("log.out", "0")]
    {
        write_file(folder.path(), file, content);
    }
    assert!(
        matches!(open(&folder), Err(DataError::NoPoses { count: 4, .. })),
        "these say nothing of cameras"
    );
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    assert!(refusal(&folder).contains("mesh.ply: a set of points, Gaussians or faces is not supported"));
}

#[test]
fn a_part_of_a_dataset_leads_to_the_dataset() {
    let folder = transforms_folder(4, |_| {});
    write_image(folder.path(), "images_4/r_0.png", WIDTH, HEIGHT);
    write_image(folder.path(), "others/r_0.png", WIDTH, HEIGHT);
    for part in ["images", "images_4", "images/r_1.png"] {
        let error = Dataset::open(folder.path().join(part), &OpenOptions::default()).unwrap_err();
        let whole = folder.path().canonicalize().unwrap();
        assert!(matches!(&error, DataError::Part { dataset, .. } if *dataset == whole), "{part}: {error}");
    }
    let other = Dataset::open(folder.path().join("others"), &OpenOptions::default());
    assert!(matches!(other, Err(DataError::NoPoses { .. })), "none of these views");
}

#[test]
fn cameras_json_of_gaussian_splatting_gives_the_cameras_of_transforms_json() {
    let centred = |camera: Camera| Camera { center: [12.0, 8.0], ..camera };
    let all: Vec<Camera> = off_center(4, Lens::Pinhole).into_iter().map(centred).collect();
    let folder = folder("images/", 4);
    write_file(folder.path(), "cameras.json", gaussians(&all).to_string());
    for given in ["", "cameras.json"] {
        let data = opened(&folder.path().join(given));
        assert_eq!(data.format, Format::GaussianSplatting);
        assert_as_transforms(&data, &all);
    }
}

#[test]
fn scannetpp_takes_the_description_whose_pictures_are_there_and_holds_out_its_test_frames() {
    let file = |cameras: &[Camera]| {
        let mut file = transforms_with_lenses(cameras);
        let frames = file["frames"].as_array_mut().unwrap();
        for (i, frame) in frames.iter_mut().enumerate() {
            frame["file_path"] = json!(format!("{}.png", stem(i)));
            frame["mask_path"] = json!(format!("{}.png", stem(i)));
        }
        frames[0]["is_bad"] = json!(true);
        let test = frames.split_off(4);
        file["test_frames"] = json!(test);
        file
    };
    for (pictures, name, lens) in [
        ("resized_undistorted_images", "transforms_undistorted.json", Lens::Pinhole),
        ("resized_images", "transforms.json", FISHEYE),
    ] {
        let folder = folder(&format!("dslr/{pictures}/"), 6);
        let all = off_center(6, lens);
        write_file(folder.path(), &format!("dslr/nerfstudio/{name}"), file(&all).to_string());
        let other = if lens == FISHEYE { "transforms_undistorted.json" } else { "transforms.json" };
        write_file(folder.path(), &format!("dslr/nerfstudio/{other}"), file(&cameras(6)).to_string());
        for given in ["", "dslr", "dslr/nerfstudio", &format!("dslr/nerfstudio/{name}")] {
            let data = opened(&folder.path().join(given));
            assert_eq!((data.views.len(), data.split.train.len(), &data.split.test), (5, 3, &vec![3, 4]));
            assert_same_lens(&data.views[0].camera, &all[1]);
            assert!(
                reports(&data, "ScanNet++") && reports(&data, "1 frames are marked is_bad"),
                "{:?}",
                data.problems
            );
        }
    }
}

fn assert_same_lens(a: &Camera, b: &Camera) {
    assert_eq!((a.lens, a.focal, a.center), (b.lens, b.focal, b.center));
}

#[test]
fn the_only_dataset_below_is_used_and_said_and_several_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let write = |at: &str| {
        write_file(folder.path(), &format!("{at}/transforms.json"), transforms(&cameras(3)).to_string());
        (0..3)
            .for_each(|i| write_image(folder.path(), &format!("{at}/images/{}.png", stem(i)), WIDTH, HEIGHT));
    };
    write_image(folder.path(), "sources/a.png", WIDTH, HEIGHT);
    write("unpacked/scene");
    let data = open(&folder).unwrap();
    assert!(
        reports(&data, "holds no dataset itself") && reports(&data, "unpacked/scene is used"),
        "{:?}",
        data.problems
    );
    write("nearer");
    assert!(reports(&open(&folder).unwrap(), "nearer is used"), "the nearest level counts");
    write("another");
    let message = refusal(&folder);
    assert!(message.contains("/another,") && message.contains("/nearer;"), "{message}");
}

#[test]
fn an_archive_is_to_be_unpacked() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["scene.zip", "walk.r3d", "scene.tar.gz"] {
        write_file(folder.path(), name, "PK");
        let error = Dataset::open(folder.path().join(name), &OpenOptions::default()).unwrap_err();
        assert!(
            matches!(error, DataError::Archive { .. }) && error.to_string().contains("unpack it"),
            "{error}"
        );
    }
    assert!(refusal(&folder).contains("scene.tar.gz: an archive"), "a folder that holds nothing else");
    assert!(refusal(&folder).contains("`tar -xf scene.tar.gz`"));
    let above = tempfile::tempdir().unwrap();
    write_file(above.path(), "downloads/scan.r3d", "PK");
    assert!(refusal(&above).contains("`unzip scan.r3d -d scan`"), "a folder below");
    write_image(folder.path(), "a.png", WIDTH, HEIGHT);
    assert!(matches!(open(&folder), Err(DataError::NoPoses { .. })));
}

#[test]
fn other_names_of_transforms_are_found_and_keys_without_use_are_named() {
    let folder = transforms_folder(4, |file| {
        file["appearance_id"] = json!(3);
        for (i, frame) in file["frames"].as_array_mut().unwrap().iter_mut().enumerate() {
            frame["time"] = json!(0.25 * i as f64);
            frame["semantics_path"] = json!("semantics/0.png");
        }
        file["frames"][2]["camera_model"] = json!("OPENCV_FISHEYE");
    });
    let [usual, all, any] =
        ["transforms.json", "transforms_all.json", "from RealityScan.json"].map(|n| folder.path().join(n));
    write_file(folder.path(), "package.json", "{\"name\": \"frames\"}");
    std::fs::rename(usual, &any).unwrap();
    assert_reports(&open(&folder).unwrap(), "from RealityScan.json is used");
    std::fs::rename(any, all).unwrap();
    write_file(folder.path(), "transforms_test.json", "{}");
    let data = open(&folder).unwrap();
    assert_reports(&data, "transforms_all.json is used");
    assert_reports(&data, "not used: appearance_id, semantics_path");
    assert_reports(&data, "time goes from 0 to 0.75");
    let is_fisheye = |i: usize| matches!(data.views[i].camera.lens, Lens::Fisheye { .. });
    assert_eq!([0, 1, 2, 3].map(is_fisheye), [false, false, true, false], "a frame has its own model");
}

#[test]
fn rigs_of_colmap_do_not_change_what_is_read() {
    let all = cameras(4);
    let folder = folder("images/", 4);
    write_colmap(folder.path(), "sparse/0", "bin", colmap_binary(&all));
    write_file(folder.path(), "sparse/0/rigs.bin", colmap_rig());
    let data = open(&folder).unwrap();
    assert_reports(&data, "in rigs of up to 3; the pose of each image is used");
    assert_as_transforms(&data, &all);
    write_file(folder.path(), "sparse/0/rigs.bin", [9; 20]);
    assert!(reports(&open(&folder).unwrap(), "rigs are not used"));
    std::fs::remove_file(folder.path().join("sparse/0/rigs.bin")).unwrap();
    write_file(
        folder.path(),
        "sparse/0/rigs.txt",
        "# Rig calib list\n1 2 CAMERA 1 CAMERA 2 1 1 0 0 0 0.1 0 0\n",
    );
    assert!(reports(&open(&folder).unwrap(), "in rigs of up to 2"));
}

#[test]
fn a_sensor_of_metashape_without_an_adjusted_calibration_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = metashape(&cameras(4))
        .replace("<f>1</f>", "<f>30</f>")
        .replace("class=\"adjusted\"", "class=\"former\"");
    write_file(folder.path(), "cameras.xml", text);
    (0..4).for_each(|i| write_image(folder.path(), &format!("{}.png", stem(i)), WIDTH, HEIGHT));
    let data = open(&folder).unwrap();
    assert_eq!(data.views[0].camera.focal, [30.0; 2]);
    assert_warns(&data, "no calibration of the class adjusted");
}

#[test]
fn photographs_that_are_only_in_a_video_or_an_archive_are_named_so() {
    for (file, says) in [
        ("walk.mp4", "holds no images, but walk.mp4"),
        ("images/rgb.mkv", "images holds no images, but rgb.mkv"),
        ("images.zip", "holds no images, but images.zip"),
    ] {
        let folder = transforms_folder(4, |_| {});
        std::fs::remove_dir_all(folder.path().join("images")).unwrap();
        write_file(folder.path(), file, "");
        assert!(refusal(&folder).contains(says), "{file}: {}", refusal(&folder));
        std::fs::remove_file(folder.path().join("transforms.json")).unwrap();
        let is_known = matches!(open(&folder), Err(DataError::Video { .. } | DataError::Archive { .. }));
        assert!(is_known, "{file} alone");
    }
    let all_of_one = all_named("walk.mp4");
    write_file(all_of_one.path(), "walk.mp4", "");
    assert!(matches!(open(&all_of_one), Err(DataError::Video { .. })));
}
