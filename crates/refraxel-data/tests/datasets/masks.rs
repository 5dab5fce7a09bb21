//! Masks are found under the names that tools give them, read as they are stored, and mean what the photographs show.

use crate::fixture::*;
use image::{DynamicImage, GrayImage, ImageBuffer, Luma, Rgb, RgbImage, Rgba, RgbaImage};
use refraxel_core::Camera;
use refraxel_data::{Dataset, MaskMeaning, load_photo};
use serde_json::json;
use std::path::Path;
use tempfile::TempDir;

/// Balls in a room, without masks.
fn balls() -> (TempDir, Vec<Camera>) {
    balls_beside(|p| wall(p.camera, p.x, p.y))
}

/// The same where it is known that masks mark something refractive.
fn glass_balls() -> (TempDir, Vec<Camera>) {
    let (folder, cameras) = balls();
    write_file(folder.path(), "scene.json", r#"{"refractive": [{"shape": "sphere"}]}"#);
    (folder, cameras)
}

fn balls_beside(colour: impl Fn(&Pixel) -> [u8; 3]) -> (TempDir, Vec<Camera>) {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(10));
    write_balls(folder.path(), &cameras, "png", |pixel, ball| ball.map_or(colour(pixel), texture));
    write_transforms(folder.path(), &cameras, "png", |_| {});
    (folder, cameras)
}

/// The same files with the key `mask_path`.
fn name_masks(folder: &Path, cameras: &[Camera]) {
    write_masks(folder, cameras, |stem| format!("m/{stem}.png"));
    write_transforms(folder, cameras, "png", |t| {
        for i in 0..cameras.len() {
            t["frames"][i]["mask_path"] = json!(format!("m/{}.png", stem(i)));
        }
    });
}

fn masked(data: &Dataset) -> usize {
    data.views.iter().filter(|v| v.has_mask()).count()
}

#[test]
fn masks_of_a_thing_that_stays_while_its_surroundings_change_say_what_to_use() {
    let fixed = |p: &Pixel| wall(&arc(1)[0], p.x, p.y); // a turntable before a wall
    for surroundings in [|p: &Pixel| p.noise(), fixed] {
        let (folder, cameras) = balls_beside(surroundings);
        name_masks(folder.path(), &cameras);
        let data = open(&folder).unwrap();
        assert_eq!(data.views[0].mask_meaning, MaskMeaning::Keep, "{:?}", data.problems);
        assert!(reports(&data, "--mask-meaning refractive") && !warns(&data, "mask"), "{:?}", data.problems);
    }
}

#[test]
fn masks_of_what_is_not_found_again_in_a_room_that_is_mark_something_refractive() {
    let (folder, cameras) = balls();
    write_balls(folder.path(), &cameras, "png", |p, ball| {
        ball.map_or(wall(p.camera, p.x, p.y), |_| p.noise())
    });
    name_masks(folder.path(), &cameras);
    let data = open(&folder).unwrap();
    assert_eq!(data.views[0].mask_meaning, MaskMeaning::Refractive, "{:?}", data.problems);
    assert!(reports(&data, "--mask-meaning keep") && !warns(&data, "mask"), "{:?}", data.problems);
}

#[test]
fn masks_that_only_their_coverage_tells_apart_are_doubted_aloud() {
    let (folder, cameras) = balls();
    name_masks(folder.path(), &cameras);
    let data = open(&folder).unwrap();
    assert_eq!(data.views[0].mask_meaning, MaskMeaning::Refractive);
    assert_warns(&data, "--mask-meaning keep");
}

#[test]
fn white_over_a_plain_backdrop_and_black_over_the_thing_are_inverted_masks() {
    let (folder, cameras) = balls_beside(|_| [255; 3]);
    for (i, camera) in cameras.iter().enumerate() {
        let mut mask = ball_mask(camera, 255);
        image::imageops::invert(&mut mask);
        std::fs::create_dir_all(folder.path().join("masks")).unwrap();
        mask.save(folder.path().join(format!("masks/{}.jpg", stem(i)))).unwrap();
    }
    let data = open(&folder).unwrap();
    assert_eq!((masked(&data), data.views[0].mask_meaning), (10, MaskMeaning::Ignore));
    assert_warns(&data, "inverted");
}

