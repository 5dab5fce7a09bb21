//! Which rays are drawn.

use super::*;
use refraxel_core::{Camera, Lens, Vec3, vec3};
use refraxel_data::{Backdrop, Depth, Image, Mask, MaskMeaning, Photo, Pixels, View};
use std::sync::Arc;

fn view(lens: Lens, meaning: MaskMeaning, mask: Option<Vec<u8>>) -> (View, Photo) {
    let mut camera = Camera::look_at(vec3(3.0, 1.0, 2.0), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.8, [4, 2]);
    camera.lens = lens;
    let view = View { mask_meaning: meaning, ..View::of_file("a.png", camera) };
    let pixels = Pixels::U8((0..32).map(|v| v * 8).collect());
    let image = Image { width: 4, height: 2, channels: 4, pixels };
    (view, Photo::new(image, mask.map(|coverage| Mask { width: 4, height: 2, coverage })))
}

fn sampler(lens: Lens, meaning: MaskMeaning, mask: Option<Vec<u8>>) -> RaySampler {
    let (view, photo) = view(lens, meaning, mask);
    RaySampler::new(vec![view], vec![photo], Backdrop::Transparent, 5)
}

#[test]
fn tables_of_directions_give_the_cameras_rays() {
    let lens = Lens::OpenCv { k: [0.05, -0.01, 0.0, 0.0], p: [0.001, 0.0] };
    let s = sampler(lens, MaskMeaning::Keep, None);
    for pixel in 0..8 {
        let (table, exact) = (s.views[0].ray(pixel).unwrap(), pixel_ray(&s.views[0].camera, pixel).unwrap());
        assert!((table.direction - exact.direction).length() < 1e-6);
    }
}

#[test]
fn masked_pixels_are_never_drawn() {
    let mask = vec![255, 0, 0, 255, 0, 0, 0, 0];
    let s = sampler(Lens::Pinhole, MaskMeaning::Keep, Some(mask));
    let allowed = [0, 3].map(|p| pixel_ray(&s.views[0].camera, p).unwrap());
    let batch = s.batch(0, 200, Selection::All);
    assert!(batch.rays.len() > 190 && batch.rays.iter().all(|r| allowed.contains(r)));
}

#[test]
fn rays_can_be_drawn_outside_or_mostly_inside_refractive_masks() {
    let mask = vec![255, 0, 0, 0, 255, 20, 0, 0];
    let s = sampler(Lens::Pinhole, MaskMeaning::Refractive, Some(mask));
    let of = |pixels: &[usize], batch: &Batch| {
        let rays: Vec<_> = pixels.iter().map(|&p| pixel_ray(&s.views[0].camera, p).unwrap()).collect();
        batch.rays.iter().filter(|r| rays.contains(r)).count() as f64 / batch.rays.len() as f64
    };
    assert_eq!(of(&[3, 7], &s.batch(0, 200, Selection::Outside(1))), 1.0);
    assert!((of(&[0, 4], &s.batch(0, 4000, Selection::Inside(0.6))) - 0.6).abs() < 0.03);
    assert!((of(&[0, 4], &s.batch(0, 4000, Selection::Inside(0.1))) - 0.25).abs() < 0.03);
}

#[test]
fn rays_around_a_mask_reach_so_many_pixels_and_no_further() {
    let s = sampler(Lens::Pinhole, MaskMeaning::Refractive, Some(vec![255, 0, 0, 0, 0, 0, 0, 0]));
    let drawn = |reach| s.batch(1, 400, Selection::Around(reach)).rays;
    let (pixel, near) = (|p: usize| pixel_ray(&s.views[0].camera, p).unwrap(), drawn(1));
    assert!(near.iter().all(|r| [0, 1, 4, 5].map(pixel).contains(r)));
    assert!([0, 1, 4, 5].map(pixel).iter().all(|r| near.contains(r)), "each of its neighbours");
    assert!(drawn(0).iter().all(|r| *r == pixel(0)) && drawn(3).contains(&pixel(7)));
}

#[test]
fn masks_that_are_moved_show_more_and_come_back_as_they_were() {
    let mut s = sampler(Lens::Pinhole, MaskMeaning::Refractive, Some(vec![255, 0, 0, 0, 0, 0, 0, 0]));
    let covered = |s: &RaySampler| {
        let views: Vec<_> = s.masked_views().map(|v| v.mask.coverage.clone()).collect();
        assert_eq!(views.len(), 1);
        let inside = (s.mask_share() * 8.0).round() as usize;
        (views[0].iter().filter(|c| **c > 127).count(), inside)
    };
    assert_eq!(covered(&s), (1, 1));
    s.shift_masks(1.0);
    assert_eq!(covered(&s), (4, 4), "its neighbours, too");
    s.shift_masks(2.0);
    assert_eq!(covered(&s), (6, 6), "from the mask of the data, not from the moved one");
    s.shift_masks(0.0);
    assert_eq!(covered(&s), (1, 1));
}

