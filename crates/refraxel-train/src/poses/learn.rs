//! What rays say of the cameras that they come from, and how far these move.

use super::correction::Correction;
use super::gauge::without_gauge;
use super::views::{Poses, View};
use crate::backend::RayGradient;
use refraxel_core::{Ray, Vec3};

/// How fast poses learn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseRate {
    /// Share that is kept of what earlier batches said.
    pub memory: f64,
    /// The turn that moves a picture by a pixel [rad].
    pub pixel: f64,
    /// A camera turns by at most so much at a time [rad], and moves by at most so many times its distance from the scene.
    pub most: f64,
}

impl Poses {
    /// Takes note of what rays of some views say, and moves the cameras; what all cameras do together is left out, theory (8.5).
    /// Where lenses learn, `slopes` has the [slopes](super::lens_slopes) of each ray.
    pub fn learn(
        &mut self,
        views: &[usize],
        rays: &[Ray<f32>],
        gradients: &[RayGradient],
        slopes: &[[Vec3<f64>; 2]],
        rate: PoseRate,
    ) {
        self.views.iter_mut().for_each(|v| v.normal.fade(rate.memory));
        self.lenses.iter_mut().for_each(|l| l.fade(rate.memory));
        for (k, ((view, ray), gradient)) in views.iter().zip(rays).zip(gradients).enumerate() {
            let by_pose = slope(ray, gradient, self.unit);
            let counted = self.views[*view].normal.add_squared(by_pose, gradient.residual, rate.pixel);
            if let (Some(lenses), Some(weights), Some(slopes)) = (&mut self.lenses, counted, slopes.get(k)) {
                let by_lens = slopes.map(|s| s.dot(gradient.direction.cast()));
                lenses.add(*view, by_pose, by_lens, weights);
            }
        }
        let unit = self.unit;
        if let Some(lenses) = &mut self.lenses {
            let normals = self.views.iter_mut().map(|v| (&mut v.normal, v.correction.numbers(unit)));
            lenses.learn(&mut normals.collect::<Vec<_>>(), rate.most);
        }
        for (view, View { correction, normal }) in self.views.iter_mut().enumerate() {
            let Some(step) = normal.step(rate.most, Some(correction.numbers(unit))) else { continue };
            normal.moved(&step);
            self.lenses.iter_mut().for_each(|l| l.pose_moved(view, &step));
            *correction = correction.moved(&step, unit);
        }
        let mut all: Vec<Correction> = self.views.iter().map(|v| v.correction).collect();
        // Cameras further away and longer lenses belong together: photographs tell them from a larger scene, if only just.
        without_gauge(&self.given, unit, self.lenses.is_none(), &mut all);
        self.views.iter_mut().zip(all).for_each(|(v, c)| v.correction = c);
    }
}

/// dLoss/d(six numbers) of a ray, theory (8.2): d × ∂L/∂d, and ∂L/∂o in the unit.
pub(super) fn slope(ray: &Ray<f32>, d: &RayGradient, unit: f64) -> [f64; 6] {
    let turn = ray.direction.cast::<f64>().cross(d.direction.cast());
    let way = d.origin.cast::<f64>() * unit;
    [turn.x, turn.y, turn.z, way.x, way.y, way.z]
}