#[test]
fn masks_are_found_under_the_names_of_many_tools() {
    let names: [fn(&str) -> String; 18] = [
        |s| format!("masks/{s}.jpg"),
        |s| format!("masks/{s}.PNG"),
        |s| format!("masks/{}.png", s.to_uppercase()),
        |s| format!("masks/{s}.png.png"),
        |s| format!("masks/{s}_mask.png"),
        |s| format!("Mask/{s}.jpeg"),
        |s| format!("segmentation/{s}.png"),
        |s| format!("silhouettes/{s}.png"),
        |s| format!("mattes/images/{s}.png"),
        |s| format!("object_mask/{s}.png"),
        |s| format!("images/{s}_mask.png"),
        |s| format!("images/{s}.mask.jpg"),
        |s| format!("sam_masks/{s}.png"),
        |s| format!("masks-sam2/{s}.png"),
        |s| format!("images_mask/{s}.png"),
        |s| format!("images/{s}-mask.png"),
        |s| format!("images/mask_{s}.png"),
        |s| format!("images/{s}_alpha.png"),
    ];
    for name in names {
        let (folder, cameras) = glass_balls();
        write_masks(folder.path(), &cameras, name);
        let data = open(&folder).unwrap();
        assert_eq!(masked(&data), 10, "{}: {:?}", name("r_0"), data.problems);
    }
    let (folder, cameras) = glass_balls();
    write_masks(folder.path(), &cameras, |s| format!("dynamic_masks/{s}.png"));
    assert_eq!(open(&folder).unwrap().views[3].mask_meaning, MaskMeaning::Ignore);
    let (folder, cameras) = glass_balls();
    write_masks(folder.path(), &cameras, |s| format!("invalid-mask/{s}.png"));
    assert_eq!(open(&folder).unwrap().views[3].mask_meaning, MaskMeaning::Ignore);
}

#[test]
fn pictures_of_black_and_white_that_may_be_masks_under_other_names_are_said() {
    let names: [(fn(&str) -> String, &str); 3] = [
        (|s| format!("people/{s}.png"), "call the folder masks"),
        (|s| format!("sky_masks/{s}.png"), "call the folder masks"),
        (|_| "mask.png".to_owned(), "a mask for all photographs"),
    ];
    for (name, says) in names {
        let (folder, cameras) = glass_balls();
        write_masks(folder.path(), &cameras, name);
        let data = open(&folder).unwrap();
        assert_eq!(masked(&data), 0);
        assert!(warns(&data, says), "{}: {:?}", name("r_0"), data.problems);
    }
    let (folder, cameras) = glass_balls();
    write_balls(&folder.path().join("other"), &cameras, "png", |p, _| p.noise());
    std::fs::rename(folder.path().join("other/images"), folder.path().join("renderings")).unwrap();
    assert!(!warns(&open(&folder).unwrap(), "renderings"), "pictures of something are no masks");
}

#[test]
fn masks_that_are_not_used_and_views_without_one_are_said() {
    for name in ["masks/shape_{}.png", "masks/{}.npy"] {
        let (folder, _) = glass_balls();
        (0..10).for_each(|i| write_file(folder.path(), &name.replace("{}", &stem(i)), "x"));
        let data = open(&folder).unwrap();
        assert_eq!(masked(&data), 0);
        assert!(warns(&data, "masks seems to hold masks") && warns(&data, "r_0.png"), "{:?}", data.problems);
    }
    let (folder, cameras) = glass_balls();
    write_masks(folder.path(), &cameras[..8], |s| format!("masks/{s}.png"));
    let data = open(&folder).unwrap();
    assert_reports(&data, "2 views have none: r_8.png, r_9.png");
}

