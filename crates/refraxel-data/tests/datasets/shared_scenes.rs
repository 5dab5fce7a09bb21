//! The independent scenes in the folder `shared/data` beside the repository, of which they are no part.

use refraxel_data::{Backdrop, Dataset, Format, MaskMeaning, OpenOptions, Pixels};
use std::path::PathBuf;

/// Opens one of the shared scenes.
fn open(scene: &str) -> Dataset {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(scene);
    assert!(path.exists(), "there is no scene at {}; this test needs it", path.display());
    Dataset::open(path, &OpenOptions::default()).unwrap()
}

#[test]
#[ignore = "needs the scenes in shared/data beside the repository"]
fn the_glass_ball_has_masks_truth_and_a_white_backdrop() {
    let data = open("glass_ball");
    assert_eq!((data.format, data.backdrop), (Format::Blender, Backdrop::Color([1.0; 3])));
    assert_eq!((data.split.train.len(), data.split.test.len()), (100, 40));
    assert!(data.views.iter().all(|v| v.has_mask() && v.mask_meaning == MaskMeaning::Refractive));
    assert_eq!(data.truth.as_ref().unwrap()["refractive"][0]["ior"], 1.5);
    assert_eq!(data.stated_box, None, "the truth's box is not a statement of the dataset");
    let photos = data.load_photos(&data.split.test[..4], |_| {}).unwrap();
    let photo = &photos[0];
    assert_eq!((photo.image.width, photo.image.height, photo.image.channels), (200, 200, 3));
    assert_eq!(photo.mask.as_ref().unwrap().coverage.len(), 200 * 200);
    assert_eq!(data.views[data.split.test[0]].name, "r_0.png");
}

#[test]
#[ignore = "needs the scenes in shared/data beside the repository"]
fn the_masks_of_the_glass_ball_cover_the_projection_of_its_centre() {
    let data = open("glass_ball");
    let center = refraxel_core::vec3(0.03, -0.04, -0.14);
    for &i in &data.split.train[..10] {
        let [u, v] = data.views[i].camera.project(center).unwrap();
        let photo = refraxel_data::load_photo(&data.views[i]).unwrap();
        assert!(photo.mask.unwrap().coverage[v as usize * 200 + u as usize] > 128, "{}", data.views[i].name);
    }
}

#[test]
#[ignore = "needs the scenes in shared/data beside the repository"]
fn the_opaque_scene_is_transparent_behind_its_things() {
    let data = open("opaque");
    assert_eq!(data.backdrop, Backdrop::Transparent);
    assert!(data.views.iter().all(|v| !v.has_mask()));
    let photo = refraxel_data::load_photo(&data.views[0]).unwrap();
    assert_eq!(photo.image.channels, 4);
    assert!(matches!(photo.image.pixels, Pixels::U8(_)));
}

#[test]
#[ignore = "needs the scenes in shared/data beside the repository"]
fn the_fox_has_a_lens_a_held_out_split_and_real_surroundings() {
    let data = open("fox");
    assert_eq!((data.format, data.backdrop), (Format::Blender, Backdrop::Surroundings));
    assert_eq!((data.split.train.len(), data.split.test.len()), (43, 7));
    let camera = &data.views[data.split.train[0]].camera;
    assert_eq!([camera.width, camera.height], [270, 480]);
    assert!((camera.focal[0] - 343.88).abs() < 1e-9 && (camera.center[1] - 241.317).abs() < 1e-9);
    assert!(matches!(camera.lens, refraxel_core::Lens::OpenCv { k, .. } if k[0] == 0.0578421));
}

#[test]
#[ignore = "needs the scenes in shared/data beside the repository"]
fn the_region_contains_the_true_content_with_modest_slack() {
    for scene in ["opaque", "glass_ball", "water_tank", "grin_luneburg"] {
        let data = open(scene);
        let truth = &data.truth.as_ref().unwrap()["aabb"];
        let corner = |i: usize| refraxel_core::Vec3::from([0, 1, 2].map(|a| truth[i][a].as_f64().unwrap()));
        let content = refraxel_core::Aabb::new(corner(0), corner(1));
        let region = refraxel_data::scene_region(&data);
        assert!(
            region.bounds.contains(content.min) && region.bounds.contains(content.max),
            "{scene}: {region:?}"
        );
        assert!(
            region.bounds.extent().max_element() < 1.5 * content.extent().max_element(),
            "{scene}: {region:?}"
        );
        assert!(!region.unbounded && region.up.z > 0.99);

        let train = &data.split.train[..32];
        let tight = region.around_content(&data, train, &data.load_photos(train, |_| {}).unwrap()).bounds;
        // The truth's box is loose in z: only its sides are filled. Below the ground no view can tell.
        let sides = |b: &refraxel_core::Aabb<f64>| [b.min.x, b.min.y, b.max.x, b.max.y].map(f64::abs);
        assert!(sides(&tight).into_iter().all(|s| (1.0..1.35).contains(&s)), "{scene}: {tight:?}");
        assert!(tight.min.z < -0.7 && tight.max.z > 0.3 && tight.max.z < 0.8, "{scene}: {tight:?}");
    }
}

#[test]
#[ignore = "needs the scenes in shared/data beside the repository"]
fn the_region_of_the_fox_is_seen_by_all_cameras_and_nearly_all_stand_outside() {
    let data = open("fox");
    let region = refraxel_data::scene_region(&data);
    assert!(region.unbounded && region.bounds.extent().min_element() > 2.0, "{region:?}");
    let cameras = || data.views.iter().map(|v| &v.camera);
    assert!(cameras().all(|c| c.project(region.bounds.center()).is_some()));
    let inside = cameras().filter(|c| region.bounds.contains(c.world_from_camera.translation)).count();
    assert!(inside <= data.views.len() / 10, "{inside} cameras inside {region:?}");
}

#[test]
#[ignore = "needs the scenes in shared/data beside the repository"]
fn the_report_of_the_fox_says_what_a_user_asks() {
    let data = open("fox");
    let report = refraxel_data::report(&data);
    assert_eq!((report.views.total, report.views.train, report.views.test), (50, 43, 7));
    assert_eq!(report.test_names[..2], ["0001.png", "0012.png"]);
    assert_eq!((report.image_sizes.len(), report.pixels), (1, 50 * 270 * 480));
    assert_eq!(report.cameras.lenses, ["radial and tangential (OPENCV)"]);
    let [low, high] = report.cameras.field_of_view.unwrap();
    assert!(low > 41.0 && high < 44.0, "{low} {high}");
    assert_eq!((report.backdrop.as_str(), report.unbounded), ("surroundings", true));
    assert!(serde_json::to_string(&report).unwrap().contains("\"split_rule\""));
}
