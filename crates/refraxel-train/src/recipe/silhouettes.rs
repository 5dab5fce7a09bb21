//! Silhouettes of refractive things, with what hides them, and how many views must agree.

use super::{Known, RecipeError};
use crate::backend::{Backend, Layers, Marching};
use crate::cancel::Cancelled;
use crate::events::{Event, IgnoredMask, Task, Watch};
use crate::initial::{Occluders, Outlines, Silhouette, Vote};
use crate::model::Gate;
use crate::options::Options;
use crate::rays::{MaskedView, pixel_ray};
use crate::schedule::training_marching;
use refraxel_core::{Aabb, Camera, Domain, Extent, Ray};

/// Rays through centres of cells that look for what hides refractive things, at most about; with those
/// through parts of cells some per cent more, five times as many at worst.
pub(crate) const OCCLUDER_RAYS: f64 = 3e5;
/// A ray is hidden from where it has lost this share of its light.
const OPAQUE: f32 = 0.5;
/// Shares of the views that must not find a place hidden, tried from the strictest on.
const LEAST: [f32; 6] = [0.9, 0.7, 0.5, 0.35, 0.2, 0.1];
/// Votes that may be overruled at least, tried from the strictest on.
const DISSENT: [usize; 3] = [0, 1, 2];
/// A stricter vote will do when its hull meets this part of the rays inside masks that the loosest one meets.
const COVERED: f64 = 0.98;
/// Nodes along the longest edge of the hulls that votes are compared by.
const VOTED: u32 = 36;
/// Longest edge of the maps that masks are compared with each other on [sample].
const COMPARED: usize = 80;

/// Cameras and masks, with what hides refractive things: the opaque surfaces that straight rays have learned. Masks that
/// contradict the others are left out, which is told as [`Event::MasksIgnored`].
pub(super) fn silhouettes(
    backend: &impl Backend,
    known: &Known,
    watch: &mut Watch,
) -> Result<Vec<Silhouette>, RecipeError> {
    // A ray that ends there tells the depth of what stands in front, however blurred, not of a wall far behind it.
    let marching =
        Marching { min_transmittance: 1.0 - OPAQUE, ..training_marching(known.options, known.near) };
    let views: Vec<MaskedView> = known.sampler.masked_views().collect();
    let pixels = |v: &MaskedView| u64::from(v.mask.width) * u64::from(v.mask.height);
    let cell = Occluders::cell_for(views.iter().map(pixels).sum(), OCCLUDER_RAYS);
    let mut found = Vec::with_capacity(views.len());
    for view in &views {
        watch.progress(Task::FindingOccluders, found.len() as u64, views.len() as u64)?;
        let look = |pixels: &[usize]| occluders(backend, view.camera, pixels, &marching);
        let occluders = Some(Occluders::new(view.mask, cell, look));
        found.push(Silhouette { camera: *view.camera, mask: view.mask.clone(), occluders });
    }
    let bounds = known.options.refraction.aabb().unwrap_or(backend.domain().bounds);
    let names: Vec<&str> = views.iter().map(|v| v.name).collect();
    Ok(consistent(found, &names, &bounds, watch)?)
}

/// The silhouettes without those that contradict the others.
fn consistent(
    all: Vec<Silhouette>,
    names: &[&str],
    bounds: &Aabb<f32>,
    watch: &mut Watch,
) -> Result<Vec<Silhouette>, Cancelled> {
    let outlines = Outlines::with_maps(&all, COMPARED).cancelled_by(watch.cancel());
    let found = outlines.consistency(bounds);
    watch.cancel().check()?;
    let Some(found) = found else { return Ok(all) };
    let ignored = |(view, name): (usize, &&str)| {
        let overlap = found.overlap[view].filter(|_| found.contradicts[view])?;
        Some(IgnoredMask { view: (*name).to_owned(), overlap })
    };
    let views: Vec<IgnoredMask> = names.iter().enumerate().filter_map(ignored).collect();
    if !views.is_empty() {
        watch.tell(Event::MasksIgnored { views, usual_overlap: found.usual });
    }
    Ok(all.into_iter().zip(&found.contradicts).filter(|(_, wrong)| !**wrong).map(|(s, _)| s).collect())
}

/// Per pixel the distance beyond which something opaque hides everything.
fn occluders(backend: &impl Backend, camera: &Camera, pixels: &[usize], marching: &Marching) -> Vec<f32> {
    let rays: Vec<Option<Ray<f32>>> = pixels.iter().map(|&p| pixel_ray(camera, p)).collect();
    let asked: Vec<Ray<f32>> = rays.iter().flatten().copied().collect();
    let mut seen = backend.render(&asked, marching, Layers::All).into_iter();
    let hidden = rays.iter().map(|ray| {
        let seen = ray.and_then(|_| seen.next())?;
        let opacity = 1.0 - seen.transmittance;
        (opacity > OPAQUE).then(|| seen.depth / opacity)
    });
    hidden.map(|d| d.unwrap_or(f32::INFINITY)).collect()
}

