//! How many planes, and which: planes are taken away and added as long as the silhouettes pay for them.

use super::super::contours::{self, View, lines};
use super::boundary::{Boundary, Facet};
use super::fit::{Fit, Miss, Model};
use crate::cancel::Cancel;
use refraxel_core::Vec3;

/// Most planes.
pub(super) const MOST: usize = 72;
/// What a plane must lower the cost by: this squared residual [pixel²] per line of sight, and this multiple
/// of the mean squared residual, which chance alone lowers by three times for three parameters.
const PRICE: [f64; 2] = [1e-3, 20.0];
/// From this number of planes on, a body whose [`score`] is below the other number has no flat faces.
const CLEAR: (usize, f64) = (16, 0.35);
/// Steps of a fit after a plane came or went, and at the end.
const STEPS: [usize; 2] = [6, 30];
/// Rounds of taking away and adding.
const ROUNDS: usize = 4;
/// Planes that are tried in vain before a sweep ends.
const VAIN: usize = 6;
/// Neighbours on each side along the outline over which residuals are averaged.
const NEIGHBOURS: usize = 2;
/// Least excess of the model that a plane is tried against [pixel].
const EXCESS: f64 = 0.1;
/// Places this near to one where a plane was tried in vain are left alone [radius of the body].
const NEAR: f64 = 0.15;

/// The planes that explain what views show best, from some to start with; `None` as soon as it is clear that
/// the body has no flat faces, or somebody wishes to stop.
pub(super) fn search(start: Model, views: &[View], cancel: &Cancel) -> Option<Fit> {
    let mut fit = start.refined(views, STEPS[1]);
    for _ in 0..ROUNDS {
        let before = fit.clone();
        fit = with_missing(without_needless(fit, views, cancel), views, cancel);
        if is_hopeless(&fit, views) || cancel.is_cancelled() {
            return None;
        }
        if before.cost + price(&before, views) * before.model.free as f64
            <= fit.cost + price(&fit, views) * (fit.model.free as f64 + 0.5)
        {
            break;
        }
    }
    Some(without_needless(fit, views, cancel).model.refined(views, STEPS[1]))
}

/// Whether so many planes should follow the contours of a polyhedron better.
fn is_hopeless(fit: &Fit, views: &[View]) -> bool {
    fit.model.free > CLEAR.0 && score(&fit.model, views) < CLEAR.1
}

/// What a plane costs [pixel²].
fn price(fit: &Fit, views: &[View]) -> f64 {
    let touches = lines(views).max(1) as f64;
    (PRICE[0] * touches).max(PRICE[1] * fit.cost / touches)
}

/// Takes planes away, the least needed first.
fn without_needless(mut fit: Fit, views: &[View], cancel: &Cancel) -> Fit {
    let without = |fit: &Fit, k: usize| {
        let mut model = fit.model.clone();
        model.planes.remove(k);
        model.free -= 1;
        model
    };
    let mut kept: Vec<Vec3<f64>> = Vec::new();
    while fit.model.free > 4 && kept.len() < VAIN && !cancel.is_cancelled() {
        let price = price(&fit, views);
        let open = (0..fit.model.free).filter(|&k| !kept.contains(&fit.model.planes[k].normal));
        let costs = open.map(|k| (k, without(&fit, k).cost(views)));
        let Some((k, _)) = costs.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let tried = without(&fit, k).refined(views, STEPS[0]);
        if tried.cost - fit.cost < price && Boundary::of(&tried.model.planes).is_closed() {
            fit = tried;
        } else {
            kept.push(fit.model.planes[k].normal);
        }
    }
    fit
}

/// Adds planes where the model is larger than the silhouettes.
fn with_missing(mut fit: Fit, views: &[View], cancel: &Cancel) -> Fit {
    let mut vain: Vec<Vec3<f64>> = Vec::new();
    while fit.model.free < MOST && vain.len() < VAIN && !is_hopeless(&fit, views) && !cancel.is_cancelled() {
        let Some((facet, at)) = cut(&fit.model.misses(views), views, &vain) else { break };
        let mut model = fit.model.clone();
        model.planes.insert(0, facet);
        model.free += 1;
        let tried = model.refined(views, STEPS[0]);
        if fit.cost - tried.cost > price(&fit, views) {
            fit = tried;
        } else {
            vain.push(at);
        }
    }
    fit
}

/// The tangent plane above which most of the model is, and where, away from where it was tried in vain.
fn cut(misses: &[Vec<Miss>], views: &[View], vain: &[Vec3<f64>]) -> Option<(Facet, Vec3<f64>)> {
    let mut best: Option<(f64, Facet, Vec3<f64>)> = None;
    for (view, misses) in views.iter().zip(misses) {
        for (k, pixels) in smoothed(misses).into_iter().enumerate() {
            let at = misses[k].at;
            let excess = -pixels;
            let is_open = vain.iter().all(|x| (*x - at).length() > NEAR);
            if excess > EXCESS && is_open && best.is_none_or(|b| excess > b.0) {
                let normal = view.touches[k].normal;
                best = Some((excess, Facet { normal, offset: normal.dot(view.eye) }, at));
            }
        }
    }
    best.map(|(_, facet, at)| (facet, at))
}

/// Residuals averaged over neighbours along the outline [pixel].
fn smoothed(misses: &[Miss]) -> Vec<f64> {
    let n = misses.len();
    let width = 2 * NEIGHBOURS + 1;
    let mean = |k: usize| (0..width).map(|i| misses[(k + n + i - NEIGHBOURS) % n].pixels).sum::<f64>();
    if n < width { vec![0.0; n] } else { (0..n).map(|k| mean(k) / width as f64).collect() }
}

/// What of the misses the planes cannot follow [pixel].
pub(super) fn structure(model: &Model, views: &[View]) -> f64 {
    let pixels = |of_view: Vec<Miss>| of_view.iter().map(|miss| miss.pixels).collect();
    contours::structure(model.misses(views).into_iter().map(pixels))
}

/// How much better planes follow the contours than as many would follow those of a ball of the same size: n
/// planes around a ball of radius R [pixel] miss it by 0.5 R/n.
pub(super) fn score(model: &Model, views: &[View]) -> f64 {
    let radius = contours::pixels_per_radius(views);
    (1.0 - structure(model, views) * model.planes.len() as f64 / (0.5 * radius)).max(0.0)
}