#[test]
fn rays_beside_a_mask_are_known_where_there_is_one() {
    let of = |mask: Option<Vec<u8>>| {
        let s = sampler(Lens::Pinhole, MaskMeaning::Refractive, mask);
        let batch = s.batch(0, 200, Selection::All);
        (0..batch.rays.len()).filter(|&k| batch.is_beside(k)).count()
    };
    assert_eq!(of(None), 0, "nobody knows");
    let half = of(Some(vec![255, 255, 0, 0, 255, 255, 0, 0]));
    assert!((60..140).contains(&half), "{half} of 200");
    assert_eq!(of(Some(vec![255; 8])), 0);
}

#[test]
fn transparent_pixels_show_the_random_background() {
    let batch = sampler(Lens::Pinhole, MaskMeaning::Keep, None).batch(3, 100, Selection::All);
    assert_eq!(batch.behind.len(), batch.rays.len());
    // Pixel 0 has alpha 24/255: mostly background.
    let first = pixel_ray(&sampler(Lens::Pinhole, MaskMeaning::Keep, None).views[0].camera, 0).unwrap();
    let k = batch.rays.iter().position(|r| *r == first).unwrap();
    let a = 24.0 / 255.0;
    assert!((batch.target[k][0] - batch.behind[k][0] * (1.0 - a)).abs() < 1e-6);
}

#[test]
fn a_batch_is_a_function_of_seed_and_step() {
    let s = sampler(Lens::Pinhole, MaskMeaning::Keep, None);
    assert_eq!(s.batch(4, 50, Selection::All).rays, s.batch(4, 50, Selection::All).rays);
    assert_ne!(s.batch(4, 50, Selection::All).offset, s.batch(5, 50, Selection::All).offset);
}

#[test]
fn cells_of_a_picture_hold_means_of_the_pixels_that_may_be_used() {
    // Pixel p is (32 p, 32 p + 8, 32 p + 16) of alpha 32 p + 24; columns 2 and 3 must not be used.
    let mask = vec![255, 255, 0, 0, 255, 255, 0, 0];
    let s = sampler(Lens::Pinhole, MaskMeaning::Keep, Some(mask));
    let cells = s.pictures().next().unwrap().reduced([2, 1]);
    let expected = [0_u8, 1, 4, 5].map(|p| {
        let alpha = f32::from(32 * p + 24) / 255.0;
        [f32::from(32 * p) / 255.0 * alpha, alpha]
    });
    let mean = |k: usize| expected.iter().map(|e| e[k]).sum::<f32>() / 4.0;
    let found = cells[0].unwrap();
    assert!((found[0] - mean(0)).abs() < 1e-6 && (found[3] - mean(1)).abs() < 1e-6, "{found:?}");
    assert_eq!(cells[1], None);
}

#[test]
fn few_pixels_of_a_large_cell_are_looked_at_and_they_are_spread_evenly() {
    use super::picture::sampled;
    assert_eq!(sampled(1, 2, 6), [3, 4, 5]);
    assert_eq!(sampled(1, 2, 64), [36, 44, 52, 60]);
    let all: Vec<usize> = (0..7).flat_map(|cell| sampled(cell, 7, 20)).collect();
    assert_eq!(all, (0..20).collect::<Vec<_>>());
}

#[test]
fn measured_depth_becomes_distance_along_rays_but_for_pixels_of_refractive_masks() {
    let mask = vec![255, 0, 0, 0, 0, 0, 0, 0];
    let (view, mut photo) = view(Lens::Pinhole, MaskMeaning::Refractive, Some(mask));
    // Half as many columns as the photograph has; 0 is unknown.
    photo.depth = Some(Arc::new(Depth::new([2, 2], vec![2.0, 0.0, 3.0, 4.0])));
    let s = RaySampler::new(vec![view], vec![photo], Backdrop::Color([1.0; 3]), 5);
    let batch = s.batch(0, 300, Selection::All);
    assert_eq!(batch.depth.len(), batch.rays.len());
    let depths = [None, Some(2.0), None, None, Some(3.0), Some(3.0), Some(4.0), Some(4.0)];
    let rays = [0, 1, 2, 3, 4, 5, 6, 7].map(|p| pixel_ray(&s.views[0].camera, p).unwrap());
    for (k, ray) in batch.rays.iter().enumerate() {
        let pixel = rays.iter().position(|r| r == ray).unwrap();
        let along = s.views[0].camera.forward().cast().dot(ray.direction);
        match (batch.measured(k), depths[pixel]) {
            (Some(got), Some(depth)) => assert!((got * along - depth).abs() < 1e-5, "{pixel}: {got}"),
            (got, want) => assert!(got.is_none() && want.is_none(), "{pixel}: {got:?}"),
        }
    }
}
