//! Bodies of revolution that outlines leave open: what is seen through them tells.

use super::hypotheses::{Body, SOLID};
use super::look::{CONVINCING, JUDGED, Look, Seen, Standing, is_better};
use super::region::Region;
use super::shapes::Frustum;
use super::surface::{Form, Stand, Surface};
use crate::cancel::Cancelled;
use crate::events::{Observer, Task};
use crate::evidence::{Best, Detail, Scores, Unknown, firsts, mean, refined};
use crate::silhouettes::Site;
use refraxel_core::LevelSet;

/// A body that may be one of revolution is one if more is seen through that, whatever it is made of; so is one with straight sides.
pub(super) fn revolve(
    at: &Standing,
    region: &mut Region,
    seen: &Seen,
    observer: &mut Observer,
) -> Result<(), Cancelled> {
    let rivals = region.take_rivals();
    // Outlines that no mask shows are rough.
    let is_found = at.known.sampler.traces_found();
    if rivals.is_empty() && !is_found {
        return Ok(());
    }
    let score = |region: &Region, observer: &mut Observer| {
        let mut look = Look::new(region, seen, at.known.options);
        look.stand(at, &[&SOLID], observer)?;
        Ok(at.predicted(&seen.scanned, JUDGED, look.bodies()).scores(&seen.scanned))
    };
    let mut best = score(region, observer)?;
    // So rough that a vessel may pass for an ellipsoid, if nothing is seen through that.
    if mean(&best) > CONVINCING || is_ellipsoid(region) && is_better(&best, &air(at, region, seen)) {
        return Ok(());
    }
    let straight = upright(at, region, seen, is_found, observer)?;
    for surface in rivals.into_iter().chain(straight) {
        let other = region.with(surface);
        let scores = score(&other, observer)?;
        if is_better(&scores, &best) {
            (*region, best) = (other, scores);
        }
    }
    Ok(())
}

/// What air shows in the place of a solid body.
fn air(at: &Standing, region: &Region, seen: &Seen) -> Scores {
    let sketch = region.sketch();
    let surface = sketch.as_ref().unwrap_or(region).surface();
    let body = surface.map(|s| Body::searched(s.level.clone(), 1.0));
    at.predicted(&seen.scanned, JUDGED, body.into_iter().collect()).scores(&seen.scanned)
}

fn is_ellipsoid(region: &Region) -> bool {
    region.surface().is_some_and(|s| matches!(s.form, Form::Ellipsoid(_)))
}

/// Numbers of an upright body with straight sides, and its index. Outlines that were found hardly tell how wide it is and how it stands.
fn of_upright(is_found: bool) -> [Unknown; 7] {
    let place = |name| Unknown::new(name, &[0.0], &[0.1, 0.05, 0.025], [-0.5, 0.5]);
    let tilts: &[f32] = if is_found { &[-0.07, 0.0, 0.07] } else { &[0.0] };
    let tilt = |name| Unknown::new(name, tilts, &[0.06, 0.03, 0.015], [-0.3, 0.3]);
    let widths: &[f32] = if is_found { &[0.7, 0.8, 0.9, 1.0, 1.1] } else { &[0.9, 1.0] };
    [
        Unknown::new("index", &[1.2, 1.33, 1.5, 1.7], &[0.05, 0.03, 0.015], [1.05, 2.5]),
        Unknown::new("width", widths, &[0.05, 0.025, 0.0125], [0.4, 1.3]),
        Unknown::new("slope", &[0.0, 0.12], &[0.08, 0.04, 0.02], [-0.4, 0.4]),
        tilt("tilt"),
        tilt("tilt across"),
        place("place"),
        place("place across"),
    ]
}

/// Where outlines were found, so many of the likely first numbers are followed with the largest steps: some end beside the truth.
const FOLLOWED: usize = 6;

