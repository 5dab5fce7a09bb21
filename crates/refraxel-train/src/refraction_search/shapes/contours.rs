//! What silhouettes say of a body: lines of sight that touch it.

use crate::cancel::Cancel;
use crate::least_squares::outlier_weight;
use crate::model::polyhedron::Plane;
use crate::silhouettes::{Outlines, Tangent};
use rayon::prelude::*;
use refraxel_core::{LevelSet, Ray, Vec3};

/// Lines of sight per view before those that touch other things are left out, and after.
const TOUCHES: [usize; 2] = [400, 160];
/// Lines of sight must touch the hull within this distance [pixel, and voxel].
const TOUCHING: [f64; 2] = [2.5, 2.5];
/// Least views with contours, and lines of sight in each.
const LEAST: [usize; 2] = [6, 16];
/// Squared residual ρ² [pixel²] that counts half: ψ(ρ) = ρ² / (1 + ρ²/OUTLIER) (Geman & McClure 1985).
pub(super) const OUTLIER: f64 = 16.0;

/// A line of sight that touches the body, seen from a camera whose place is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Unit direction.
    pub direction: Vec3<f64>,
    /// Unit normal of the tangent plane, out of the body.
    pub normal: Vec3<f64>,
    /// Pixels per radian.
    pub per_radian: f64,
}

/// What a view knows of the outline: its lines of sight in their order around it.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub eye: Vec3<f64>,
    pub touches: Vec<Touch>,
}

/// Where a body is and how large: shapes are sought in these units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub center: Vec3<f64>,
    pub radius: f64,
}

/// The contours of a body in all views that show some.
#[derive(Debug)]
pub(in crate::refraction_search) struct Contours {
    pub(super) frame: Frame,
    /// In units of the frame.
    pub(super) views: Vec<View>,
    /// Once cancelled, searches by them end early and mean nothing.
    pub(super) cancel: Cancel,
}

impl Contours {
    /// Where the silhouettes that `outlines` show touch `hull`, which ends at `base`, the plane that the body stands on, normal
    /// downwards; `None` where the views are too few.
    pub(in crate::refraction_search) fn new(
        outlines: &Outlines,
        hull: &LevelSet<f32>,
        base: Option<&Plane>,
    ) -> Option<Self> {
        let frame = Frame::of(hull, base)?;
        let all = outlines.tangents(TOUCHES[0]).into_iter();
        let views: Vec<View> = all.filter_map(|tangents| frame.view(tangents, hull, base)).collect();
        (views.len() >= LEAST[0]).then(|| Self { frame, views, cancel: outlines.cancel().clone() })
    }

