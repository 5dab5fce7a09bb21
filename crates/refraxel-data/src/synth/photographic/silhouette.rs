//! Masks as a segmenter draws them: borders that wander, holes, one mask missing and one of another view.

use crate::image::Mask;
use crate::synth::hash::{mix, signed, unit};
use crate::synth::scene::Scene;
use crate::synth::texture::noise;
use rayon::prelude::*;
use refraxel_core::{Camera, vec3};

/// Farthest that a border lies off [pixel].
pub const WANDER: f64 = 2.0;
/// Length along a border over which its error changes [pixel].
const REACH: f64 = 14.0;
/// Smallest and largest radius of a hole, as shares of the picture's width.
const HOLE: [f64; 2] = [0.008, 0.02];
/// Holes in a mask, at most.
const HOLES: u64 = 2;
/// A hole keeps this distance from the border [pixel].
const RIM: f64 = 3.0;
/// From so many training views on, one mask is missing and one is that of another view.
const FEW: usize = 4;

/// Whose silhouette the mask of a training view shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::synth) enum MaskOf {
    /// Its own.
    Own,
    /// That of the training view of this number.
    Other(usize),
    /// There is none.
    Nothing,
}

/// Whose silhouette the mask of training view `index` of `count` shows.
pub(in crate::synth) fn mask_of(index: usize, count: usize, seed: u64) -> MaskOf {
    if count < FEW {
        return MaskOf::Own;
    }
    let missing = (mix(seed, 0) % count as u64) as usize;
    let exchanged = (missing + 1 + (mix(seed, 1) % (count as u64 - 1)) as usize) % count;
    match index {
        i if i == missing => MaskOf::Nothing,
        i if i == exchanged => MaskOf::Other((i + count / 2) % count),
        _ => MaskOf::Own,
    }
}

/// Where a refractive body is the first thing seen at the centre of a pixel.
pub(in crate::synth) fn seen(scene: &Scene, camera: &Camera) -> Mask {
    let inside = scene.inside(camera.world_from_camera.translation);
    let is_refractive = |x: u32, y: u32| {
        let ray = camera.ray(f64::from(x) + 0.5, f64::from(y) + 0.5)?;
        let hit = scene.first_visible(&ray, inside)?;
        scene.bodies[hit.body].medium()
    };
    let row = |y: u32| (0..camera.width).map(move |x| if is_refractive(x, y).is_some() { 255 } else { 0 });
    let coverage = (0..camera.height).into_par_iter().flat_map_iter(row).collect();
    Mask { width: camera.width, height: camera.height, coverage }
}

/// What a segmenter makes of a silhouette.
pub(in crate::synth) fn drawn(silhouette: &Mask, seed: u64) -> Mask {
    with_holes(wandering(silhouette, mix(seed, 0)), mix(seed, 1))
}

/// The border moved to and fro, by a length that changes smoothly along it.
fn wandering(mask: &Mask, seed: u64) -> Mask {
    let w = mask.width as usize;
    let moved = |pixel: usize| {
        let Some(away) = mask.to_border(pixel, WANDER.ceil() as u32) else { return mask.coverage[pixel] };
        let place = vec3((pixel % w) as f64, (pixel / w) as f64, 0.0);
        let outwards = WANDER * (2.0 * noise(seed, place, REACH) - 1.0);
        if f64::from(away) < outwards { 255 } else { 0 }
    };
    Mask { coverage: (0..mask.coverage.len()).map(moved).collect(), ..*mask }
}

/// Round holes well inside, as highlights make them.
fn with_holes(mut mask: Mask, seed: u64) -> Mask {
    let w = f64::from(mask.width);
    let inside: Vec<usize> = (0..mask.coverage.len()).filter(|&p| mask.coverage[p] == 255).collect();
    for k in 0..mix(seed, 0) % (HOLES + 1) {
        let draw = mix(seed, 1 + k);
        let radius = w * (HOLE[0] + (HOLE[1] - HOLE[0]) * 0.5 * (1.0 + signed(draw, 0)));
        let place = inside.get((unit(mix(draw, 1)) * inside.len() as f64) as usize);
        let Some(&middle) = place.filter(|&&p| mask.to_border(p, (radius + RIM).ceil() as u32).is_none())
        else {
            continue;
        };
        cut_disc(&mut mask, middle, radius);
    }
    mask
}

fn cut_disc(mask: &mut Mask, middle: usize, radius: f64) {
    let w = mask.width as usize;
    let apart = |a: usize, b: usize| (a as f64 - b as f64).powi(2);
    for (p, coverage) in mask.coverage.iter_mut().enumerate() {
        if apart(p % w, middle % w) + apart(p / w, middle / w) < radius * radius {
            *coverage = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc() -> Mask {
        let inside = |p: u32| (f64::from(p % 200) - 99.5).hypot(f64::from(p / 200) - 79.5) < 60.0;
        let coverage = (0..200 * 160).map(|p| if inside(p) { 255 } else { 0 }).collect();
        Mask { width: 200, height: 160, coverage }
    }

    #[test]
    fn borders_wander_by_two_pixels_at_most_and_by_none_in_the_mean() {
        let exact = disc();
        let (mut area, mut changed) = (0.0, 0);
        for seed in 0..30 {
            let mask = wandering(&exact, seed);
            for (p, (&a, &b)) in exact.coverage.iter().zip(&mask.coverage).enumerate() {
                let r = (p as f64 % 200.0 - 99.5).hypot((p / 200) as f64 - 79.5);
                assert!(a == b || (r - 60.0).abs() < WANDER + 0.75, "{r}"); // pixels are half a diagonal wide
                area += f64::from(b) - f64::from(a);
                changed += u32::from(a != b);
            }
        }
        let outwards = area / 255.0 / 30.0 / (2.0 * std::f64::consts::PI * 60.0);
        assert!(outwards.abs() < 0.25, "{outwards} pixels outwards in the mean");
        assert!(changed > 30 * 100, "{changed} pixels changed");
    }

    #[test]
    fn holes_lie_inside_and_some_masks_have_none() {
        let exact = disc();
        let count = |seed| {
            let mask = with_holes(exact.clone(), seed);
            let holes = (0..exact.coverage.len()).filter(|&p| exact.coverage[p] > mask.coverage[p]);
            holes.inspect(|&p| assert!(exact.to_border(p, 2).is_none())).count()
        };
        let counts: Vec<usize> = (0..40).map(count).collect();
        assert!(counts.contains(&0) && counts.iter().any(|&c| c > 10), "{counts:?}");
    }

    #[test]
    fn one_mask_is_missing_and_one_is_that_of_another_view() {
        for seed in 0..20 {
            let all: Vec<MaskOf> = (0..30).map(|i| mask_of(i, 30, seed)).collect();
            assert_eq!(all.iter().filter(|&&m| m == MaskOf::Nothing).count(), 1);
            let others: Vec<usize> =
                (0..30).filter(|&i| matches!(all[i], MaskOf::Other(of) if of != i)).collect();
            assert_eq!(others.len(), 1);
        }
        assert_eq!(mask_of(0, FEW - 1, 0), MaskOf::Own);
    }
}
