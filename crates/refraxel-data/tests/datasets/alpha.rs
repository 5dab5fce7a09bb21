//! Alpha channels are cut-outs, masks or nothing, by the colours below alpha 0.

use crate::fixture::*;
use refraxel_data::{
    AlphaMeaning, Backdrop, Dataset, MaskMeaning, OpenOptions, Pixels, Reduction, Severity, load_mask_of,
    load_photo,
};
use tempfile::TempDir;

/// Balls whose alpha is 0 beside them; the colour there is that of `below`.
fn cut_out(below: impl Fn(&Pixel) -> [u8; 3]) -> TempDir {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(8));
    write_cut_outs(folder.path(), &cameras, |pixel, ball| {
        let ([r, g, b], alpha) = ball.map_or((below(pixel), 0), |p| (texture(p), 255));
        [r, g, b, alpha]
    });
    write_transforms(folder.path(), &cameras, "png", |_| {});
    folder
}

fn opened(folder: &TempDir, alpha: Option<AlphaMeaning>, backdrop: Option<Backdrop>) -> Dataset {
    Dataset::open(folder.path(), &OpenOptions { alpha, backdrop, ..OpenOptions::default() }).unwrap()
}

#[test]
fn one_colour_or_noise_below_alpha_is_what_a_cut_out_leaves() {
    for below in [|_: &Pixel| [0; 3], |_: &Pixel| [255; 3], |p: &Pixel| p.noise()] {
        let data = opened(&cut_out(below), None, None);
        assert_eq!(data.backdrop, Backdrop::Transparent);
        assert!(data.views.iter().all(|v| !v.has_mask()));
    }
}

#[test]
fn a_photograph_that_goes_on_below_alpha_is_masked_and_its_colours_stay() {
    let folder = cut_out(|p| wall(p.camera, p.x, p.y));
    let data = opened(&folder, None, None);
    assert_eq!(data.backdrop, Backdrop::Surroundings);
    assert!(data.views.iter().all(|v| v.has_mask() && v.mask_meaning == MaskMeaning::Keep));
    assert_reports(&data, "--alpha backdrop");
    let photo = load_photo(&data.views[0]).unwrap();
    let (mask, corner) = (photo.mask.unwrap(), wall(&data.views[0].camera, 0, 0));
    assert_eq!(
        (photo.image.channels, mask.coverage[0], mask.coverage[(20 * EDGE + 20) as usize]),
        (3, 0, 255)
    );
    let Pixels::U8(pixels) = &photo.image.pixels else { panic!("8 bits stay 8 bits") };
    assert_eq!(pixels[..3], corner);
    assert_eq!(load_mask_of(&data.views[0]).unwrap(), Some(mask));
    let mut reduced = data.clone();
    reduced.reduce(&[0], Reduction::Divide(2));
    assert!(load_photo(&reduced.views[0]).unwrap().image.rgba(0)[0] > 0.1, "alpha 0 does not blacken means");
}

#[test]
fn what_the_user_says_of_alpha_counts() {
    let folder = cut_out(|p| wall(p.camera, p.x, p.y));
    assert_eq!(opened(&folder, Some(AlphaMeaning::Backdrop), None).backdrop, Backdrop::Transparent);
    let ignored = opened(&folder, Some(AlphaMeaning::Ignore), None);
    assert_eq!((ignored.backdrop, ignored.views[0].has_mask()), (Backdrop::Surroundings, false));
    assert_eq!(load_photo(&ignored.views[0]).unwrap().image.channels, 3);
    let plain = cut_out(|_| [0; 3]);
    assert!(opened(&plain, Some(AlphaMeaning::Mask), None).views.iter().all(|v| v.has_mask()));
    let over = opened(&plain, None, Some(Backdrop::Color([0.0, 1.0, 0.0])));
    assert_eq!(over.backdrop, Backdrop::Color([0.0, 1.0, 0.0]));
    let image = load_photo(&over.views[0]).unwrap().image;
    assert_eq!(image.rgba(0), [0.0, 1.0, 0.0, 1.0], "a cut-out is laid over the colour");
}

#[test]
fn alpha_that_is_opaque_or_0_everywhere_says_nothing() {
    for alpha in [0, 255, 252] {
        let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(8));
        write_cut_outs(folder.path(), &cameras, |p, ball| {
            let [r, g, b] = ball.map_or(wall(p.camera, p.x, p.y), texture);
            [r, g, b, alpha]
        });
        write_transforms(folder.path(), &cameras, "png", |_| {});
        let data = opened(&folder, None, None);
        assert_eq!((data.backdrop, data.views[0].has_mask()), (Backdrop::Surroundings, false), "{alpha}");
        let warned = data.problems.iter().any(|p| p.severity == Severity::Warning);
        assert_eq!(warned, alpha == 0, "{:?}", data.problems);
    }
}

#[test]
fn photographs_without_alpha_among_cut_outs_are_counted() {
    let folder = cut_out(|_| [0; 3]);
    write_image(folder.path(), "images/r_5.png", EDGE, EDGE);
    let data = opened(&folder, None, None);
    assert_eq!(data.backdrop, Backdrop::Transparent);
    assert_reports(&data, "1 of 8 photographs have no alpha channel");
}

