//! The shapes that a visual hull may be: each is made by one function, from the hull and the views that carved it.

use super::facets::{Face, ends, faces, fills};
use super::hull::{Hull, Views, hulls};
use super::region::{Region, Shape, Water};
use super::shapes::{self, Basin, Contours, Faceted, Levels};
use super::surface::{Form, Stand, Surface};
use crate::cancel::Cancelled;
use crate::model::polyhedron::{Plane, Polyhedron};
use crate::options::{Options, Switch};
use crate::silhouettes::Site;
use refraxel_core::{Aabb, Camera, LevelSet, Vec3};

impl Region {
    /// The bodies of a visual hull, down to what they stand on, with flat faces where they may have some, their surfaces
    /// smoothed. `found` is the box where something is, and `site` makes the grid around a box. Ends early where somebody wishes to
    /// stop.
    pub(super) fn hulls(
        found: &Aabb<f32>,
        site: impl Fn(&Aabb<f32>) -> Site,
        views: &Views,
        ground: impl Fn(&LevelSet<f32>) -> Option<Plane>,
        options: &Options,
    ) -> Result<Vec<Self>, Cancelled> {
        let region = |hull: Hull| {
            let shapes = shapes_of(&hull, options.shape.faces)?;
            Ok(Self { is_shared: hull.is_shared, ..Self::new(hull.site, shapes) })
        };
        hulls(found, site, *views, ground)?.into_iter().map(region).collect()
    }
}

/// What stands where views carve a hull: its surface, and what else may be there. `faces`: it may have flat faces, or be turned.
fn shapes_of(hull: &Hull, faces: Switch) -> Result<Vec<Shape>, Cancelled> {
    let go_on = || hull.views.outlines.cancel().check();
    let under = hull.ground.map(|p| Plane::facing(-p.normal(), -p.offset()));
    let contours = Contours::new(hull.views.outlines, &hull.surface, under.as_ref());
    let round = contours.as_ref().and_then(|c| ellipsoid(hull, c));
    let is_open = round.is_none() && faces.is_on();
    let planes = contours.as_ref().filter(|_| is_open).and_then(|c| polyhedron(hull, c, under.as_ref()));
    go_on()?;
    let turned = if is_open { revolution(hull, contours.as_ref()) } else { None };
    go_on()?;
    let (surface, open) = match (round, turned) {
        (Some(body), _) | (None, Some(Shape::Surface(body))) => (body, [None, None]),
        (None, rival) => (cut(hull, faces), [rival, planes.map(Shape::Polyhedron)]),
    };
    let water = water(hull, surface.stand.as_ref()).map(Shape::Water);
    go_on()?;
    Ok([Some(Shape::Surface(surface)), water].into_iter().chain(open).flatten().collect())
}

/// A body whose outlines leave those of an ellipsoid by at most this part of its radius is taken for one: where masks show them, and
/// where they were found without masks.
const ELLIPSOID: [f64; 2] = [0.01, 0.03];

/// An ellipsoid on what it stands on, if the outlines are those of one.
fn ellipsoid(hull: &Hull, contours: &Contours) -> Option<Surface> {
    let body = shapes::ellipsoid(contours, ELLIPSOID[usize::from(hull.views.are_rough())])?;
    let (base, site) = (hull.base(), &hull.site);
    let under = |x: Vec3<f32>| base.map_or(f32::MIN, |b| b.height(x));
    let distance = |x: Vec3<f32>| (body.distance(x.cast()) as f32).max(under(x));
    let mut level = LevelSet::from_samples(site.bounds, site.resolution, distance);
    level.redistance();
    Some(hull.standing(Surface::new(Form::Ellipsoid(body), level), hull.up()))
}

/// The polyhedron whose outlines these are, sunk into what it stands on.
fn polyhedron(hull: &Hull, contours: &Contours, under: Option<&Plane>) -> Option<Polyhedron> {
    let Faceted { body, .. } = shapes::polyhedron(contours, &hull.surface, under)?;
    Some(Polyhedron { base: hull.base(), ..body })
}

/// A body of revolution between its upper end, if that is flat, and what it stands on, or its lower end where no ground was found: a hull
/// goes on above it as a roof, and below it as a root. It is as wide as the outlines say on the mean. Where they leave it open whether it is
/// one, it is a rival of the hull; rough outlines that do so say nothing.
fn revolution(hull: &Hull, contours: Option<&Contours>) -> Option<Shape> {
    let body = shapes::revolution(&hull.surface, hull.up()?, hull.ground.as_ref())?;
    if hull.views.are_rough() && !body.is_sure {
        return None;
    }
    let (axis, domain) = (body.axis(), hull.site.domain());
    let mut planes = Polyhedron { faces: Vec::new(), base: hull.base() };
    let carved = body.surface(&domain, &planes);
    let [lid, foot] = ends(&carved, hull.views.rays, axis.up);
    planes.faces.extend(lid.into_iter().chain(foot.filter(|_| hull.ground.is_none())));
    let body = contours.map_or(body.clone(), |c| body.widened_to(c, &carved));
    let surface = Surface::new(Form::Revolution(axis), body.surface(&domain, &planes));
    let surface = hull.standing(surface, Some(axis.up));
    Some(if body.is_sure { Shape::Surface(surface) } else { Shape::Rival(surface) })
}

