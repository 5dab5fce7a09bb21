//! Silhouettes of refractive things, with what hides them, and how many views must agree.

use super::context::{Context, SearchError};
use crate::backend::{Backend, Layers, Marching};
use crate::cancel::Cancelled;
use crate::events::{Event, IgnoredMask, Observer, Task};
use crate::model::Gate;
use crate::options::Options;
use crate::rays::{MaskedView, pixel_ray};
use crate::schedule::training_marching;
use crate::silhouettes::{OPAQUE, Occluders, Outlines, Silhouette, Vote, hidden_beyond};
use refraxel_core::{Aabb, Camera, Domain, Extent, Ray};

/// Rays through centres of cells that look for what hides refractive things, at most about; with those
/// through parts of cells some per cent more, five times as many at worst.
pub(crate) const OCCLUDER_RAYS: f64 = 3e5;
/// Shares of the views that must not find a place hidden, from the strictest on.
const LEAST: [f32; 6] = [0.9, 0.8, 0.7, 0.6, 0.5, 0.35];
/// Votes that may be overruled at least, from the strictest on.
const DISSENT: [usize; 3] = [0, 1, 2];
/// A vote that overrules less will do when the agreement of its hull is this part of the best, and one that leaves out less of what
/// hides glass when it is this part: a hull grows into the shadows of what stands around, and what is hidden shows little.
const AGREES: f64 = 0.98;
const HIDDEN_AGREES: f64 = 0.995;
/// Nodes along the longest edge of the hulls that votes are compared by.
const VOTED: u32 = 36;
/// Lines of sight that each of these hulls is compared with the masks along, about.
const COMPARISONS: usize = 100_000;
/// Longest edge of the maps that masks are compared with each other on [sample].
const COMPARED: usize = 80;

/// Cameras and masks, with what hides refractive things: the opaque surfaces that straight rays have learned. Masks that
/// contradict the others are left out, which is told as [`Event::MasksIgnored`].
pub(super) fn silhouettes(
    backend: &dyn Backend,
    known: &Context,
    observer: &mut Observer,
) -> Result<Vec<Silhouette>, SearchError> {
    // A ray that ends there tells the depth of what stands in front, however blurred, not of a wall far behind it.
    let marching =
        Marching { min_transmittance: 1.0 - OPAQUE, ..training_marching(known.options, known.near) };
    let views: Vec<MaskedView> = known.sampler.masked_views().collect();
    let pixels = |v: &MaskedView| u64::from(v.mask.width) * u64::from(v.mask.height);
    let cell = Occluders::cell_for(views.iter().map(pixels).sum(), OCCLUDER_RAYS);
    let mut found = Vec::with_capacity(views.len());
    for view in &views {
        observer.progress(Task::FindingOccluders, found.len() as u64, views.len() as u64)?;
        let look = |pixels: &[usize]| occluders(backend, view.camera, pixels, &marching);
        found.push(Silhouette::of(view, Some(Occluders::new(view.mask, cell, look))));
    }
    let bounds = known.options.refraction.local_box(known.origin).unwrap_or(backend.domain().bounds);
    let names: Vec<&str> = views.iter().map(|v| v.name).collect();
    Ok(consistent(found, &names, &bounds, observer)?)
}

/// The silhouettes without those that contradict the others.
fn consistent(
    all: Vec<Silhouette>,
    names: &[&str],
    bounds: &Aabb<f32>,
    observer: &mut Observer,
) -> Result<Vec<Silhouette>, Cancelled> {
    let outlines = Outlines::with_maps(&all, COMPARED).cancelled_by(observer.cancel());
    let found = outlines.consistency(bounds);
    observer.cancel().check()?;
    let Some(found) = found else { return Ok(all) };
    let ignored = |(view, name): (usize, &&str)| {
        let overlap = found.overlap[view].filter(|_| found.contradicts[view])?;
        Some(IgnoredMask { view: (*name).to_owned(), overlap })
    };
    let views: Vec<IgnoredMask> = names.iter().enumerate().filter_map(ignored).collect();
    if !views.is_empty() {
        observer.tell(Event::MasksIgnored { views, usual_overlap: found.usual });
    }
    Ok(all.into_iter().zip(&found.contradicts).filter(|(_, wrong)| !**wrong).map(|(s, _)| s).collect())
}

