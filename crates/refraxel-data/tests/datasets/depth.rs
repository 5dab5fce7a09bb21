//! Depth maps beside photographs.

use crate::fixture::*;
use refraxel_data::{Dataset, load_photo};
use serde_json::json;

/// Depth maps of 12 × 8 for the photographs of 24 × 16, in steps, growing along rows.
fn with_maps(edit: impl Fn(&mut serde_json::Value)) -> tempfile::TempDir {
    let folder = transforms_folder(4, |t| {
        for k in 0..4 {
            t["frames"][k]["depth_file_path"] = json!(format!("depth/{k}.png"));
        }
        edit(t);
    });
    std::fs::create_dir(folder.path().join("depth")).unwrap();
    let map = image::ImageBuffer::from_fn(12, 8, |x, y| image::Luma([(100 * x + y) as u16]));
    (0..4).for_each(|k| map.save(folder.path().join(format!("depth/{k}.png"))).unwrap());
    folder
}

fn depth_of(data: &Dataset, place: [f64; 2]) -> f32 {
    load_photo(&data.views[1]).unwrap().depth.unwrap().at(place)
}

#[test]
fn maps_are_read_in_their_unit_and_said() {
    let (plain, unit) = (with_maps(|_| {}), with_maps(|t| t["depth_unit_scale_factor"] = json!(0.5)));
    let data = open(&plain).unwrap();
    assert_reports(&data, "4 of 4 views have a depth map, 0.001 scene units a step");
    assert!((depth_of(&data, [0.99, 0.01]) - 1.1).abs() < 1e-6);
    let scaled = open(&unit).unwrap();
    assert!((depth_of(&scaled, [0.99, 0.99]) - 553.5).abs() < 1e-3);
    assert!(depth_of(&scaled, [0.01, 0.01]).is_nan(), "0 is unknown");
}

#[test]
fn maps_of_instant_ngp_are_left_out_where_the_file_switches_them_off() {
    for is_on in [true, false] {
        let folder = with_maps(|t| {
            t["enable_depth_loading"] = json!(is_on);
            for frame in t["frames"].as_array_mut().unwrap() {
                let path = frame.as_object_mut().unwrap().remove("depth_file_path").unwrap();
                frame["depth_path"] = path;
            }
        });
        let data = open(&folder).unwrap();
        assert_eq!(data.views.iter().all(|view| view.depth.is_some()), is_on);
        assert_eq!(reports(&data, "enable_depth_loading is false"), !is_on);
    }
}

#[test]
fn a_map_that_is_missing_or_has_colours_is_refused() {
    let missing = with_maps(|t| t["frames"][2]["depth_file_path"] = json!("depth/none.png"));
    let error = open(&missing).unwrap_err().to_string();
    assert!(error.contains("frames[2].depth_file_path") && error.contains("none.png"), "{error}");
    let coloured = with_maps(|_| {});
    image::RgbImage::new(12, 8).save(coloured.path().join("depth/0.png")).unwrap();
    let error = open(&coloured).unwrap_err().to_string();
    assert!(error.contains("0.png") && error.contains("one channel"), "{error}");
    let negative = with_maps(|t| t["depth_unit_scale_factor"] = json!(-1.0));
    assert!(open(&negative).unwrap_err().to_string().contains("depth_unit_scale_factor is -1"));
}

#[test]
fn maps_without_any_depth_are_left_out_with_a_word() {
    let folder = with_maps(|_| {});
    let black = image::ImageBuffer::from_pixel(12, 8, image::Luma([0_u16]));
    (0..4).for_each(|k| black.save(folder.path().join(format!("depth/{k}.png"))).unwrap());
    let data = open(&folder).unwrap();
    assert_reports(&data, "which are not used: they hold no depth above 0");
    assert!(data.views.iter().all(|v| v.depth.is_none()));
}

#[test]
fn record3d_has_depth_in_metres_as_exr_which_comes_before_compressed_depth() {
    let folder = tempfile::tempdir().unwrap();
    write_file(folder.path(), "metadata", record3d(&cameras(4)).to_string());
    (0..4).for_each(|k| write_image(folder.path(), &format!("rgb/{k}.jpg"), WIDTH, HEIGHT));
    write_file(folder.path(), "rgb/0.depth", "bvx2");
    std::fs::create_dir(folder.path().join("depth")).unwrap();
    let map = image::Rgb32FImage::from_pixel(12, 8, image::Rgb([1.25; 3]));
    (0..4).for_each(|k| map.save(folder.path().join(format!("depth/{k}.exr"))).unwrap());
    let data = open(&folder).unwrap();
    assert_reports(&data, "4 of 4 views have a depth map, 1 scene units a step");
    assert_eq!(depth_of(&data, [0.5, 0.5]), 1.25);
}

