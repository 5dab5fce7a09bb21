use super::outlines::{MAP_BYTES, MAP_SIZE, Outlines};
use super::view::{Outline, Silhouette, averages};
use crate::silhouettes::Occluders;
use refraxel_core::{Camera, Vec3, vec3};
use refraxel_data::{Mask, quantize};
use std::sync::Arc;

fn silhouette([width, height]: [u32; 2], coverage: impl Fn(u32, u32) -> u8) -> Silhouette {
    let camera =
        Camera::look_at(vec3(4.0, 0.0, 0.0), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [width, height]);
    let coverage = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| coverage(x, y));
    let mask = Mask { width, height, coverage: coverage.collect() };
    let occluders = Occluders::new(&mask, 49, |pixels| vec![f32::INFINITY; pixels.len()]);
    Silhouette { camera, mask: Arc::new(mask), occluders: Some(occluders) }
}

/// Antialiased coverage of a disc, from the distance of the pixel's centre to its rim.
fn disc(centre: [f64; 2], radius: f64) -> impl Fn(u32, u32) -> u8 {
    move |x, y| {
        let d = (f64::from(x) + 0.5 - centre[0]).hypot(f64::from(y) + 0.5 - centre[1]) - radius;
        quantize(0.5 - d)
    }
}

#[test]
fn averages_keep_the_covered_area_also_of_squares_at_the_border() {
    let coverage: Vec<u8> = (0..35).map(|i| if i % 7 == 6 || i >= 28 { 200 } else { 100 }).collect();
    assert_eq!(averages(&coverage, [7, 5], 3), [100, 100, 200, 150, 150, 200]);
}

#[test]
fn the_contour_of_a_photograph_of_12_megapixels_stays_accurate_to_a_fraction_of_a_sample() {
    let (centre, radius) = ([2103.3, 1398.7], 812.4);
    let outline = Outline::new(&silhouette([4000, 3000], disc(centre, radius)), MAP_SIZE);
    assert_eq!((outline.stride, outline.size), (7, [572, 429]));
    let truth = |i: usize| {
        let [x, y] = [i % 572, i / 572].map(|k| (k as f64 + 0.5) * 7.0);
        (x - centre[0]).hypot(y - centre[1]) - radius
    };
    let near = (0..outline.distance.len()).filter(|&i| truth(i).abs() < 30.0);
    let worst = near.map(|i| (f64::from(outline.distance[i]) - truth(i)).abs()).fold(0.0, f64::max);
    const TOL: f64 = 0.06 * 7.0; // as for the half-plane in contour.rs
    assert!(worst < TOL, "{worst} pixels");
}

#[test]
fn memory_is_what_the_formula_says() {
    let sizes = [[400, 300], [1500, 200], [641, 640]];
    let views: Vec<_> =
        sizes.iter().map(|&size| silhouette(size, |x, _| if x < 50 { 255 } else { 0 })).collect();
    let outlines = Outlines::new(&views);
    assert_eq!(outlines.bytes(), Outlines::bytes_for(&sizes));
    assert_eq!(outlines.bytes(), 8 * (400 * 300 + 500 * 67 + 321 * 320));
}

#[test]
fn a_hundred_or_ten_thousand_photographs_of_12_megapixels_stay_within_the_budget() {
    for views in [1, 100, 10_000] {
        let bytes = Outlines::bytes_for(&vec![[4000, 3000]; views]);
        assert!(bytes <= MAP_BYTES, "{views} views need {bytes} bytes");
    }
    assert!(Outlines::bytes_for(&vec![[4000, 3000]; 100]) < 200 << 20);
}

#[test]
fn masks_are_shared_and_not_copied() {
    let view = silhouette([40, 30], |_, _| 255);
    assert!(Arc::ptr_eq(&view.mask, &view.clone().mask));
}