/// Per pixel the distance beyond which something opaque hides everything.
pub(super) fn occluders(
    backend: &dyn Backend,
    camera: &Camera,
    pixels: &[usize],
    marching: &Marching,
) -> Vec<f32> {
    let rays: Vec<Option<Ray<f32>>> = pixels.iter().map(|&p| pixel_ray(camera, p)).collect();
    let asked: Vec<Ray<f32>> = rays.iter().flatten().copied().collect();
    let mut seen = backend.render(&asked, marching, Layers::All).into_iter();
    let shown = rays.iter().map(|ray| ray.and_then(|_| seen.next()));
    shown.map(|shown| shown.as_ref().map_or(f32::INFINITY, hidden_beyond)).collect()
}

/// The vote whose hull agrees best with the masks: which share of the views must not find a place hidden, and how many votes
/// may be overruled at least.
///
/// Something opaque in front of glass excuses the views that it hides the glass from, and so does haze that straight rays have
/// learned by mistake. Where the masks are right, glass behind something opaque shows in the other views, and a hull with it
/// agrees better with the masks; a hull that fills the shadows of haze agrees worse. Masks that agree need no dissent.
pub(super) fn vote(outlines: &Outlines, bounds: &Aabb<f32>, options: &Options) -> Vote {
    let domain = Domain::with_longest(*bounds, Extent::Bounded, VOTED);
    let judged = |dissent: usize, least: f32| {
        let vote = Vote { share: options.shape.vote, dissent, least, ..Vote::default() };
        let hull = outlines.gate(domain, &vote);
        (vote, outlines.agreement(&hull, COMPARISONS))
    };
    let strictest = |found: Vec<(Vote, f64)>, enough: f64| {
        let most = enough * found.iter().map(|f| f.1).fold(0.0, f64::max);
        found.into_iter().find(|f| f.1 >= most)
    };
    let dissent = if options.shape.vote < 1.0 { &DISSENT[..] } else { &DISSENT[..1] };
    let best = |d: &usize| strictest(LEAST.map(|least| judged(*d, least)).to_vec(), HIDDEN_AGREES);
    strictest(dissent.iter().filter_map(best).collect(), AGREES).map_or_else(Vote::default, |f| f.0)
}

/// Gaps in masks that are narrower than this are closed where nearly all views see glass: a straw in front of it is too thin to be known
/// as something opaque [part of the longest edge of the picture].
const GAP: f64 = 0.03;
/// Nodes along the longest edge of the hull that says where gaps of masks are closed, and the share of the views that must see
/// a place inside of it.
const BRIDGED: (u32, f32) = (64, 0.8);