/// A recording of Record3D whose photographs have this map beside them.
fn recording(size: [u32; 2], map: &[u8]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_recording(folder.path(), &cameras(4), size, map);
    folder
}

#[test]
fn compressed_depth_of_record3d_is_that_which_was_compressed() {
    for DepthMap { size, file, depth } in [LZVN_MAP, LZFSE_MAP] {
        let folder = recording(size, file);
        let data = open(&folder).unwrap();
        assert_reports(&data, "4 of 4 views have a depth map, 1 scene units a step");
        let map = load_photo(&data.views[1]).unwrap().depth.unwrap();
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            let place = [(x, size[0]), (y, size[1])].map(|(at, of)| (f64::from(at) + 0.5) / f64::from(of));
            assert_eq!(map.at(place), depth(x, y), "{x} {y} of {size:?}");
        }
    }
}

#[test]
fn compressed_depth_is_found_in_a_folder_of_its_own() {
    let folder = recording(LZVN_MAP.size, LZVN_MAP.file);
    std::fs::create_dir(folder.path().join("depth")).unwrap();
    for k in 0..4 {
        let place = |of: &str| folder.path().join(format!("{of}/{k}.depth"));
        std::fs::rename(place("rgbd"), place("depth")).unwrap();
    }
    assert_eq!(depth_of(&open(&folder).unwrap(), [0.5, 0.5]), (LZVN_MAP.depth)(6, 4));
}

#[test]
fn compressed_depth_that_was_not_measured_is_unknown() {
    let folder = recording([2, 2], &lzfse_stored(&[f32::NAN, 0.0, -1.0, 2.5]));
    let data = open(&folder).unwrap();
    let known = [[0.2, 0.2], [0.8, 0.2], [0.2, 0.8]].map(|place| depth_of(&data, place).is_finite());
    assert_eq!((known, depth_of(&data, [0.8, 0.8])), ([false; 3], 2.5));
}

#[test]
fn compressed_depth_of_another_size_than_stated_is_refused() {
    for (size, said) in [
        ([12, 9], "384 bytes of depth; expected 432, 4 for each pixel of 12x9"),
        ([12, 7], "more than 336 bytes of depth; expected 336, 4 for each pixel of 12x7"),
    ] {
        let error = refusal(&recording(size, LZVN_MAP.file));
        assert!(error.contains(".depth: ") && error.contains(said), "{error}");
    }
}

#[test]
fn compressed_depth_needs_a_stated_size() {
    let folder = recording(LZVN_MAP.size, LZVN_MAP.file);
    let mut metadata = record3d(&cameras(4));
    metadata["dw"] = json!(12.5);
    write_file(folder.path(), "metadata", metadata.to_string());
    let error = refusal(&folder);
    assert!(error.contains("metadata: dw is 12.5; expected a whole number of pixels"), "{error}");
    metadata.as_object_mut().unwrap().remove("dw");
    write_file(folder.path(), "metadata", metadata.to_string());
    let data = open(&folder).unwrap();
    assert_warns(&data, "4 depth maps of Record3D (.depth) are not used");
    assert!(data.views.iter().all(|v| v.depth.is_none()));
}

#[test]
fn compressed_depth_that_is_cut_is_refused_by_name() {
    let folder = recording(LZVN_MAP.size, LZVN_MAP.file);
    for cut in 0..LZVN_MAP.file.len() {
        write_file(folder.path(), "rgbd/1.depth", &LZVN_MAP.file[..cut]);
        let error = refusal(&folder);
        assert!(error.contains("1.depth: damaged at byte"), "{cut}: {error}");
    }
}

#[test]
fn phone_captures_of_scannetpp_have_depth_in_millimetres() {
    let folder = tempfile::tempdir().unwrap();
    write_colmap(folder.path(), "colmap", "txt", colmap_text(&cameras(4)));
    (0..4).for_each(|k| write_image(folder.path(), &format!("rgb/{}.png", stem(k)), WIDTH, HEIGHT));
    std::fs::create_dir(folder.path().join("depth")).unwrap();
    let map = image::ImageBuffer::from_pixel(12, 8, image::Luma([1250_u16]));
    (0..4).for_each(|k| map.save(folder.path().join(format!("depth/{}.png", stem(k)))).unwrap());
    assert!(open(&folder).unwrap().views.iter().all(|v| v.depth.is_none()), "the unit is unknown");
    write_file(folder.path(), "pose_intrinsic_imu.json", "{}");
    let data = open(&folder).unwrap();
    assert_reports(&data, "4 of 4 views have a depth map, 0.001 scene units a step");
    assert_eq!(depth_of(&data, [0.5, 0.5]), 1.25);
}
