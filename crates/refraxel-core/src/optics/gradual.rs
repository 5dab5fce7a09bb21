//! What a smooth transition of the index mirrors, theory (7.11).
//!
//! Forward only: training mirrors at sharp surfaces, where the position and the normal of a surface are known exactly.

use super::fresnel::Incidence;
use super::{Path, Tracer};
use crate::index::VACUUM;
use crate::{Real, Vec3};

/// The part of a transition that one kick stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GradualReflection<T> {
    /// Which segment of the path begins here.
    pub segment: usize,
    /// Where the kick is.
    pub position: Vec3<T>,
    /// Unit direction of the mirrored ray.
    pub direction: Vec3<T>,
    /// Share of the light that is mirrored here. All of one transition add up to one reflectance (7.1).
    pub share: T,
}

impl<T: Real> Tracer<'_, T> {
    /// What smooth transitions on a path mirror, theory (7.11), from the camera on. Nothing where the index is constant;
    /// nothing beyond the critical angle, where the path itself turns round.
    ///
    /// Error: the sum over a transition of any width is that of a sharp surface of the same contrast to 1 %, as far as the
    /// ray keeps its angle to the normal in it.
    pub fn gradual_reflections(&self, path: &Path<T>) -> Vec<GradualReflection<T>> {
        let (mut out, mut reached) = (Vec::new(), T::zero());
        for (segment, (step, of)) in path.steps.iter().zip(&path.segments).enumerate() {
            let grid = &self.medium.regions()[usize::from(step.region)];
            if step.lattice == 0 {
                reached = T::zero(); // between regions
            }
            if step.kick == T::zero() || grid.level_set().is_some() {
                continue;
            }
            let (w, force) = grid.sample(of.start);
            if force.length() == T::zero() {
                continue;
            }
            let normal = force.normalized();
            let p = of.momentum - force * (step.kick * T::of(0.5));
            let r = reflectance_to(w, p.cross(normal).dot(p.cross(normal)));
            let mirrored = p - normal * (T::of(2.0) * p.dot(normal));
            out.push(GradualReflection {
                segment,
                position: of.start,
                direction: mirrored.normalized(),
                share: (r - reached).abs(),
            });
            reached = r;
        }
        out
    }
}

/// R of a sharp surface between vacuum and w, for a ray whose squared tangential momentum is `tangential`; 0 where it would
/// not pass.
fn reflectance_to<T: Real>(w: T, tangential: T) -> T {
    let squares = [T::of(VACUUM), w].map(|w| w + w - tangential);
    if squares.iter().any(|s| *s <= T::zero()) {
        return T::zero();
    }
    let [before, after] = squares.map(T::sqrt);
    Incidence { before, after, w_before: T::of(VACUUM), w_after: w }.reflectance()
}