/// The outlines without narrow gaps where nearly all other views see glass: what is too thin to be known as an occluder.
pub(super) fn without_gaps(outlines: &Outlines, bounds: &Aabb<f32>) -> Outlines {
    let domain = Domain::with_longest(*bounds, Extent::Bounded, BRIDGED.0);
    let vote = Vote { share: BRIDGED.1, least: 0.5, ..Vote::default() };
    let hull = outlines.hull(&domain, &vote);
    // Half a voxel inside.
    let deep: Vec<f32> = hull.distance.iter().map(|d| (-d / domain.voxel()).clamp(0.0, 1.0)).collect();
    let gate = Gate::new(domain, &deep);
    outlines.without_gaps(GAP, |ray| gate.admits(ray))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::Cancel;
    use crate::silhouettes::around::{self, Ball, cameras_between, first, mask};
    use refraxel_core::vec3;

    const RADIUS: f64 = 0.5;
    const BOX: Aabb<f32> = Aabb { min: vec3(-0.7, -0.7, -0.7), max: vec3(0.7, 0.7, 0.7) };

    /// Silhouettes of a ball from `count` sides.
    fn ball(count: usize) -> Vec<Silhouette> {
        hidden(count, 0.0, &[])
    }

    /// Silhouettes of a ball from `count` sides, whose borders wander by this part of its radius, cut where something opaque is
    /// nearer along a ray.
    fn hidden(count: usize, wander: f64, opaque: &[Ball]) -> Vec<Silhouette> {
        let view = |(i, camera): (usize, Camera)| {
            let shows = |u: f64, v: f64| {
                let radius = RADIUS * (1.0 + wander * (3.0 * (v - 30.0).atan2(u - 30.0) + i as f64).sin());
                let ray = camera.ray(u, v).unwrap();
                let along = -ray.origin.dot(ray.direction);
                ray.at(along).length() < radius && first(opaque, &ray) > along
            };
            let mask = mask(&camera, 1, shows);
            let occluders = Some(around::occluders(&camera, &mask, opaque));
            Silhouette { camera, mask: mask.into(), occluders }
        };
        cameras_between([1.0, -1.0], count, 0.5, 60).into_iter().enumerate().map(view).collect()
    }

    /// The volume of a hull, in that of the ball.
    fn volume(views: &[Silhouette], bounds: Aabb<f32>, vote: &Vote) -> f64 {
        let domain = Domain::with_longest(bounds, Extent::Bounded, 49);
        let hull = Outlines::new(views).hull(&domain, vote);
        hull.volume() / (4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3))
    }

    fn vote_of(views: &[Silhouette]) -> Vote {
        vote(&Outlines::new(views), &BOX, &Options::default())
    }

    #[test]
    fn masks_that_agree_are_carved_without_dissent_however_few() {
        for count in [12, 30, 60] {
            let vote = vote_of(&ball(count));
            assert_eq!((vote.dissent, vote.least), (0, LEAST[0]), "{count} views");
        }
    }

    #[test]
    fn one_false_mask_of_twelve_is_overruled_and_two_are() {
        let mut views = ball(12);
        for wrong in [3, 8] {
            let mask = std::sync::Arc::make_mut(&mut views[wrong].mask);
            mask.coverage[..1800].fill(0);
            let dissent = vote_of(&views).dissent;
            assert_eq!(dissent, if wrong == 3 { 1 } else { 2 });
        }
    }

    #[test]
    fn haze_in_most_views_does_not_fill_the_room() {
        const ROOM: Aabb<f32> = Aabb { min: vec3(-1.0, -1.0, -1.0), max: vec3(1.0, 1.0, 1.0) };
        let mut views = hidden(40, 0.08, &[]);
        for view in views.iter_mut().skip(4) {
            view.occluders = Some(Occluders::new(&view.mask, 1, |pixels| vec![2.0; pixels.len()]));
        }
        let loose = Vote { least: 0.2, share: 0.8, ..Vote::default() };
        assert!(volume(&views, ROOM, &loose) > 1.5);
        let vote = vote(&Outlines::new(&views), &ROOM, &Options::default());
        let found = volume(&views, ROOM, &vote);
        assert!((0.85..1.25).contains(&found), "{found} by {vote:?}");
    }

    #[test]
    fn glass_behind_something_opaque_is_carved_whole() {
        let opaque = [Ball(vec3(1.1, 0.2, 0.1), 0.45), Ball(vec3(-0.6, -0.9, 0.2), 0.4)];
        for wander in [0.0, 0.08] {
            let views = hidden(60, wander, &opaque);
            let vote = vote_of(&views);
            // Borders that wander cost a hull some of its volume with and without something in front.
            let whole = volume(&hidden(60, wander, &[]), BOX, &vote);
            let strict = volume(&views, BOX, &Vote { least: LEAST[0], ..vote });
            let found = volume(&views, BOX, &vote);
            assert!(
                found > 0.95 * whole && found < 1.1 * whole,
                "{found} of {whole}, {strict}, {vote:?}, {wander}"
            );
        }
    }

    #[test]
    fn a_mask_that_contradicts_the_others_is_left_out_and_told_by_name() {
        let mut views = ball(12);
        std::sync::Arc::make_mut(&mut views[7].mask).coverage.fill(0);
        let names: Vec<String> = (0..12).map(|k| format!("r_{k}.png")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (cancel, mut told) = (Cancel::new(), Vec::new());
        let mut observer = |event| told.push(event);
        let kept = consistent(views, &names, &BOX, &mut Observer::new(&cancel, &mut observer)).unwrap();
        assert_eq!(kept.len(), 11);
        let [Event::MasksIgnored { views, usual_overlap }] = told.as_slice() else { panic!("{told:?}") };
        assert_eq!(views, &[IgnoredMask { view: "r_7.png".to_owned(), overlap: 0.0 }]);
        assert!(*usual_overlap > 0.8, "{usual_overlap}");
    }

    #[test]
    fn a_vote_that_must_be_unanimous_stays_so() {
        let mut views = ball(12);
        std::sync::Arc::make_mut(&mut views[3].mask).coverage.fill(0);
        let mut options = Options::default();
        options.shape.vote = 1.0;
        assert_eq!(vote(&Outlines::new(&views), &BOX, &options).dissent, 0);
    }
}