/// The strictest vote whose hull still covers what the masks show: which share of the views must not find a place hidden,
/// and how many votes may be overruled at least. Masks that agree need no dissent.
pub(super) fn vote(outlines: &Outlines, rays: &[Ray<f32>], bounds: &Aabb<f32>, options: &Options) -> Vote {
    let vote =
        |dissent: usize, least: f32| Vote { share: options.shape.vote, dissent, least, ..Vote::default() };
    let domain = Domain::with_longest(*bounds, Extent::Bounded, VOTED);
    let covered = |vote: &Vote| {
        let gate = Gate::new(domain, &outlines.hull(&domain, vote).fraction);
        rays.iter().filter(|r| gate.admits(r)).count() as f64
    };
    let dissent = if options.shape.vote < 1.0 { &DISSENT[..] } else { &DISSENT[..1] };
    let loosest = |dissent: usize| vote(dissent, LEAST[LEAST.len() - 1]);
    let reach: Vec<f64> = dissent.iter().map(|&k| covered(&loosest(k))).collect();
    let most = reach.iter().copied().fold(0.0, f64::max);
    let (dissent, reach) =
        dissent.iter().zip(&reach).find(|(_, reach)| **reach >= COVERED * most).unwrap_or((&0, &0.0));
    let enough = COVERED * reach;
    let strictest = LEAST.into_iter().map(|least| vote(*dissent, least)).find(|v| covered(v) >= enough);
    strictest.unwrap_or(vote(*dissent, LEAST[0]))
}

/// Nodes along the longest edge of the hull that says where gaps of masks are closed, and the share of the views that must see
/// a place inside of it.
const BRIDGED: (u32, f32) = (64, 0.8);

/// The outlines without narrow gaps where nearly all other views see glass: what is too thin to be known as an occluder.
pub(super) fn without_gaps(outlines: &Outlines, bounds: &Aabb<f32>, options: &Options) -> Outlines {
    let domain = Domain::with_longest(*bounds, Extent::Bounded, BRIDGED.0);
    let vote = Vote { share: BRIDGED.1, least: LEAST[2], ..Vote::default() };
    let hull = outlines.hull(&domain, &vote);
    // Half a voxel inside.
    let deep: Vec<f32> = hull.distance.iter().map(|d| (-d / domain.voxel()).clamp(0.0, 1.0)).collect();
    let gate = Gate::new(domain, &deep);
    outlines.without_gaps(options.shape.gap, |ray| gate.admits(ray)).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::Cancel;
    use refraxel_core::{Vec3, vec3};
    use refraxel_data::Mask;

    const RADIUS: f64 = 0.5;
    const BOX: Aabb<f32> = Aabb { min: vec3(-0.7, -0.7, -0.7), max: vec3(0.7, 0.7, 0.7) };

    /// Silhouettes of a ball from `count` sides, and the rays inside them.
    fn ball(count: usize) -> (Vec<Silhouette>, Vec<Ray<f32>>) {
        let eye = |i: usize| {
            let z = 1.0 - 2.0 * (i as f64 + 0.5) / count as f64;
            let (r, angle) = ((1.0 - z * z).sqrt(), i as f64 * 2.399_963);
            vec3(r * angle.cos(), r * angle.sin(), z) * 4.0
        };
        let mut rays = Vec::new();
        let view = |i: usize| {
            let camera = Camera::look_at(eye(i), Vec3::zero(), vec3(0.1, 0.2, 1.0), 0.5, [60, 60]);
            let inside = |pixel: usize| {
                let ray: Ray<f64> = camera.ray((pixel % 60) as f64 + 0.5, (pixel / 60) as f64 + 0.5)?;
                let foot = ray.at(-ray.origin.dot(ray.direction));
                (foot.length() < RADIUS).then(|| ray.cast())
            };
            let coverage = (0..3600).map(|p| if inside(p).is_some() { 255 } else { 0 }).collect();
            rays.extend((0..3600).filter_map(inside));
            let mask = Mask { width: 60, height: 60, coverage };
            Silhouette { camera, mask: mask.into(), occluders: None }
        };
        ((0..count).map(view).collect(), rays)
    }

    fn vote_of(views: &[Silhouette], rays: &[Ray<f32>]) -> Vote {
        vote(&Outlines::new(views), rays, &BOX, &Options::default())
    }

    #[test]
    fn masks_that_agree_are_carved_without_dissent_however_few() {
        for count in [12, 30, 60] {
            let (views, rays) = ball(count);
            let vote = vote_of(&views, &rays);
            assert_eq!((vote.dissent, vote.least), (0, LEAST[0]), "{count} views");
        }
    }

    #[test]
    fn one_false_mask_of_twelve_is_overruled_and_two_are() {
        let (mut views, rays) = ball(12);
        for wrong in [3, 8] {
            let mask = std::sync::Arc::make_mut(&mut views[wrong].mask);
            mask.coverage[..1800].fill(0);
            let dissent = vote_of(&views, &rays).dissent;
            assert_eq!(dissent, if wrong == 3 { 1 } else { 2 });
        }
    }

    #[test]
    fn a_mask_that_contradicts_the_others_is_left_out_and_told_by_name() {
        let (mut views, _) = ball(12);
        std::sync::Arc::make_mut(&mut views[7].mask).coverage.fill(0);
        let names: Vec<String> = (0..12).map(|k| format!("r_{k}.png")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (cancel, mut told) = (Cancel::new(), Vec::new());
        let mut observer = |event| told.push(event);
        let kept = consistent(views, &names, &BOX, &mut Watch::new(&cancel, &mut observer)).unwrap();
        assert_eq!(kept.len(), 11);
        let [Event::MasksIgnored { views, usual_overlap }] = told.as_slice() else { panic!("{told:?}") };
        assert_eq!(views, &[IgnoredMask { view: "r_7.png".to_owned(), overlap: 0.0 }]);
        assert!(*usual_overlap > 0.8, "{usual_overlap}");
    }

    #[test]
    fn a_vote_that_must_be_unanimous_stays_so() {
        let (mut views, rays) = ball(12);
        std::sync::Arc::make_mut(&mut views[3].mask).coverage.fill(0);
        let mut options = Options::default();
        options.shape.vote = 1.0;
        assert_eq!(vote(&Outlines::new(&views), &rays, &BOX, &options).dissent, 0);
    }
}
