//! What lies behind the scene is decided by what the photographs show, and said.

use crate::fixture::*;
use refraxel_data::{Backdrop, Dataset, OpenOptions, scene_region};
use serde_json::json;
use std::path::Path;
use tempfile::TempDir;

/// A dataset of balls before `colour`, in the layout of renderings or of photographs.
fn balls(rendered: bool, extension: &str, colour: impl Fn(&Pixel) -> [u8; 3]) -> (TempDir, Dataset) {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(10));
    write_balls(folder.path(), &cameras, extension, |pixel, ball| ball.map_or(colour(pixel), texture));
    match rendered {
        true => write_blender(folder.path(), &cameras, extension),
        false => write_transforms(folder.path(), &cameras, extension, |_| {}),
    }
    let data = open(&folder).unwrap();
    (folder, data)
}

/// Balls in a room, whose photographs were changed.
fn balls_in(rendered: bool, change: impl Fn(&Pixel, [u8; 3]) -> [u8; 3]) -> (TempDir, Dataset) {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(10));
    write_balls(folder.path(), &cameras, "png", |pixel, ball| {
        change(pixel, ball.map_or(wall(pixel.camera, pixel.x, pixel.y), texture))
    });
    match rendered {
        true => write_blender(folder.path(), &cameras, "png"),
        false => write_transforms(folder.path(), &cameras, "png", |_| {}),
    }
    let data = open(&folder).unwrap();
    (folder, data)
}

#[test]
fn photographs_of_a_room_in_the_layout_of_renderings_have_surroundings() {
    let room = |p: &Pixel| wall(p.camera, p.x, p.y);
    let (_folder, data) = balls(true, "png", room);
    assert_eq!(data.backdrop, Backdrop::Surroundings);
    assert!(scene_region(&data).unbounded);
    assert!(
        warns(&data, "the layout is that of renderings") && warns(&data, "--backdrop"),
        "{:?}",
        data.problems
    );
    let (_folder, plain) = balls(false, "png", room);
    assert_eq!(plain.backdrop, Backdrop::Surroundings);
    assert!(!reports(&plain, "backdrop"), "nothing to say: {:?}", plain.problems);
}

#[test]
fn one_colour_behind_all_photographs_is_the_backdrop_in_every_layout_and_under_noise_of_jpeg() {
    for (colour, extension) in
        [([255; 3], "png"), ([0; 3], "png"), ([20, 200, 40], "png"), ([30, 90, 200], "jpg")]
    {
        for rendered in [true, false] {
            let (_folder, data) = balls(rendered, extension, |_| colour);
            let Backdrop::Color(found) = data.backdrop else { panic!("{colour:?}: {:?}", data.problems) };
            let off =
                found.iter().zip(colour).map(|(f, c)| (f * 255.0 - f32::from(c)).abs()).fold(0.0, f32::max);
            assert!(off < 2.0, "{colour:?}: {found:?}");
            assert_reports(&data, "of the borders of 10 photographs have the colour");
            assert!(!scene_region(&data).unbounded);
        }
    }
}

#[test]
fn ground_that_reaches_the_border_leaves_the_backdrop_of_renderings() {
    let ground = |p: &Pixel| if p.y > 30 { wall(p.camera, p.x, p.y) } else { [255; 3] };
    let (_folder, data) = balls(true, "png", ground);
    assert_eq!(data.backdrop, Backdrop::Color([1.0; 3]));
    let (_folder, photographed) = balls(false, "png", ground);
    assert_eq!(photographed.backdrop, Backdrop::Surroundings, "of photographs that is a wall");
}

#[test]
fn paper_with_shades_is_surroundings_and_it_is_said_that_it_nearly_is_one_colour() {
    let paper = |p: &Pixel| [(250 - (p.x + p.y) / 4 - p.i as u32 % 3) as u8; 3];
    let (_folder, data) = balls(false, "png", paper);
    assert_eq!(data.backdrop, Backdrop::Surroundings);
    assert_reports(&data, "nearly");
}

#[test]
fn photographs_that_disagree_are_named() {
    let mixed = |p: &Pixel| if p.i == 3 { p.noise() } else { [255; 3] };
    let (_folder, rendered) = balls(true, "png", mixed);
    assert_eq!(rendered.backdrop, Backdrop::Color([1.0; 3]));
    let (_folder, photographed) = balls(false, "png", mixed);
    assert_eq!(photographed.backdrop, Backdrop::Surroundings);
    for data in [rendered, photographed] {
        assert!(warns(&data, "r_3.png") && !warns(&data, "r_4.png"), "{:?}", data.problems);
    }
    let each_its_own = |p: &Pixel| [p.i as u8 * 20, 250 - p.i as u8 * 20, 90];
    for rendered in [true, false] {
        let (_folder, data) = balls(rendered, "png", each_its_own);
        assert_eq!(data.backdrop, Backdrop::Surroundings);
        assert_warns(&data, "of its own colour");
    }
}