/// Of upright bodies with straight sides the one that scores most, with its index. `score` is told whether few views suffice.
fn scanned(
    rough: &Frustum,
    is_found: bool,
    mut score: impl FnMut((&Frustum, f32), Detail, bool) -> Result<Scores, Cancelled>,
) -> Result<(Frustum, f32), Cancelled> {
    let changed = |v: &[f32]| rough.changed(v[1], v[2], [v[5], v[6]], [v[3], v[4]]);
    let unknowns = of_upright(is_found);
    let mut score = |v: &[f32], detail: Detail, are_few: bool| score((&changed(v), v[0]), detail, are_few);
    let starts = firsts(&unknowns, true, &mut score)?;
    let first_steps = unknowns.each_ref().map(Unknown::begun);
    let mut best: Option<Best> = None;
    for from in starts.iter().take(if is_found { FOLLOWED } else { 1 }) {
        let found = refined(from, &first_steps, Detail::Coarse, |v: &[f32], detail| score(v, detail, false))?;
        if best.as_ref().is_none_or(|b| mean(&found.scores) > mean(&b.scores)) {
            best = Some(found);
        }
    }
    let best = best.unwrap_or_else(|| unreachable!("every unknown has values"));
    let best = refined(&best, &unknowns, JUDGED, |v: &[f32], detail| score(v, detail, false))?;
    Ok((changed(&best.values), best.values[0]))
}

/// An upright body with straight sides through which most is seen.
fn upright(
    at: &Standing,
    region: &Region,
    seen: &Seen,
    is_found: bool,
    observer: &mut Observer,
) -> Result<Option<Surface>, Cancelled> {
    let of = |s: &Surface| Frustum::of(&s.level, s.stand.as_ref()?.up);
    let Some(rough) = region.surface().and_then(of) else { return Ok(None) };
    let sketch = region.sketch();
    let Site { bounds, resolution, .. } = sketch.as_ref().unwrap_or(region).site;
    let mut tried = 0;
    let (shape, _) = scanned(&rough, is_found, |(shape, index), detail, are_few| {
        tried += 1;
        observer.progress(Task::SearchingIndex, tried, tried)?;
        let surface = LevelSet::from_samples(bounds, resolution, |x| shape.distance(x));
        let views = seen.at(are_few);
        Ok(at.predicted(views, detail, vec![Body::searched(surface, index)]).scores(views))
    })?;
    let Site { bounds, resolution, .. } = region.site;
    let level = LevelSet::from_samples(bounds, resolution, |x| shape.distance(x));
    let stand = Some(Stand::new(shape.axis.up, region.sunk()));
    Ok(Some(Surface { stand, ..Surface::new(Form::Revolution(shape.axis), level) }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::tests::{CUBE, MARCHING, medium, photographed};
    use crate::evidence::{Way, predict};
    use refraxel_core::{Vec3, vec3};

    #[test]
    fn an_upright_body_is_found_from_one_that_is_too_wide_and_leans() {
        let up = vec3(0.0, 0.0, 1.0);
        let cylinder = |radius: f32, up: Vec3<f32>| {
            let across = move |x: Vec3<f32>| (x - up * up.dot(x)).length() - radius;
            LevelSet::from_samples(CUBE, [33; 3], |x| across(x).max(up.dot(x).abs() - 0.4))
        };
        let (backend, photographs) = photographed(medium(cylinder(0.3, up), 1.4), 1.15);
        let leaning = vec3(0.06, -0.05, 1.0).normalized();
        let rough = Frustum::of(&cylinder(0.36, leaning), leaning).unwrap();
        let score = |(shape, index): (&Frustum, f32), detail: Detail, _: bool| {
            let surface = LevelSet::from_samples(CUBE, [33; 3], |x| shape.distance(x));
            let of = predict(&backend, &MARCHING, &photographs, detail, &medium(surface, index), Way::Bent);
            Ok(of.scores(&photographs))
        };
        let before = mean(&score((&rough, 1.4), JUDGED, false).unwrap());
        let (found, index) = scanned(&rough, false, score).unwrap();
        let after = mean(&score((&found, index), JUDGED, false).unwrap());
        assert!((index - 1.4).abs() < 0.02, "{index}");
        let off =
            [0.0, 0.2].map(|h| (found.distance(vec3(0.3, 0.0, h)), found.distance(vec3(0.0, -0.3, -h))));
        assert!(off.iter().all(|(a, b)| a.abs() < 0.012 && b.abs() < 0.012), "{off:?} {found:?}");
        assert!(before < 0.4 && after > 0.7, "{before} {after}");
    }
}