/// Coverage of the first mask at the middle and in a corner, where masks of the ball are stored as `store` makes them.
fn read(extension: &str, store: impl Fn(GrayImage) -> DynamicImage) -> (Dataset, [u8; 2]) {
    let (folder, cameras) = glass_balls();
    std::fs::create_dir_all(folder.path().join("masks")).unwrap();
    for (i, camera) in cameras.iter().enumerate() {
        let path = folder.path().join(format!("masks/{}.{extension}", stem(i)));
        store(ball_mask(camera, 255)).save(path).unwrap();
    }
    let data = open(&folder).unwrap();
    let mask = load_photo(&data.views[0]).unwrap().mask.unwrap();
    assert_eq!([mask.width, mask.height], [EDGE; 2]);
    (data, [mask.coverage[(20 * EDGE + 20) as usize], mask.coverage[0]])
}

#[test]
fn masks_of_numbers_colours_and_alpha_are_read_and_said() {
    let (data, found) =
        read("png", |m| GrayImage::from_fn(EDGE, EDGE, |x, y| Luma([m.get_pixel(x, y).0[0] / 255])).into());
    assert!(
        found == [255, 0] && reports(&data, "0 and 1; 1 counts as white"),
        "{found:?} {:?}",
        data.problems
    );
    let deep = |m: GrayImage| {
        ImageBuffer::from_fn(EDGE, EDGE, |x, y| Luma([u16::from(m.get_pixel(x, y).0[0] / 51)]))
    };
    let (data, found) = read("png", |m| deep(m).into());
    assert!(found == [255, 0] && warns(&data, "numbers from 0 to 5"), "{found:?} {:?}", data.problems);
    let red = |m: GrayImage| RgbImage::from_fn(EDGE, EDGE, |x, y| Rgb([m.get_pixel(x, y).0[0], 0, 0]));
    assert_eq!(read("png", |m| red(m).into()).1, [255, 0]);
    let cut = |m: GrayImage| RgbaImage::from_fn(EDGE, EDGE, |x, y| Rgba([9, 9, 9, m.get_pixel(x, y).0[0]]));
    let (data, found) = read("png", |m| cut(m).into());
    assert!(
        found == [255, 0] && reports(&data, "alpha channel of the mask"),
        "{found:?} {:?}",
        data.problems
    );
}

#[test]
fn masks_of_another_size_are_scaled_and_masks_of_another_shape_refused() {
    for size in [EDGE / 2, EDGE * 2] {
        let nearest = image::imageops::FilterType::Nearest;
        let (data, found) = read("png", |m| image::imageops::resize(&m, size, size, nearest).into());
        assert!(found == [255, 0] && reports(&data, "10 masks have"), "{found:?} {:?}", data.problems);
    }
    let (folder, _) = glass_balls();
    write_image(folder.path(), "masks/r_1.png", EDGE, EDGE / 2);
    assert!(refusal(&folder).contains("the mask is 40x20"));
}

#[test]
fn masks_that_leave_nothing_mark_all_or_are_swapped_are_named() {
    let (folder, cameras) = glass_balls();
    let white = GrayImage::from_pixel(EDGE, EDGE, Luma([255]));
    write_masks(folder.path(), &cameras, |s| format!("glass_masks/{s}.png"));
    white.save(folder.path().join("glass_masks/r_4.png")).unwrap();
    let data = open(&folder).unwrap();
    assert!(warns(&data, "white all over") && warns(&data, "r_4.png"), "{:?}", data.problems);

    let (folder, cameras) = balls();
    let mostly = |skip: usize| {
        for i in 0..cameras.len() {
            let mut mask =
                GrayImage::from_fn(EDGE, EDGE, |x, y| Luma([if x < 4 && y < 9 { 0 } else { 255 }]));
            if i == skip {
                image::imageops::invert(&mut mask);
            }
            std::fs::create_dir_all(folder.path().join("masks")).unwrap();
            mask.save(folder.path().join(format!("masks/{}.png", stem(i)))).unwrap();
        }
    };
    mostly(6);
    let data = open(&folder).unwrap();
    assert!(warns(&data, "may be inverted") && warns(&data, "r_6.png"), "{:?}", data.problems);
    GrayImage::new(EDGE, EDGE).save(folder.path().join("masks/r_2.png")).unwrap();
    let data = open(&folder).unwrap();
    assert!(warns(&data, "leave no pixel") && warns(&data, "r_2.png"), "{:?}", data.problems);
}

