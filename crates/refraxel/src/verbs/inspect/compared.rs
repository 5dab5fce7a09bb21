//! Each photograph compared with its neighbours.

use super::look::Look;
use super::measures::Measures;
use super::statistics::{median, neighbours};
use refraxel_data::{View, srgb_decode};
use std::collections::HashMap;

/// Linear light below which everything is equally dark: half a level of 255.
const DARKEST: f64 = 0.5 / 255.0 / 12.92;

/// A photograph beside the medians of its neighbours; `None` where one of the two has no such number.
#[derive(Clone, Debug, Default)]
pub struct Compared {
    /// Mean brightness of the neighbours, 1 = white.
    pub brightness: Option<f64>,
    /// How much brighter than its neighbours it is [stop].
    pub stops: Option<f64>,
    /// Sharpness of the neighbours.
    pub sharpness: Option<f64>,
    /// Its sharpness as a part of theirs.
    pub sharpness_ratio: Option<f64>,
    /// White share of the neighbours' masks.
    pub mask: Option<f64>,
    /// Positions of the neighbours in the list of looks.
    pub neighbours: Vec<usize>,
}

/// One for each look; `distance` is that of the cameras from the scene [scene unit].
pub fn compare(views: &[View], looks: &[Look], distance: f64) -> Vec<Compared> {
    let position: HashMap<usize, usize> = looks.iter().enumerate().map(|(k, l)| (l.view, k)).collect();
    let measured: Vec<usize> = looks.iter().filter(|l| l.measures.is_ok()).map(|l| l.view).collect();
    let mut all = vec![Compared::default(); looks.len()];
    for (view, near) in measured.iter().zip(neighbours(views, &measured, distance)) {
        let near: Vec<usize> = near.iter().map(|n| position[n]).collect();
        let here = position[view];
        all[here] = compared(looks, here, near);
    }
    all
}

fn compared(looks: &[Look], here: usize, near: Vec<usize>) -> Compared {
    let Ok(own) = &looks[here].measures else { return Compared::default() };
    let others = || near.iter().filter_map(|&n| looks[n].measures.as_ref().ok());
    let of_all = |number: &dyn Fn(&Measures) -> Option<f64>| median(others().filter_map(number));
    let brightness = of_all(&|m| m.brightness);
    let sharpness = of_all(&|m| m.sharpness);
    let light = |brightness: f64| srgb_decode(brightness).max(DARKEST);
    let stops = own.brightness.zip(brightness).map(|(own, other)| (light(own) / light(other)).log2());
    let sharpness_ratio =
        own.sharpness.zip(sharpness).filter(|(_, s)| *s > 0.0).map(|(own, other)| own / other);
    let mask = of_all(&|m| m.mask.map(|mask| mask.white));
    Compared { brightness, stops, sharpness, sharpness_ratio, mask, neighbours: near }
}