    /// The median distance at which the lines of sight that should touch a surface pass outside it [scene unit]; negative where they pass
    /// inside. A hull has nothing that any mask lacks, so rough masks make it too narrow; on average, their borders are in the right place.
    pub(in crate::refraction_search) fn beyond(&self, surface: &LevelSet<f32>) -> f32 {
        let Frame { center, radius } = self.frame;
        let of_view = |view: &View| {
            let origin = center + view.eye * radius;
            let passes = |t: &Touch| {
                let ray = Ray { origin, direction: t.direction }.cast::<f32>();
                let near = self.frame.near(&ray, t.per_radian, surface);
                nearest(&ray, near, surface, None).filter(|phi| f64::from(phi.abs()) < near)
            };
            view.touches.iter().filter_map(passes).collect::<Vec<f32>>()
        };
        let mut all: Vec<f32> = self.views.par_iter().flat_map_iter(of_view).collect();
        all.sort_by(f32::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    }
}

/// Signed distance of the surface, as far as it reaches above `base`, at the point of a ray that is nearest to it or deepest inside, if
/// it comes as near as that.
fn nearest(ray: &Ray<f32>, near: f64, surface: &LevelSet<f32>, base: Option<&Plane>) -> Option<f32> {
    let [from, to] = surface.domain().clip(ray, 0.0)?;
    let steps = ((to - from) / surface.voxel()).ceil() as usize;
    let height = |k: usize| {
        let x = ray.at(from + (to - from) * (k as f32 + 0.5) / steps as f32);
        // Far from the surface, and outside the spline, φ says nothing.
        let is_near = |c: &u8| (f64::from(*c) - 1.0) * f64::from(surface.voxel()) < near;
        let phi = surface.clearance(x).filter(is_near).map_or(f32::MAX, |_| surface.value(x));
        base.map_or(phi, |b| phi.max(b.height(x)))
    };
    Some((0..steps).map(height).fold(f32::MAX, f32::min))
}

/// What a radius of the frame covers in the pictures, the mean over all lines of sight [pixel].
pub(super) fn pixels_per_radius(views: &[View]) -> f64 {
    let scales = views.iter().flat_map(|v| v.touches.iter().map(|t| t.per_radian / v.eye.length()));
    scales.sum::<f64>() / lines(views).max(1) as f64
}

/// Lines of sight in all views.
pub(super) fn lines(views: &[View]) -> usize {
    views.iter().map(|v| v.touches.len()).sum()
}

/// ψ(ρ) [pixel²].
pub(super) fn loss(rho: f64) -> f64 {
    rho * rho / (1.0 + rho * rho / OUTLIER)
}

/// Weight of a squared residual in least squares that lead to the least Σ ψ(ρ): ψ′(ρ) / 2ρ.
pub(super) fn weight(rho: f64) -> f64 {
    outlier_weight(rho * rho, OUTLIER)
}

/// Root mean square of what of the residuals [pixel] is common to neighbours along the outline of each view: noise of
/// single pixels drops out, what the model cannot follow remains. Residuals above 4 pixels count less.
pub(super) fn structure(residuals: impl Iterator<Item = Vec<f64>>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for of_view in residuals {
        let tame: Vec<f64> = of_view.iter().map(|rho| loss(*rho).sqrt() * rho.signum()).collect();
        sum += (0..tame.len()).map(|k| tame[k] * tame[(k + 1) % tame.len()]).sum::<f64>();
        count += tame.len();
    }
    (sum / count.max(1) as f64).max(0.0).sqrt()
}

impl Frame {
    fn of(hull: &LevelSet<f32>, base: Option<&Plane>) -> Option<Self> {
        let is_inside = |j: &usize| hull.coefficients()[*j] < 0.0;
        let above = |x: &Vec3<f32>| base.is_none_or(|b| b.height(*x) < 0.0);
        let nodes = (0..hull.coefficients().len()).filter(is_inside).map(|j| hull.position(j)).filter(above);
        let inside: Vec<Vec3<f64>> = nodes.map(Vec3::cast).collect();
        if inside.is_empty() {
            return None;
        }
        let center = inside.iter().fold(Vec3::zero(), |sum, x| sum + *x) / inside.len() as f64;
        let radius = inside.iter().map(|x| (*x - center).length()).fold(f64::from(hull.voxel()), f64::max);
        Some(Self { center, radius })
    }

    /// The lines of sight that touch the hull, in their order around it.
    fn view(&self, tangents: Vec<Tangent>, hull: &LevelSet<f32>, base: Option<&Plane>) -> Option<View> {
        let mut touching: Vec<Tangent> =
            tangents.into_iter().filter(|t| self.touches(t, hull, base)).collect();
        if touching.len() < LEAST[1] {
            return None;
        }
        let eye = touching[0].ray.origin;
        let axis = touching.iter().fold(Vec3::zero(), |sum, t| sum + t.ray.direction).normalized();
        let u = axis.cross(touching[0].normal).normalized();
        let v = axis.cross(u);
        let angle = |t: &Tangent| v.dot(t.ray.direction).atan2(u.dot(t.ray.direction));
        touching.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        let stride = touching.len().div_ceil(TOUCHES[1]);
        let touch =
            |t: &Tangent| Touch { direction: t.ray.direction, normal: t.normal, per_radian: t.per_radian };
        let touches = touching.iter().step_by(stride).map(touch).collect();
        Some(View { eye: (eye - self.center) / self.radius, touches })
    }

    /// Whether a line of sight comes near the surface of the hull, but no deeper: what hides the body cuts
    /// its silhouette too.
    fn touches(&self, tangent: &Tangent, hull: &LevelSet<f32>, base: Option<&Plane>) -> bool {
        let ray = tangent.ray.cast::<f32>();
        let near = self.near(&ray, tangent.per_radian, hull);
        nearest(&ray, near, hull, base).is_some_and(|least| f64::from(least.abs()) < near)
    }

    /// What is near, for a line of sight [scene unit].
    fn near(&self, ray: &Ray<f32>, per_radian: f64, surface: &LevelSet<f32>) -> f64 {
        let depth = (self.center - ray.origin.cast()).length();
        (TOUCHING[0] * depth / per_radian).max(TOUCHING[1] * f64::from(surface.voxel()))
    }
}
