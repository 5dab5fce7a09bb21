//! Datasets of arrays: the same as from disk, and everything that can be wrong with them.

use crate::fixture::*;
use image::{GrayImage, Luma, Rgb, RgbImage};
use refraxel_core::Lens;
use refraxel_data::{
    Backdrop, Dataset, Format, Image, Mask, MaskMeaning, OpenOptions, Photo, PhotoSource, Pixels, PosedPhoto,
    Split, report, scene_region,
};
use std::sync::Arc;
use tempfile::TempDir;

/// A dataset of 9 views with pictures and masks that differ, on a white backdrop.
fn on_disk() -> (TempDir, Dataset) {
    let folder = transforms_folder(9, |t| t["background"] = serde_json::json!([255, 255, 255]));
    for i in 0..9_u32 {
        let colored = |x: u32, y: u32| x.abs_diff(12) < 4 && y.abs_diff(8) < 4;
        let pixel = |x, y| if colored(x, y) { Rgb([20 * i as u8, x as u8, y as u8]) } else { Rgb([255; 3]) };
        let (width, height) = (WIDTH, HEIGHT);
        let image = folder.path().join(format!("images/{}.png", stem(i as usize)));
        RgbImage::from_fn(width, height, pixel).save(image).unwrap();
        if i != 4 {
            let mask = folder.path().join(format!("images/{}_mask.png", stem(i as usize)));
            GrayImage::from_fn(width, height, |x, y| Luma([(x * y + i) as u8])).save(mask).unwrap();
        }
    }
    let options = OpenOptions { mask_meaning: Some(MaskMeaning::Refractive), ..OpenOptions::default() };
    let data = Dataset::open(folder.path(), &options).unwrap();
    (folder, data)
}

/// The views of a dataset on disk, read into memory.
fn in_memory(data: &Dataset) -> Dataset {
    let all: Vec<usize> = (0..data.views.len()).collect();
    let photos = data.load_photos(&all, |_| {}).unwrap();
    let posed = data.views.iter().zip(photos).map(|(view, photo)| PosedPhoto {
        name: view.name.clone(),
        camera: view.camera,
        photo,
        mask_meaning: view.mask_meaning,
    });
    Dataset::in_memory(posed.collect(), data.split.clone(), data.backdrop).unwrap()
}

#[test]
fn arrays_give_the_same_photos_split_and_region_as_their_files() {
    let (_folder, disk) = on_disk();
    let memory = in_memory(&disk);
    assert_eq!((memory.root.as_deref(), memory.format), (None, Format::Memory));
    assert_eq!(memory.split, disk.split);
    assert_eq!(scene_region(&memory), scene_region(&disk));
    let train = &disk.split.train;
    let [a, b] = [&disk, &memory].map(|data| data.load_photos(train, |_| {}).unwrap());
    assert_eq!(a, b);
    let [a, b] = [(&disk, a), (&memory, b)]
        .map(|(data, photos)| scene_region(data).around_content(data, train, &photos));
    assert_eq!(a, b);
    assert_ne!(a, scene_region(&disk), "the pictures show less than the region");
}

#[test]
fn the_reports_differ_in_folder_and_format_alone() {
    let (folder, disk) = on_disk();
    let (mut from_disk, from_memory) = (report(&disk), report(&in_memory(&disk)));
    assert_eq!(from_disk.root, Some(folder.path().display().to_string()));
    assert_eq!(serde_json::to_value(&from_memory).unwrap()["root"], serde_json::Value::Null);
    from_disk.root = None;
    from_disk.problems.retain(|p| !p.message.contains("inspected")); // which files are, but not arrays
    from_disk.format = "memory";
    assert_eq!(from_disk, from_memory);
}

#[test]
fn pixels_in_memory_are_shared_not_copied() {
    let posed = posed();
    let image = Arc::clone(&posed[1].photo.image);
    let data = Dataset::in_memory(posed, split(), Backdrop::Surroundings).unwrap();
    assert!(Arc::ptr_eq(&image, &data.load_photos(&[1], |_| {}).unwrap()[0].image));
    assert!(matches!(&data.views[1].source, PhotoSource::Memory(_)) && data.views[1].has_mask());
    assert_eq!(data.split.rule, "as given");
}

#[test]
fn a_rotation_off_by_rounding_is_repaired_with_a_note() {
    let mut posed = posed();
    posed[1].camera.world_from_camera.rotation.columns[0] *= 1.002;
    let data = Dataset::in_memory(posed, split(), Backdrop::Surroundings).unwrap();
    assert_reports(&data, "1 rotations were up to 4.0e-3");
    let length = data.views[1].camera.world_from_camera.rotation.columns[0].length();
    assert!((length - 1.0).abs() < 1e-12);
}

/// Four views of 8-bit pictures with masks.
fn posed() -> Vec<PosedPhoto> {
    let [width, height] = [WIDTH, HEIGHT];
    let photo = |(i, camera)| {
        let pixels = Pixels::U8(vec![100; (height * width * 3) as usize]);
        let mask = Mask { width, height, coverage: vec![255; (height * width) as usize] };
        let photo = Photo::new(Image { width, height, channels: 3, pixels }, Some(mask));
        PosedPhoto { name: stem(i), camera, photo, mask_meaning: MaskMeaning::Keep }
    };
    cameras(4).into_iter().enumerate().map(photo).collect()
}