/// The warnings about these pictures in a folder of masks.
fn warned_of(name: &str, mask: impl Fn(&Camera) -> DynamicImage) -> Vec<String> {
    let (folder, cameras) = balls();
    std::fs::create_dir_all(folder.path().join(name)).unwrap();
    for (i, camera) in cameras.iter().enumerate() {
        mask(camera).save(folder.path().join(format!("{name}/{}.png", stem(i)))).unwrap();
    }
    warnings(&open(&folder).unwrap()).into_iter().map(str::to_owned).collect()
}

fn coloured(camera: &Camera, thing: [u8; 3], rest: [u8; 3]) -> DynamicImage {
    let mask = ball_mask(camera, 255);
    let colour = |x, y| Rgb(if mask.get_pixel(x, y).0 == [255] { thing } else { rest });
    RgbImage::from_fn(EDGE, EDGE, colour).into()
}

#[test]
fn masks_in_the_first_colour_of_a_colour_table_cover_what_has_it() {
    let (folder, cameras) = balls();
    std::fs::create_dir_all(folder.path().join("masks")).unwrap();
    for (i, camera) in cameras.iter().enumerate() {
        let mask = coloured(camera, [128, 0, 0], [0; 3]);
        mask.save(folder.path().join(format!("masks/{}.png", stem(i)))).unwrap();
    }
    let data = open(&folder).unwrap();
    let mask = load_photo(&data.views[0]).unwrap().mask.unwrap();
    assert_eq!(mask.coverage, ball_mask(&cameras[0], 255).into_raw());
    assert_warns(&data, "numbers from 0 to 128");
}

#[test]
fn masks_that_leave_out_nothing_or_mark_all_around_a_thing_are_doubted() {
    let in_colour = warned_of("masks", |camera| coloured(camera, [255, 0, 0], [0, 0, 255]));
    assert!(in_colour.iter().any(|w| w.contains("leave out nothing")), "{in_colour:?}");
    let white = warned_of("masks", |_| RgbImage::from_pixel(EDGE, EDGE, Rgb([255; 3])).into());
    assert!(!white.iter().any(|w| w.contains("leave out nothing")), "nothing moves: {white:?}");
    let inverted = warned_of("glass_masks", |camera| coloured(camera, [0; 3], [255; 3]));
    assert!(inverted.iter().any(|w| w.contains("as where black marks the glass")), "{inverted:?}");
    let right = warned_of("glass_masks", |camera| coloured(camera, [255; 3], [0; 3]));
    assert!(!right.iter().any(|w| w.contains("mask")), "{right:?}");
}

#[test]
fn a_second_folder_of_masks_is_named() {
    let (folder, cameras) = glass_balls();
    for second in ["dynamic_masks", "mask"] {
        write_masks(folder.path(), &cameras, |stem| format!("masks/{stem}.png"));
        write_masks(folder.path(), &cameras, |stem| format!("{second}/{stem}.png"));
        let data = open(&folder).unwrap();
        assert_eq!(masked(&data), 10);
        assert_warns(&data, "holds masks as well, and they are not used");
        std::fs::remove_dir_all(folder.path().join(second)).unwrap();
    }
    write_masks(folder.path(), &cameras, |stem| format!("masks_2/{stem}.png"));
    assert!(!reports(&open(&folder).unwrap(), "holds masks as well"), "of reduced photographs");
}
