//! Which side of masks shows a rigid scene, and which side stands still before the camera.

use crate::looks::{Look, MaskLook};
use crate::rigid::{self, FEWEST, Posed, Score};
use rayon::prelude::*;

/// A photograph and its mask.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub look: &'a Look,
    pub mask: &'a MaskLook,
}

/// The scores of what is white and of what is black, where enough of it has texture.
pub(super) fn sides(seen: &[Seen]) -> [Option<Score>; 2] {
    let posed: Vec<Posed> = seen.iter().map(|s| s.look.posed()).collect();
    let distance = rigid::distance(&posed);
    let of_pair = |(k, other): (usize, usize)| {
        [true, false].map(|white| rigid::gains(posed[k], posed[other], &centres(&seen[k], white), distance))
    };
    let found: Vec<[Vec<f64>; 2]> = rigid::pairs(&posed, 0.0).into_par_iter().map(of_pair).collect();
    [0, 1].map(|side| Score::of(&found.iter().flat_map(|of| of[side].iter().copied()).collect::<Vec<f64>>()))
}

/// How well patches of what is white and of what is black are found at the same pixels of the nearest other view: 1 where nothing moves in
/// the picture.
pub(super) fn stillness(seen: &[Seen]) -> Option<[f64; 2]> {
    let posed: Vec<Posed> = seen.iter().map(|s| s.look.posed()).collect();
    let size = |p: Posed| [p.image.width, p.image.height];
    let pairs = rigid::pairs(&posed, 0.0);
    let of = |white: bool| {
        let comparable = pairs.iter().filter(|(k, other)| size(posed[*k]) == size(posed[*other]));
        let correlations = comparable.flat_map(|&(k, other)| {
            let [from, to] = [posed[k].image, posed[other].image];
            centres(&seen[k], white).into_iter().filter_map(move |at| rigid::alike(from, to, at))
        });
        let all: Vec<f64> = correlations.collect();
        (all.len() >= FEWEST).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    Some([of(true)?, of(false)?])
}

/// Centres of patches that lie on one side.
fn centres(seen: &Seen, white: bool) -> Vec<[i64; 2]> {
    let mask = &seen.mask.small;
    let is_on_side = |[x, y]: [i64; 2]| {
        let c = mask.coverage[(y * i64::from(mask.width) + x) as usize];
        if white { c > 200 } else { c < 55 }
    };
    rigid::centres([mask.width, mask.height], is_on_side)
}