fn split() -> Split {
    Split { train: vec![0, 1, 2], test: vec![3], ..Split::default() }
}

/// The sentence that refuses a change of [`posed`].
fn refusal_of(edit: impl FnOnce(&mut Vec<PosedPhoto>)) -> String {
    let mut posed = posed();
    edit(&mut posed);
    let made = Dataset::in_memory(posed, split(), Backdrop::Surroundings);
    made.expect_err("this dataset must be refused").to_string()
}

#[test]
fn a_camera_that_cannot_be_used_is_refused_by_view() {
    type Edit = fn(&mut PosedPhoto);
    let cases: [(Edit, &str); 8] = [
        (|p| p.camera.world_from_camera.translation.x = f64::NAN, "an entry that is not a finite number"),
        (|p| p.camera.world_from_camera.rotation.columns[2] *= -1.0, "mirrors the world"),
        (|p| p.camera.world_from_camera.rotation.columns[0] *= 1.5, "scale or shear"),
        (|p| p.camera.world_from_camera.rotation.columns[0] *= 0.0, "singular"),
        (
            |p| p.camera.focal[1] = 0.0,
            "focal lengths are [30.0, 0.0] [pixel] in a picture of 24x16; expected two numbers from 0.01 to 1000 times",
        ),
        (|p| p.camera.center[0] = f64::INFINITY, "principal point is [inf, 8.0]"),
        (|p| p.camera.lens = Lens::Fisheye { k: [f64::NAN; 4] }, "lens has a coefficient"),
        (|p| p.camera.width = 25, "its image is 24x16, but its camera is for 25x16"),
    ];
    for (edit, expected) in cases {
        let message = refusal_of(|posed| edit(&mut posed[2]));
        assert!(message.starts_with("view 2 (\"r_2\"): ") && message.contains(expected), "{message}");
    }
}

#[test]
fn pixels_that_cannot_be_used_are_refused_by_view() {
    let image =
        |edit: &dyn Fn(&mut Image)| refusal_of(|posed| edit(Arc::make_mut(&mut posed[2].photo.image)));
    let mask = |edit: &dyn Fn(&mut Mask)| {
        refusal_of(|posed| edit(Arc::make_mut(posed[2].photo.mask.as_mut().unwrap())))
    };
    let mut bright = vec![0.5_f32; 24 * 16 * 3];
    bright[3 * (24 * 2 + 5) + 1] = f32::NAN;
    let cases = [
        (image(&|i| i.height = 15), "its image is 24x15, but its camera is for 24x16"),
        (image(&|i| i.channels = 2), "2 channels; expected 3 (RGB) or 4 (RGB and alpha)"),
        (image(&|i| i.channels = 4), "1152 values; expected height * width * channels = 1536"),
        (
            image(&|i| i.pixels = Pixels::F32(bright.clone())),
            "its image: pixel (column 5, row 2) has the colour value NaN; expected -1 to 1000",
        ),
        (mask(&|m| m.width = 23), "its mask is 23x16, but its image is 24x16"),
        (mask(&|m| m.coverage.truncate(383)), "383 values; expected height * width = 384"),
        (refusal_of(|posed| posed[2].name = "a/b".into()), "cannot be that of a file"),
        (refusal_of(|posed| posed[2].name.clear()), "cannot be that of a file"),
    ];
    for (message, expected) in cases {
        assert!(message.starts_with("view 2 (") && message.contains(expected), "{message}");
    }
    let empty = refusal_of(|posed| {
        (posed[0].camera.width, posed[0].camera.height) = (0, 16);
        let image = Image { width: 0, height: 16, channels: 3, pixels: Pixels::U8(Vec::new()) };
        posed[0].photo = Photo::new(image, None);
    });
    assert!(empty.contains("its image is 0x16; expected at least one pixel"), "{empty}");
}

#[test]
fn views_that_do_not_make_a_set_are_refused() {
    let same = refusal_of(|posed| {
        let camera = posed[0].camera;
        posed.iter_mut().for_each(|p| p.camera = camera);
    });
    assert!(same.contains("all 4 views have the same pose"), "{same}");
    assert!(refusal_of(|posed| posed.truncate(2)).contains("2 views in memory; at least 3"));
    let twice = refusal_of(|posed| posed[2].name = "r_0".into());
    assert!(twice.contains("views 0 and 2 of the training split are both named \"r_0\""), "{twice}");
    let mut posed = posed();
    posed[3].name = "r_0".into();
    assert!(
        Dataset::in_memory(posed, split(), Backdrop::Surroundings).is_ok(),
        "other parts have other folders"
    );
}

#[test]
fn an_impossible_split_or_backdrop_is_refused() {
    let made = |split, backdrop| Dataset::in_memory(posed(), split, backdrop).unwrap_err().to_string();
    let train = |train| made(Split { train, ..split() }, Backdrop::Transparent);
    assert!(train(vec![0, 4]).contains("the training split names view 4; expected a number from 0 to 3"));
    assert!(train(vec![1, 0, 1]).contains("the training split names view 1 twice"));
    assert!(train(Vec::new()).contains("no training view"));
    let test = made(Split { test: vec![usize::MAX], ..split() }, Backdrop::Transparent);
    assert!(test.contains("the test split names view"), "{test}");
    let bright = made(split(), Backdrop::Color([0.0, 255.0, 0.0]));
    assert!(bright.contains("expected red, green and blue from 0 to 1"), "{bright}");
}