/// Steps and strength of the smoothing of a hull's surface, theory (2.31).
const SMOOTHING: (u32, f32) = (10, 0.6);

/// The hull itself, its surface smoothed, cut by the flat faces that it may have: a polyhedron where these are all of it.
fn cut(hull: &Hull, may_have_faces: Switch) -> Surface {
    let (base, site, mut level) = (hull.base(), &hull.site, hull.surface.clone());
    let faces = if may_have_faces.is_on() {
        // Without what it has grown into the ground.
        faces(&Polyhedron { faces: Vec::new(), base }.cut(&level), hull.views.rays, base.as_ref())
    } else {
        Vec::new()
    };
    for _ in 0..SMOOTHING.0 {
        level.smooth(SMOOTHING.1);
    }
    // After the smoothing: edges stay as sharp as the grid.
    let below = |chosen: &dyn Fn(&Face) -> bool| {
        let faces = faces.iter().filter(|f| chosen(f)).map(|f| f.plane).collect();
        Polyhedron { faces, base }
    };
    let all = below(&|_| true);
    if fills(&all.cut(&level), &all) {
        let level = all.level_set(site.bounds, site.resolution);
        return hull.standing(Surface::new(Form::Polyhedron(all), level), hull.up());
    }
    let large = below(&|f| f.large);
    if large.planes().next().is_some() {
        level = large.cut(&level);
    }
    level.redistance();
    hull.standing(Surface::new(Form::Free, level), hull.up())
}

/// How far water reaches behind what any view shows of its surface [voxel].
const BEYOND: f32 = 3.0;

/// Masks that coincide less at the best level show more than a surface. It was 0.93 for a pool, and at most 0.6 for what is also seen
/// from the side.
const COINCIDE: f64 = 0.75;

/// Water below an open surface, if all views look down on it and see nothing else of it.
fn water(hull: &Hull, stand: Option<&Stand>) -> Option<Water> {
    let up = stand.filter(|_| !hull.is_shared)?.up;
    let (outlines, site) = (hull.views.outlines, &hull.site);
    let basin = Basin { bounds: site.bounds, up, voxel: site.domain().voxel() };
    let Levels { best, range } = basin.levels(outlines)?;
    let above = |c: &Camera| up.dot(c.world_from_camera.translation.cast()) > range[1];
    if best.score < COINCIDE || !outlines.cameras().all(above) {
        return None;
    }
    let highest = basin.water(outlines, range[1], BEYOND * basin.voxel).surface;
    let level = (best.height - range[0]) / (range[1] - range[0]).max(f32::EPSILON);
    Some(Water { highest, up, range, level })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::Cancel;
    use crate::silhouettes::{Outlines, Silhouette, Vote};
    use refraxel_core::vec3;
    use refraxel_data::Mask;

    /// Something in the middle, seen from four sides; some rows of pixels may show that it is two things.
    fn silhouettes(gap: std::ops::Range<u32>) -> Vec<Silhouette> {
        let is_inside =
            |[x, y]: [u32; 2]| (16..48).contains(&x) && (12..52).contains(&y) && !gap.contains(&y);
        let of = |k: u32| {
            let (y, x) = (1.571 * f64::from(k)).sin_cos();
            let camera =
                Camera::look_at(vec3(4.0 * x, 4.0 * y, 0.2), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [64; 2]);
            let coverage = (0..64 * 64).map(|p| if is_inside([p % 64, p / 64]) { 255 } else { 0 }).collect();
            Silhouette { camera, mask: Mask { width: 64, height: 64, coverage }.into(), occluders: None }
        };
        (0..4).map(of).collect()
    }

    fn site(bounds: &Aabb<f32>) -> Site {
        let interpolation = Options::default().index.interpolation.into();
        Site { bounds: *bounds, resolution: [33; 3], interpolation }
    }

    #[test]
    fn outlines_that_were_found_divide_no_body() {
        let (whole, halves) = (silhouettes(0..0), silhouettes(30..36));
        let (outlines, with_gaps) = (Outlines::new(&whole), Outlines::new(&halves));
        let cube = Aabb::cube(1.0);
        let around = LevelSet::from_samples(cube, [9; 3], |x| x.length() - 2.0);
        let bodies = |found| {
            let views =
                Views { outlines: &outlines, with_gaps: &with_gaps, vote: Vote::default(), rays: &[], found };
            Region::hulls(&cube, site, &views, |_| None, &Options::default()).unwrap().len()
        };
        assert_eq!([None, Some(&around)].map(bodies), [2, 1]);
    }

    #[test]
    fn a_wish_to_stop_ends_the_making_of_hulls() {
        let (cancel, options, silhouettes) = (Cancel::new(), Options::default(), silhouettes(0..0));
        let outlines = Outlines::new(&silhouettes).cancelled_by(&cancel);
        let vote = Vote::default();
        let views = Views { outlines: &outlines, with_gaps: &outlines, vote, rays: &[], found: None };
        let cube = Aabb::cube(1.0);
        let hulls = || Region::hulls(&cube, site, &views, |_| None, &options).map(|bodies| bodies.len());
        assert_eq!(hulls(), Ok(1));
        cancel.cancel();
        assert_eq!(hulls(), Err(Cancelled));
    }
}
