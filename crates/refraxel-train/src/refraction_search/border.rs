//! By how much masks are too narrow or too wide: what straight rays cannot explain ends elsewhere, theory (4.21).

use super::context::Context;
use super::misfit::misfit;
use crate::backend::{Backend, Layers};
use crate::rays::squared_errors;
use crate::schedule::training_marching;

/// Straight rays that will bend leave out pixels that are so near to a mask: masks may be too small, and glass that straight rays have
/// learned as fog hides what stands there [pixel].
pub(crate) const MASK_MARGIN: u32 = 3;
/// Rays near borders.
const RAYS: usize = 32_768;
/// Fewer of them, where hardly any border parts two areas, show nothing.
const LEAST: usize = 500;
/// Borders are sought this much nearer than rays are looked at [pixel].
const ROOM: f32 = 1.5;
/// Steps between places that are tried [pixel].
const STEP: f32 = 0.25;
/// A border that is not further off is where it should be [pixel].
const NEGLIGIBLE: f32 = 0.75;
/// On its inner side the mean misfit must be so much larger, of 1: what is explained on both sides has no border to be seen.
const CONTRAST: f64 = 0.1;
/// And it must explain this much more of the variance than the border of the masks does.
const BETTER: f64 = 1.1;
/// Within this distance [pixel] it must fall by this part of that: where straight rays have learned little yet, it falls slowly all
/// the way from the border outwards.
const SHARP: (f32, f64) = (1.5, 0.7);

/// Where masks should end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Border {
    /// So much further out than they do [pixel].
    pub shift: f32,
    /// Mean misfit of straight rays on its inner and its outer side, of 1.
    pub misfit: [f64; 2],
}

/// Where the border between what straight rays explain and what they do not lies, if that is elsewhere than that of the masks.
pub(crate) fn border(backend: &dyn Backend, known: &Context) -> Option<Border> {
    let options = known.options;
    let reach = 2 * MASK_MARGIN;
    let (batch, away) = known.sampler.near_borders(u64::MAX / 2 + 1, RAYS, reach);
    let shown = backend.render(&batch.rays, &training_marching(options, known.near), Layers::All);
    let misfits = squared_errors(&shown, &batch).into_iter().map(misfit);
    step(away.into_iter().zip(misfits).collect(), reach as f32 - ROOM)
}

/// The step down that explains most of the variance of misfits at distances from the border [pixel, 1], by no more than `most`.
fn step(mut samples: Vec<(f32, f64)>, most: f32) -> Option<Border> {
    if samples.len() < LEAST {
        return None;
    }
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let sums: Vec<f64> =
        samples.iter().scan(0.0, |sum, (_, e)| Some(std::mem::replace(sum, *sum + e))).collect();
    let all = samples.iter().map(|(_, e)| e).sum::<f64>();
    let n = samples.len() as f64;
    let at = |shift: f32| {
        let inner = samples.partition_point(|(away, _)| *away < shift);
        let (sum, k) = (*sums.get(inner)?, inner as f64);
        let misfit = [sum / k, (all - sum) / (n - k)];
        let contrast = misfit[0] - misfit[1];
        let variance = if contrast > 0.0 { k * (n - k) * contrast * contrast } else { 0.0 };
        (k > 0.0).then_some((Border { shift, misfit }, variance))
    };
    let tried = (most / STEP).floor().max(0.0) as i32;
    let places = (-tried..=tried).filter_map(|k| at(STEP * k as f32));
    let (best, variance) = places.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (_, stated) = at(0.0)?;
    let mean = |from: f32, to: f32| {
        let [from, to] = [from, to].map(|a| samples.partition_point(|(away, _)| *away < a));
        samples[from..to].iter().map(|(_, e)| e).sum::<f64>() / (to - from) as f64
    };
    let contrast = best.misfit[0] - best.misfit[1];
    let beside = mean(best.shift - SHARP.0, best.shift) - mean(best.shift, best.shift + SHARP.0);
    let is_seen = contrast >= CONTRAST && beside >= SHARP.1 * contrast && variance >= BETTER * stated;
    (best.shift.abs() > NEGLIGIBLE && is_seen).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Misfits around a border, of these means on both sides.
    fn samples(border: f32, means: [f64; 2]) -> Vec<(f32, f64)> {
        let random = Random::new(5);
        let sample = |k: u64| {
            let away = 12.0 * random.uniform(k, 0) as f32 - 6.0;
            (away, means[usize::from(away >= border)] + 0.3 * (random.uniform(k, 1) - 0.5))
        };
        (0..4000).map(sample).collect()
    }

    #[test]
    fn a_border_is_found_where_misfits_fall() {
        for border in [-3.0, -1.25, 1.5, 3.0, 4.0] {
            let found = step(samples(border, [0.85, 0.45]), 4.5).unwrap();
            assert!((found.shift - border).abs() <= 0.25, "{found:?} for {border}");
            assert!((found.misfit[0] - 0.85).abs() < 0.02 && (found.misfit[1] - 0.45).abs() < 0.02);
        }
    }

    #[test]
    fn a_border_that_is_right_stays_and_so_does_one_that_nothing_shows() {
        assert_eq!(step(samples(0.0, [0.85, 0.45]), 4.5), None);
        assert_eq!(step(samples(0.5, [0.85, 0.45]), 4.5), None, "less than a pixel");
        assert_eq!(step(samples(3.0, [0.5, 0.45]), 4.5), None, "straight rays explain both sides");
        assert_eq!(step(samples(3.0, [0.45, 0.85]), 4.5), None, "the outer side is worse");
        assert_eq!(step(samples(9.0, [0.85, 0.45]), 4.5), None, "no outer side");
        assert_eq!(step(Vec::new(), 4.5), None);
        assert_eq!(step(samples(3.0, [0.85, 0.45]).split_off(4000 - LEAST + 1), 4.5), None, "too few");
    }

    #[test]
    fn misfits_that_fall_slowly_show_no_border() {
        // Straight rays that have learned for ten steps, beside the true border.
        let random = Random::new(6);
        let sample = |k: u64| {
            let away = 12.0 * random.uniform(k, 0) as f32 - 6.0;
            (away, 0.9 - 0.07 * f64::from(away.max(0.0)) + 0.3 * (random.uniform(k, 1) - 0.5))
        };
        assert_eq!(step((0..4000).map(sample).collect(), 4.5), None);
    }
}