#[test]
fn a_narrow_black_frame_is_no_backdrop() {
    let frame = |p: &Pixel| p.x == 0 || p.y == 0 || p.x == EDGE - 1 || p.y == EDGE - 1;
    let (_folder, data) = balls(false, "png", |p| if frame(p) { [0; 3] } else { wall(p.camera, p.x, p.y) });
    assert_eq!(data.backdrop, Backdrop::Surroundings);
}

#[test]
fn bars_around_photographs_are_named_with_the_crop_that_cuts_them_off() {
    let wide: fn(&Pixel) -> bool = |p| p.x < 4 || p.y < 4 || p.x >= EDGE - 4 || p.y >= EDGE - 4;
    let letterbox: fn(&Pixel) -> bool = |p| p.y < 5 || p.y >= EDGE - 6;
    for (is_bar, crop) in [(wide, "--crop 4,4,4,4"), (letterbox, "--crop 0,5,0,6")] {
        for rendered in [true, false] {
            let (_folder, data) = balls_in(rendered, |p, shown| if is_bar(p) { [0; 3] } else { shown });
            assert_eq!(data.backdrop, Backdrop::Surroundings, "{crop}: {:?}", data.problems);
            assert!(warns(&data, crop), "{crop}: {:?}", data.problems);
        }
    }
    let (_folder, before_black) = balls(true, "png", |_| [0; 3]);
    assert!(!reports(&before_black, "--crop"), "a backdrop is no bar: {:?}", before_black.problems);
}

#[test]
fn shades_of_a_backdrop_from_top_to_bottom_are_no_bars() {
    for rendered in [true, false] {
        let (_folder, data) = balls(rendered, "png", |p| [(60 + 4 * p.y) as u8; 3]);
        assert!(!reports(&data, "--crop"), "{:?}", data.problems);
    }
}

#[test]
fn corners_beyond_an_image_circle_are_said() {
    let half = EDGE as f32 / 2.0;
    let is_beyond = |p: &Pixel| (p.x as f32 + 0.5 - half).hypot(p.y as f32 + 0.5 - half) > half;
    let (_folder, data) = balls_in(false, |p, shown| if is_beyond(p) { [0; 3] } else { shown });
    assert_warns(&data, "the corners of all photographs");
}

#[test]
fn what_is_stated_wins_and_is_doubted_where_the_photographs_show_something_else() {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(10));
    write_balls(folder.path(), &cameras, "png", |p, ball| ball.map_or(wall(p.camera, p.x, p.y), texture));
    write_transforms(folder.path(), &cameras, "png", |t| t["background"] = json!([255, 255, 255]));
    let data = open(&folder).unwrap();
    assert_eq!(data.backdrop, Backdrop::Color([1.0; 3]));
    assert_warns(&data, "the backdrop is stated to be #ffffff, but");
    let opened = |backdrop| opened_with(folder.path(), OpenOptions { backdrop, ..OpenOptions::default() });
    for chosen in [Backdrop::Surroundings, Backdrop::Transparent, Backdrop::Color([0.2, 0.4, 0.6])] {
        let data = opened(Some(chosen));
        assert_eq!(data.backdrop, chosen);
        assert!(!reports(&data, "backdrop"), "{:?}", data.problems);
    }
}

fn opened_with(folder: &Path, options: OpenOptions) -> Dataset {
    Dataset::open(folder, &options).unwrap()
}

#[test]
fn a_stated_colour_may_be_written_in_any_way() {
    for (key, value, expected) in [
        ("background", json!("#00ff00"), [0.0, 1.0, 0.0]),
        ("background_color", json!([0, 255, 0]), [0.0, 1.0, 0.0]),
        ("background", json!([1.0, 1.0, 1.0]), [1.0; 3]),
        ("background", json!("black"), [0.0; 3]),
    ] {
        let folder = transforms_folder(4, |t| t[key] = value.clone());
        assert_eq!(open(&folder).unwrap().backdrop, Backdrop::Color(expected), "{key} {value}");
    }
    let folder = transforms_folder(4, |t| t["background"] = json!("greenish"));
    assert!(refusal(&folder).contains("background is \"greenish\"; expected"), "{}", refusal(&folder));
    for trained_with in [json!("random"), json!([1.0, 1.0, 1.0, 1.0])] {
        let folder = transforms_folder(4, |t| t["background_color"] = trained_with.clone());
        assert_warns(&open(&folder).unwrap(), &format!("background_color is {trained_with}, and not"));
    }
}

#[test]
fn a_backdrop_that_fills_half_of_the_borders_is_doubted() {
    let is_white = |p: &Pixel| ((p.x + 3 * p.i as u32) / 10 + p.y / 10) % 5 < 3;
    let (_folder, data) = balls_in(true, |p, colour| if is_white(p) { [255; 3] } else { colour });
    assert_eq!(data.backdrop, Backdrop::Color([1.0; 3]));
    assert_warns(&data, "say --backdrop surroundings");
}
