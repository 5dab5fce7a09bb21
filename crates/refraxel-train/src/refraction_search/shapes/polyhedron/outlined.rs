//! The polyhedron whose outlines are the contours that views show.

use super::super::contours::{Contours, Frame};
use super::super::crowd::{Crowd, Point, points};
use super::boundary::{Boundary, Facet};
use super::fit::Model;
use super::search;
use crate::model::polyhedron::{Plane, Polyhedron};
use refraxel_core::{LevelSet, Vec3};

/// A polyhedron, and how well it explains the silhouettes.
#[derive(Clone, Debug)]
#[cfg_attr(not(test), expect(dead_code, reason = "tests judge the fit by all of it"))]
pub(in crate::refraction_search) struct Faceted {
    /// The planes, the largest face first.
    pub body: Polyhedron,
    /// Area of each face [scene unit²].
    pub areas: Vec<f64>,
    /// Root mean square distance of the contours from the model's outlines, without the noise of single
    /// pixels [pixel].
    pub misfit: f64,
    /// 1: the contours are those of a polyhedron; 0: planes follow them no better than those of a ball. Exact
    /// silhouettes 110 pixels across: twenty faces 1.00, a brilliant 0.97, a cylinder 0.77.
    pub score: f64,
}

/// Polyhedra in antialiased pictures score 0.4 to 0.8, cylinders as well: only what is seen through the body tells them apart.
const LEAST_SCORE: f64 = 0.4;
/// Normals belong together within this angle [cosine], and those within the other belong to no further plane.
const CROWD: [f64; 2] = [0.99, 0.975];
/// Least share of the hull's surface that starts a plane.
const SHARE: f64 = 0.004;
/// Points of the hull's surface that start planes; more are thinned.
const POINTS: usize = 4000;

/// The polyhedron whose silhouettes have these contours, of a body inside of `hull`, which ends at `base`, the plane that the
/// body stands on, normal downwards; `None` where the contours are round, or no planes enclose the hull.
pub(in crate::refraction_search) fn polyhedron(
    contours: &Contours,
    hull: &LevelSet<f32>,
    base: Option<&Plane>,
) -> Option<Faceted> {
    let Contours { frame, views, cancel } = contours;
    let mut planes = frame.crowds(hull, base);
    let free = planes.len();
    planes.extend(base.map(|b| frame.local(b)));
    let start = Model { planes, free };
    if !Boundary::of(&start.planes).is_closed() {
        return None;
    }
    let model = search::search(start, views, cancel)?.model;
    let score = search::score(&model, views);
    (model.free > 0 && score >= LEAST_SCORE)
        .then(|| frame.faceted(&model, search::structure(&model, views), score))
}

impl Frame {
    fn local(&self, plane: &Plane) -> Facet {
        let normal: Vec3<f64> = plane.normal().cast();
        Facet { normal, offset: (f64::from(plane.offset()) - normal.dot(self.center)) / self.radius }
    }

    fn world(&self, facet: &Facet) -> Plane {
        let offset = facet.offset * self.radius + facet.normal.dot(self.center);
        Plane::facing(facet.normal.cast(), offset as f32)
    }

    /// Planes where normals of the hull crowd, the largest crowd first.
    fn crowds(&self, hull: &LevelSet<f32>, base: Option<&Plane>) -> Vec<Facet> {
        let above = |x: Vec3<f32>| base.is_none_or(|b| b.height(x) < 0.0);
        let local = |p: &Point<f32>| {
            let x: Vec3<f64> = p.x.cast();
            Point { x: (x - self.center) / self.radius, normal: p.normal.cast() }
        };
        let all: Vec<Point<f64>> = points(hull, POINTS, above).iter().map(local).collect();
        let mut left = all.clone();
        let least = SHARE * left.len() as f64;
        let mut planes = Vec::new();
        while planes.len() < search::MOST {
            let Some(crowd) = Crowd::densest(&left, CROWD[0]) else { break };
            if (crowd.points.len() as f64) < least {
                break;
            }
            planes.push(Facet { normal: crowd.normal, offset: crowd.offset() });
            left.retain(|p| p.normal.dot(crowd.normal) < CROWD[1]);
        }
        let is_empty = Boundary::of(&planes).area() == 0.0;
        if is_empty {
            // Planes through dents cut everything away: they enclose the hull then.
            let support = |n: Vec3<f64>| all.iter().map(|p| n.dot(p.x)).fold(f64::MIN, f64::max);
            planes.iter_mut().for_each(|p| p.offset = support(p.normal));
        }
        planes
    }

    /// The planes in world coordinates, the largest face first.
    fn faceted(&self, model: &Model, misfit: f64, score: f64) -> Faceted {
        let boundary = Boundary::of(&model.planes);
        let mut order: Vec<usize> = (0..model.free).collect();
        order.sort_by(|&a, &b| boundary.faces[b].area.total_cmp(&boundary.faces[a].area));
        let faces = order.iter().map(|&k| self.world(&model.planes[k])).collect();
        let base = model.planes.get(model.free).map(|b| self.world(b));
        let areas = order.iter().map(|&k| boundary.faces[k].area * self.radius * self.radius).collect();
        Faceted { body: Polyhedron { faces, base }, areas, misfit, score }
    }
}
