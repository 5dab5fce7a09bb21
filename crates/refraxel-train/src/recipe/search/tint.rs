//! What the glass of a region absorbs, before its index is known.
//!
//! The mean of what is seen through a body hardly depends on where its rays end: it tells the colour of the glass at a few
//! indices, and their errors tell whether there is any.

use super::{Care, Judge, Search};
use crate::backend::{Backend, Batch};
use crate::cancel::Cancelled;
use crate::recipe::hypotheses::{Candidate, proposals};
use refraxel_core::radiance::Pixel;

/// Indices that are tried: those of water, glass and heavy glass.
const INDICES: [f32; 3] = [1.33, 1.5, 1.75];
/// Optical thickness over the depth of the body to start from, and how often it is corrected.
const THICKNESS: f32 = 0.5;
const STEPS: usize = 2;
/// Largest optical thickness over the depth of the body: nothing is seen through more.
const DARKEST: f32 = 5.0;

/// What absorbs all channels alike, to this part of the most absorbed one, is a thing in clear glass rather than its colour.
const COLOUR: f32 = 0.3;

impl<B: Backend> Search<'_, '_, B> {
    /// Absorption coefficients [1 / scene unit]: as much as makes the mean of what is seen that of the photographs, at the
    /// index that explains them best so. Clear, unless that lowers the error.
    pub(super) fn tint(&mut self, region: usize, judge: &Judge) -> Result<[f32; 3], Cancelled> {
        const CLEAR: [f32; 3] = [0.0; 3];
        let (place, options) = (&self.regions[region], self.options);
        let depth = place.depth();
        if !self.searches() || !options.absorption.enabled.is_on() || depth <= 0.0 {
            return Ok(CLEAR);
        }
        let batch = judge.batch(Care::Through);
        let wanted = mean(batch.target.iter());
        let (mut clear, mut tinted) = (f64::INFINITY, (f64::INFINITY, CLEAR));
        for index in INDICES {
            let mut candidate = Candidate::guess(proposals(place, options)[0], place, options);
            candidate.values[0] = index;
            let shown = self.shown(region, &candidate, judge, Care::Through)?;
            clear = clear.min(judge.error(&shown, Care::Through));
            let before = seen(&shown, batch);
            candidate.tint = [THICKNESS / depth; 3];
            for _ in 0..STEPS {
                let shown = self.shown(region, &candidate, judge, Care::Through)?;
                let tint = corrected(candidate.tint, [before, seen(&shown, batch), wanted]);
                candidate.tint = tint.map(|t| t.min(DARKEST / depth));
            }
            let shown = self.shown(region, &candidate, judge, Care::Through)?;
            let error = judge.error(&shown, Care::Through);
            if error < tinted.0 {
                tinted = (error, candidate.tint);
            }
        }
        let [low, high] = tinted.1.iter().fold([f32::MAX, 0.0], |[a, b], t| [a.min(*t), b.max(*t)]);
        let is_colour = high - low > COLOUR * high;
        Ok(if is_colour && tinted.0 < options.search.tinted * clear { tinted.1 } else { CLEAR })
    }
}

/// Mean colour of what rays show before their own background.
fn seen(shown: &[Pixel<f32>], batch: &Batch) -> [f64; 3] {
    let over = |(k, p): (usize, &Pixel<f32>)| {
        let behind = batch.behind.get(k).copied().unwrap_or_default();
        [0, 1, 2].map(|c| p.colour[c] + p.transmittance * behind[c])
    };
    let colours: Vec<[f32; 3]> = shown.iter().enumerate().map(over).collect();
    mean(colours.iter())
}

fn mean<'a>(colours: impl ExactSizeIterator<Item = &'a [f32; 3]>) -> [f64; 3] {
    let count = colours.len().max(1) as f64;
    let sum = colours.fold([0.0; 3], |s: [f64; 3], v| [0, 1, 2].map(|c| s[c] + f64::from(v[c])));
    sum.map(|s| s / count)
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
}
