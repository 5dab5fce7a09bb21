//! What glass absorbs when rays begin to bend, theory (6.4).
//!
//! The mean of what is seen through a body hardly depends on where its rays end: it tells the colour of the glass, and its error tells
//! whether there is any.

use super::context::Context;
use super::misfit::misfit;
use super::region::Region;
use crate::backend::{Backend, Batch, Layers};
use crate::rays::{Selection, shown, squared_errors};
use crate::schedule::training_marching;

/// Rays through a body.
const RAYS: usize = 1024;
/// Optical thickness over the depth of the body to start from, and how often it is corrected.
const THICKNESS: f32 = 0.5;
const STEPS: usize = 2;
/// Largest optical thickness over the depth of the body: nothing is seen through more.
const DARKEST: f32 = 5.0;
/// What absorbs all channels alike, to this part of the most absorbed one, is a thing in clear glass rather than its colour.
const COLOUR: f32 = 0.3;
/// Its colour must lower the error to this part.
const EXPLAINED: f64 = 0.97;
const CLEAR: [f32; 3] = [0.0; 3];

/// What the medium of a backend shows of rays through a body.
struct Seen {
    mean: [f64; 3],
    error: f64,
}

impl Seen {
    fn new(backend: &dyn Backend, through: &Batch, known: &Context) -> Self {
        let marching = training_marching(known.options, known.near);
        let pixels = backend.render(&through.rays, &marching, Layers::All);
        let error = squared_errors(&pixels, through).into_iter().map(misfit).sum();
        Self { mean: mean(&shown(&pixels, through)), error }
    }
}

/// Gives some bodies of the medium, which are one thing in this region, what makes the mean of what is seen through them that of the
/// photographs, if that is a colour and lowers the error.
pub(super) fn begin_tinted(backend: &mut dyn Backend, known: &Context, region: &Region, bodies: &[usize]) {
    let depth = region.depth();
    if bodies.is_empty() || depth <= 0.0 {
        return;
    }
    let drawn = known.sampler.batch(u64::MAX / 2, 4 * RAYS, Selection::Inside(1.0));
    let through = drawn.filtered(RAYS, |ray| region.meets(ray));
    if through.rays.is_empty() {
        return;
    }
    let tinted = |backend: &mut dyn Backend, tint: [f32; 3]| {
        let mut medium = backend.medium().clone();
        bodies.iter().for_each(|k| medium.medium.region_mut(*k).set_absorption(tint));
        backend.set_medium(medium);
        Seen::new(backend, &through, known)
    };
    let (wanted, clear) = (mean(&through.target), tinted(backend, CLEAR));
    let mut tint = [THICKNESS / depth; 3];
    for _ in 0..STEPS {
        let seen = tinted(backend, tint);
        tint = corrected(tint, [clear.mean, seen.mean, wanted]).map(|t| t.min(DARKEST / depth));
    }
    let [low, high] = tint.iter().fold([f32::MAX, 0.0], |[a, b], t| [a.min(*t), b.max(*t)]);
    let is_colour = high - low > COLOUR * high;
    if !is_colour || tinted(backend, tint).error >= EXPLAINED * clear.error {
        tinted(backend, CLEAR);
    }
}

fn mean(colours: &[[f32; 3]]) -> [f64; 3] {
    let sum = colours.iter().fold([0.0; 3], |s: [f64; 3], v| [0, 1, 2].map(|c| s[c] + f64::from(v[c])));
    sum.map(|s| s / colours.len().max(1) as f64)
}

/// The tint at which a mean is what is wanted, if it falls exponentially from `clear` to `tinted` with this tint; 0 where the
/// body would have to shine.
fn corrected(tint: [f32; 3], [clear, tinted, wanted]: [[f64; 3]; 3]) -> [f32; 3] {
    let of = |c: usize| {
        let (fall, to) = ((clear[c] / tinted[c]).ln(), (clear[c] / wanted[c].max(1e-4)).ln());
        if fall > 0.0 && to > 0.0 { tint[c] * (to / fall) as f32 } else { 0.0 }
    };
    [0, 1, 2].map(of)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::tests::{CUBE, RADIUS, medium, taken};
    use crate::options::Options;
    use crate::schedule::Progress;
    use crate::silhouettes::Site;
    use refraxel_core::{LevelSet, Vec3};
    use refraxel_data::LocalOrigin;

    #[test]
    fn a_mean_that_falls_exponentially_is_met_in_one_step_and_nothing_shines() {
        let clear = [0.8, 0.6, 0.5];
        let at = |tint: [f32; 3]| [0, 1, 2].map(|c| clear[c] * (-0.7 * f64::from(tint[c])).exp());
        let truth = [0.3, 2.0, 0.0];
        let found = corrected([0.5; 3], [clear, at([0.5; 3]), at(truth)]);
        assert!((0..3).all(|c| (found[c] - truth[c]).abs() < 1e-5), "{found:?}");
        assert_eq!(corrected([0.5; 3], [clear, at([0.5; 3]), [0.9, 0.7, 0.6]]), [0.0; 3]);
        let black = corrected([0.5; 3], [[0.0; 3], [0.0; 3], clear]);
        assert_eq!(black, [0.0; 3]);
    }

    #[test]
    fn glass_that_absorbs_has_its_colour_and_clear_glass_has_none() {
        let options = Options::default();
        let distance = |x: Vec3<f32>| x.length() - RADIUS;
        let glass = || medium(LevelSet::from_samples(CUBE, [41; 3], distance), 1.5);
        for truth in [[0.3, 1.5, 3.0], [0.0; 3]] {
            let mut tinted = glass();
            tinted.medium.region_mut(0).set_absorption(truth);
            let (mut backend, sampler) = taken(tinted, |r| r.origin.cross(r.direction).length() < RADIUS);
            let known = Context {
                sampler: &sampler,
                options: &options,
                near: 0.0,
                origin: LocalOrigin::default(),
                index: None,
                found: None,
                progress: Progress(0.0),
            };
            let interpolation = options.index.interpolation.into();
            let region = Region::body(Site { bounds: CUBE, resolution: [41; 3], interpolation }, distance);
            backend.set_medium(glass());
            begin_tinted(&mut backend, &known, &region, &[0]);
            let found = backend.medium().absorption().first().copied().unwrap_or_default();
            let is_near = |(a, b): (&f32, &f32)| (a - b).abs() <= 0.1 * b + if *b > 0.0 { 0.1 } else { 0.0 };
            assert!(found.iter().zip(&truth).all(is_near), "{found:?} {truth:?}");
        }
    }
}