#[test]
fn files_of_masks_take_the_place_of_alpha() {
    let folder = cut_out(|p| wall(p.camera, p.x, p.y));
    write_masks(folder.path(), &arc(8), |stem| format!("glass_masks/{stem}.png"));
    let data = opened(&folder, None, None);
    assert!(data.views.iter().all(|v| v.mask_meaning == MaskMeaning::Refractive && v.has_mask()));
}

#[test]
fn alpha_that_is_the_same_everywhere_is_left_out() {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(8));
    write_cut_outs(folder.path(), &cameras, |p, ball| {
        let [r, g, b] = ball.map_or(wall(p.camera, p.x, p.y), texture);
        [r, g, b, 128]
    });
    write_transforms(folder.path(), &cameras, "png", |_| {});
    let data = opened(&folder, None, None);
    assert_eq!((data.backdrop, data.views[0].has_mask()), (Backdrop::Surroundings, false));
    assert_warns(&data, "is 50 % everywhere");
}

#[test]
fn holes_in_whole_photographs_are_masked() {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(8));
    write_cut_outs(folder.path(), &cameras, |p, ball| {
        let [r, g, b] = ball.map_or(wall(p.camera, p.x, p.y), |_| [0; 3]);
        [r, g, b, if ball.is_some() { 0 } else { 255 }]
    });
    write_transforms(folder.path(), &cameras, "png", |_| {});
    let data = opened(&folder, None, None);
    assert_eq!((data.backdrop, data.views[0].mask_meaning), (Backdrop::Surroundings, MaskMeaning::Keep));
    assert!(data.views.iter().all(|v| v.has_mask()));
    assert_warns(&data, "alpha cuts holes into whole photographs");
    std::fs::remove_file(folder.path().join("transforms.json")).unwrap();
    write_blender(folder.path(), &cameras, "png");
    assert_eq!(
        opened(&folder, None, None).backdrop,
        Backdrop::Transparent,
        "a renderer leaves holes where nothing is"
    );
}

#[test]
fn one_cut_out_among_photographs_says_nothing_of_the_others() {
    let (folder, cameras) = (cut_out(|_| [0; 3]), arc(8));
    for (i, camera) in cameras.iter().enumerate().skip(2) {
        let at = |x, y| image::Rgb(on_ball(camera, x, y).map_or_else(|| wall(camera, x, y), texture));
        image::RgbImage::from_fn(EDGE, EDGE, at)
            .save(folder.path().join(format!("images/{}.png", stem(i))))
            .unwrap();
    }
    let data = opened(&folder, None, None);
    assert_eq!(data.backdrop, Backdrop::Surroundings);
    assert_warns(&data, "only 2 of 8 photographs have an alpha channel");
}

#[test]
fn colours_that_are_multiplied_by_alpha_are_named() {
    for is_multiplied in [true, false] {
        let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(8));
        write_cut_outs(folder.path(), &cameras, |p, ball| {
            let alpha = if ball.is_none() { 0 } else { [255, 100][((p.x + p.y) % 2) as usize] };
            let factor = if is_multiplied { u16::from(alpha) } else { 255 };
            let [r, g, b] = ball.map_or([0; 3], texture).map(|c| (u16::from(c) * factor / 255) as u8);
            [r, g, b, alpha]
        });
        write_transforms(folder.path(), &cameras, "png", |_| {});
        let data = opened(&folder, None, None);
        assert_eq!(data.backdrop, Backdrop::Transparent);
        assert_eq!(warns(&data, "premultiplied"), is_multiplied, "{:?}", data.problems);
    }
}

#[test]
fn cut_outs_to_learn_from_stay_where_the_held_out_photographs_have_no_alpha() {
    let (folder, cameras) = (cut_out(|_| [0; 3]), arc(8));
    for (i, camera) in cameras.iter().enumerate().skip(3) {
        let at = |x, y| image::Rgb(on_ball(camera, x, y).map_or([255; 3], texture));
        let path = folder.path().join(format!("images/{}.png", stem(i)));
        image::RgbImage::from_fn(EDGE, EDGE, at).save(path).unwrap();
    }
    write_transforms(folder.path(), &cameras, "png", |t| {
        t["test_ids"] = serde_json::json!([3, 4, 5, 6, 7]);
    });
    let data = opened(&folder, None, None);
    assert_eq!((data.split.train.len(), data.backdrop), (3, Backdrop::Transparent), "{:?}", data.problems);
}

#[test]
fn dark_outlines_are_not_taken_for_colours_multiplied_by_alpha() {
    let (folder, cameras) = (tempfile::tempdir().unwrap(), arc(8));
    write_cut_outs(folder.path(), &cameras, |p, ball| {
        let alpha = if ball.is_none() { 0 } else { [255, 100][((p.x + p.y) % 2) as usize] };
        let [r, g, b] = ball.filter(|_| alpha == 255).map_or([0; 3], texture);
        [r, g, b, alpha]
    });
    write_transforms(folder.path(), &cameras, "png", |_| {});
    assert!(!warns(&opened(&folder, None, None), "premultiplied"));
}
