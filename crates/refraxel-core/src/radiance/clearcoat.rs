//! What an opaque thing under a clearcoat mirrors, theory (7.13)–(7.16).
//!
//! A voxel field has no surfaces, but an opaque thing has an edge where light ends: the mean of the density gradient over what
//! a ray sees is its normal. One look into a radiance cache along the mirrored ray stands for all that the clearcoat reflects.

use super::probes::ProbeGrid;
use super::{QuadraturePoint, Segment, mix, mix_vjp};
use crate::field::{FieldGradient, VoxelField};
use crate::optics::fresnel::Incidence;
use crate::sh;
use crate::{Ray, Real, Vec3};

/// Slope of the raw density [1 / voxel] at which half of the reflection is there: fog has no surface.
const LEAST_SLOPE: f64 = 0.25;
/// Cosine at which half of the reflection is there: beyond, the mean of the normals in a pixel says nothing.
const LEAST_COSINE: f64 = 0.05;

/// The surface that a ray ends at: sums over its samples with weights w = T a, theory (7.13).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing<T> {
    /// Σ w: how opaque it is.
    pub opacity: T,
    /// Σ w x / Σ w [scene unit].
    pub position: Vec3<T>,
    /// −h Σ w ∇θ [1 / voxel], outwards.
    pub slope: Vec3<T>,
}

/// What a clearcoat does to a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClearcoatReflection<T> {
    /// Share of the light that is mirrored, for a strength of 1.
    pub share: T,
    /// Unit direction of the mirrored ray.
    pub direction: Vec3<T>,
    /// Unit normal.
    pub normal: Vec3<T>,
}

impl<T: Real> Facing<T> {
    /// Nothing seen yet.
    pub fn nothing() -> Self {
        Self { opacity: T::zero(), position: Vec3::zero(), slope: Vec3::zero() }
    }

    /// One more sample of weight `w` at `x` with h ∇θ = `slope`. The position is a sum until [`Self::finished`].
    #[inline(always)]
    pub fn add(&mut self, w: T, x: Vec3<T>, slope: Vec3<T>) {
        self.opacity += w;
        self.position += x * w;
        self.slope -= slope * w;
    }

    /// The mean in place of the sum; `None` where nothing is seen.
    #[inline(always)]
    pub fn finished(mut self) -> Option<Self> {
        (self.opacity > T::zero()).then(|| {
            self.position = self.position / self.opacity;
            self
        })
    }

    /// What a clearcoat of index `ior` mirrors of a ray in the unit direction `d`, theory (7.14); `None` where the surface faces
    /// away.
    #[inline(always)]
    pub fn reflection(&self, d: Vec3<T>, ior: T) -> Option<ClearcoatReflection<T>> {
        let square = self.slope.dot(self.slope);
        let normal = self.slope / square.sqrt();
        let cosine = -d.dot(normal);
        (square > T::zero() && cosine > T::zero()).then(|| {
            let share = self.opacity * there(square, LEAST_SLOPE).0 * there(cosine * cosine, LEAST_COSINE).0;
            let share = share * incidence(cosine, ior).reflectance();
            ClearcoatReflection { share, direction: d + normal * (T::of(2.0) * cosine), normal }
        })
    }

    /// Transpose of the derivative of [`Self::clearcoat`]: dLoss/d(self) but for the position, and dLoss/dd, given dLoss/dshare and
    /// dLoss/ddirection.
    #[inline(always)]
    pub fn reflection_vjp(&self, d: Vec3<T>, ior: T, d_share: T, d_direction: Vec3<T>) -> (Self, Vec3<T>) {
        let two = T::of(2.0);
        let square = self.slope.dot(self.slope);
        let length = square.sqrt();
        let normal = self.slope / length;
        let cosine = -d.dot(normal);
        let (steep, by_square) = there(square, LEAST_SLOPE);
        let (facing, by_cosine_square) = there(cosine * cosine, LEAST_COSINE);
        let at = incidence(cosine, ior);
        let reflectance = at.reflectance();
        let d_at = at.reflectance_vjp(d_share * self.opacity * steep * facing);
        // after² = n² − 1 + before²
        let mut d_cosine = d_at.before + d_at.after * cosine / at.after;
        d_cosine += d_share * self.opacity * steep * reflectance * by_cosine_square * two * cosine;
        d_cosine += two * normal.dot(d_direction);
        let d_normal = d_direction * (two * cosine) - d * d_cosine;
        let along = normal * normal.dot(d_normal);
        let d_square = d_share * self.opacity * facing * reflectance * by_square;
        let own = Self {
            opacity: d_share * steep * facing * reflectance,
            position: Vec3::zero(),
            slope: (d_normal - along) / length + self.slope * (two * d_square),
        };
        (own, d_direction - normal * d_cosine)
    }

    /// dLoss/dw of a sample at `x` with h ∇θ = `slope`, given dLoss/d(self), theory (7.16).
    #[inline(always)]
    pub fn d_weight(&self, d: &Self, x: Vec3<T>, slope: Vec3<T>) -> T {
        d.opacity + d.position.dot(x - self.position) / self.opacity - d.slope.dot(slope)
    }
}

/// s/(s + e²) for a square s, and its derivative.
#[inline(always)]
fn there<T: Real>(square: T, least: f64) -> (T, T) {
    let floor = T::of(least * least);
    let sum = square + floor;
    (square / sum, floor / (sum * sum))
}

#[inline(always)]
fn incidence<T: Real>(cosine: T, ior: T) -> Incidence<T> {
    let half = T::of(0.5);
    Incidence {
        before: cosine,
        after: (ior * ior - T::one() + cosine * cosine).sqrt(),
        w_before: half,
        w_after: half * ior * ior,
    }
}

/// The clearcoat of everything opaque in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Clearcoat<T> {
    /// Index of the clearcoat.
    pub ior: T,
    /// Red, read as 0 to 1: the share ρ of Fresnel's reflectance that is really seen at a place. Of degree 0.
    pub strength: ProbeGrid<T>,
    /// What surfaces mirror.
    pub radiance: ProbeGrid<T>,
}

impl<T: Real> Clearcoat<T> {
    /// ρ at a place.
    #[inline]
    pub fn strength_at(&self, x: Vec3<T>) -> T {
        let s = self.strength.stencil(x, UP.map(T::of));
        self.strength.radiance(&s)[0].min(T::one())
    }

    /// Keeps the strength of every probe `margin` away from 0 and 1, where it has no slope.
    pub fn bound_strength(&mut self, margin: T) {
        let y = sh::basis(self.strength.degree(), UP.map(T::of))[0];
        let most = (T::of(0.5) - margin) / y;
        let stride = self.strength.stride();
        for probe in self.strength.coefficients.chunks_exact_mut(stride) {
            probe[0] = probe[0].max(-most).min(most);
        }
    }

    /// dLoss/d(red of the strength) given dLoss/dρ: nothing beyond 1.
    #[inline]
    pub fn d_strength(&self, x: Vec3<T>, d_rho: T) -> [T; 3] {
        let s = self.strength.stencil(x, UP.map(T::of));
        let below = self.strength.radiance(&s)[0] < T::one();
        [if below { d_rho } else { T::zero() }, T::zero(), T::zero()]
    }

    /// dLoss/dx through ρ.
    #[inline]
    pub fn strength_vjp(&self, x: Vec3<T>, d_rho: T) -> Vec3<T> {
        let up = UP.map(T::of);
        self.strength.radiance_vjp(&self.strength.stencil(x, up), up, self.d_strength(x, d_rho)).0
    }

    /// dLoss/d(coefficients of the strength): adds to `grad`.
    pub fn scatter_strength(&self, x: Vec3<T>, d_rho: T, grad: &mut [T]) {
        self.strength.scatter(&self.strength.stencil(x, UP.map(T::of)), self.d_strength(x, d_rho), grad);
    }
}

/// A direction: the strength does not depend on any.
const UP: Vec3<f64> = Vec3 { x: 0.0, y: 0.0, z: 1.0 };

/// dLoss/d(everything that [`shown`] depends on) but the field.
#[derive(Clone, Debug, PartialEq)]
pub struct ClearcoatGradient<T> {
    /// With respect to the coefficients of [`Clearcoat::strength`].
    pub strength: Vec<T>,
    /// With respect to the coefficients of [`Clearcoat::radiance`].
    pub radiance: Vec<T>,
}

/// A sample of the reference: weight, what is seen there, and where.
struct Seen<T> {
    ds: T,
    alpha: T,
    before: T,
    colour: [T; 3],
    x: Vec3<T>,
    slope: Vec3<T>,
}

fn samples<T: Real>(field: &VoxelField<T>, s: &Segment<T>, points: &[QuadraturePoint<T>]) -> Vec<Seen<T>> {
    let y = sh::basis(field.degree, s.momentum);
    let mut before = T::one();
    let mut out = Vec::new();
    for q in points {
        let x = s.at(q.t);
        let Some(matter) = field.at(x, &y) else { continue };
        let alpha = -(-matter.density * q.dt).exp_m1();
        let slope = field.raw_slope(x);
        out.push(Seen { ds: q.dt, alpha, before, colour: matter.colour, x, slope });
        before *= T::one() - alpha;
    }
    out
}

fn facing<T: Real>(samples: &[Seen<T>]) -> Option<Facing<T>> {
    let mut sum = Facing::nothing();
    samples.iter().for_each(|s| sum.add(s.before * s.alpha, s.x, s.slope));
    sum.finished()
}

fn over<T: Real>(samples: &[Seen<T>], mut behind: [T; 3]) -> [T; 3] {
    for s in samples.iter().rev() {
        for c in 0..3 {
            behind[c] += s.alpha * (s.colour[c] - behind[c]);
        }
    }
    behind
}

/// What a straight ray shows before `behind` where opaque things are clearcoated: the reference for fast backends.
pub fn shown<T: Real>(
    field: &VoxelField<T>,
    (ray, points): (&Ray<T>, &[QuadraturePoint<T>]),
    clearcoat: &Clearcoat<T>,
    behind: [T; 3],
) -> [T; 3] {
    let Some(segment) = Segment::straight(ray, &field.domain, T::zero()) else { return behind };
    let samples = samples(field, &segment, points);
    let plain = over(&samples, behind);
    let coating = facing(&samples).and_then(|f| Some((f, f.reflection(ray.direction, clearcoat.ior)?)));
    let Some((facing, coating)) = coating else { return plain };
    let mirrored =
        clearcoat.radiance.radiance(&clearcoat.radiance.stencil(facing.position, coating.direction));
    mix(clearcoat.strength_at(facing.position) * coating.share, mirrored, plain)
}

/// Transpose of the derivative of [`shown`] by the field and the clearcoat: adds to both gradients. The points are held fixed.
pub fn shown_vjp<T: Real>(
    field: &VoxelField<T>,
    (ray, points): (&Ray<T>, &[QuadraturePoint<T>]),
    clearcoat: &Clearcoat<T>,
    (behind, d_shown): ([T; 3], [T; 3]),
    (grad, d_clearcoat): (&mut FieldGradient<T>, &mut ClearcoatGradient<T>),
) {
    let Some(segment) = Segment::straight(ray, &field.domain, T::zero()) else { return };
    let (samples, d) = (samples(field, &segment, points), ray.direction);
    let y = sh::basis(field.degree, d);
    let coating = facing(&samples).and_then(|f| Some((f, f.reflection(d, clearcoat.ior)?)));
    let (mut d_plain, mut d_facing) = (d_shown, None);
    if let Some((f, coating)) = coating {
        let stencil = clearcoat.radiance.stencil(f.position, coating.direction);
        let (mirrored, rho) = (clearcoat.radiance.radiance(&stencil), clearcoat.strength_at(f.position));
        let m = mix_vjp(rho * coating.share, mirrored, over(&samples, behind), d_shown);
        d_plain = m.behind;
        clearcoat.radiance.scatter(&stencil, m.mirrored, &mut d_clearcoat.radiance);
        clearcoat.scatter_strength(f.position, m.share * coating.share, &mut d_clearcoat.strength);
        let (d_x, d_direction) = clearcoat.radiance.radiance_vjp(&stencil, coating.direction, m.mirrored);
        let mut own = f.reflection_vjp(d, clearcoat.ior, m.share * rho, d_direction).0;
        own.position = d_x + clearcoat.strength_vjp(f.position, m.share * coating.share);
        d_facing = Some((f, own));
    }
    let (mut behind, mut behind_worth) = (behind, T::zero());
    for s in samples.iter().rev() {
        let d_weight = d_facing.map_or(T::zero(), |(f, own)| f.d_weight(&own, s.x, s.slope));
        let mut contrast = d_weight - behind_worth;
        let mut d_colour = [T::zero(); 3];
        for c in 0..3 {
            contrast += d_plain[c] * (s.colour[c] - behind[c]);
            d_colour[c] = d_plain[c] * s.before * s.alpha;
            behind[c] += s.alpha * (s.colour[c] - behind[c]);
        }
        behind_worth += s.alpha * (d_weight - behind_worth);
        let d_tau = s.before * (T::one() - s.alpha) * contrast;
        let matter = crate::field::Matter { density: d_tau * s.ds, colour: d_colour };
        field.at_vjp(s.x, &y, &matter, grad);
        if let Some((_, own)) = d_facing {
            field.raw_slope_vjp(s.x, own.slope * -(s.before * s.alpha), grad);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{BrickMap, Domain, Extent};
    use crate::index::tests::Sequence;
    use crate::radiance::quadrature;
    use crate::sh::ShDegree;
    use crate::{Aabb, AlignedVec, vec3};

    const BEHIND: [f64; 3] = [0.9, 0.7, 0.4];
    const WEIGHTS: [f64; 3] = [0.8, -0.5, 1.1];

    fn probes(bounds: Aabb<f64>, resolution: u32, degree: u8, seed: u64) -> ProbeGrid<f64> {
        let mut grid = ProbeGrid::grey(bounds, [resolution; 3], ShDegree::new(degree).unwrap());
        let mut r = Sequence(seed);
        grid.coefficients.iter_mut().for_each(|c| *c = 0.2 * r.next());
        grid
    }

    /// Rough matter, and a clearcoat on it.
    fn scene(extent: Extent) -> (VoxelField<f64>, Clearcoat<f64>) {
        let bounds = Aabb::new(vec3(-1.0, -1.2, -0.8), vec3(1.0, 1.2, 0.8));
        let domain = Domain::with_longest(bounds, extent, 11);
        let map = BrickMap::new(domain.resolution, |b| b != [1, 1, 1]);
        let mut f = VoxelField::uniform(domain, map, ShDegree::new(2).unwrap(), -2.0);
        let mut r = Sequence(5);
        f.density.iter_mut().for_each(|v| *v = 2.0 * r.next() - 2.0);
        f.colour.iter_mut().for_each(|v| *v = 0.2 * r.next());
        f.clear_empty_brick();
        (f, Clearcoat { ior: 1.5, strength: probes(bounds, 3, 0, 7), radiance: probes(bounds, 4, 2, 9) })
    }

    fn rays() -> Vec<Ray<f64>> {
        let mut r = Sequence(31);
        let ray = |_| {
            let origin = r.vector().normalized() * 3.0;
            Ray { origin, direction: (r.vector() * 0.5 - origin).normalized() }
        };
        (0..40).map(ray).collect()
    }

    fn loss(
        f: &VoxelField<f64>,
        clearcoat: &Clearcoat<f64>,
        rays: &[(Ray<f64>, Vec<QuadraturePoint<f64>>)],
    ) -> f64 {
        let of = |(ray, points): &(Ray<f64>, Vec<_>)| {
            let shown = shown(f, (ray, points), clearcoat, BEHIND);
            (0..3).map(|c| WEIGHTS[c] * shown[c]).sum::<f64>()
        };
        rays.iter().map(of).sum()
    }

    #[test]
    fn gradients_match_central_differences() {
        for extent in [Extent::Bounded, Extent::Contracted] {
            let (mut f, mut clearcoat) = scene(extent);
            let points = |ray: Ray<f64>| {
                let path = Segment::straight(&ray, &f.domain, 0.0);
                (ray, path.map_or(Vec::new(), |s| quadrature(&f.domain, &[s], 0.05, 0.3)))
            };
            let rays: Vec<_> = rays().into_iter().map(points).collect();
            let mut grad = f.zero_gradient();
            let zeros = |g: &ProbeGrid<f64>| vec![0.0; g.coefficients.len()];
            let mut of_clearcoat = ClearcoatGradient {
                strength: zeros(&clearcoat.strength),
                radiance: zeros(&clearcoat.radiance),
            };
            for (ray, points) in &rays {
                shown_vjp(&f, (ray, points), &clearcoat, (BEHIND, WEIGHTS), (&mut grad, &mut of_clearcoat));
            }
            let size = |g: &[f64]| g.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let e = 1e-6;
            let close =
                |fd: f64, got: f64, size: f64| assert!((fd - got).abs() < 1e-6 * size, "{fd} vs {got}");
            for j in (64..f.density.len()).step_by(7) {
                let mut at = |d: f64| {
                    f.density[j] += d;
                    let l = loss(&f, &clearcoat, &rays);
                    f.density[j] -= d;
                    l
                };
                close((at(e) - at(-e)) / (2.0 * e), grad.density[j], size(&grad.density));
            }
            for j in 0..clearcoat.strength.coefficients.len() {
                let mut at = |d: f64| {
                    clearcoat.strength.coefficients[j] += d;
                    let l = loss(&f, &clearcoat, &rays);
                    clearcoat.strength.coefficients[j] -= d;
                    l
                };
                close((at(e) - at(-e)) / (2.0 * e), of_clearcoat.strength[j], size(&of_clearcoat.strength));
            }
            for j in (0..clearcoat.radiance.coefficients.len()).step_by(11) {
                let mut at = |d: f64| {
                    clearcoat.radiance.coefficients[j] += d;
                    let l = loss(&f, &clearcoat, &rays);
                    clearcoat.radiance.coefficients[j] -= d;
                    l
                };
                close((at(e) - at(-e)) / (2.0 * e), of_clearcoat.radiance[j], size(&of_clearcoat.radiance));
            }
            assert!(size(&of_clearcoat.strength) > 1e-3 && size(&of_clearcoat.radiance) > 1e-3);
        }
    }

    /// An opaque ball of radius ½ with an edge of some voxels, on a grid of so many nodes.
    fn ball(nodes: u32, edge: f64) -> VoxelField<f64> {
        let cube = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let domain = Domain::with_longest(cube, Extent::Bounded, nodes);
        let map = BrickMap::dense(domain.resolution);
        let mut f = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), -10.0);
        for slot in 1..f.map.slots() {
            let brick = f.map.brick_of(slot as u32);
            for local in 0..64_usize {
                let at = [local & 3, local >> 2 & 3, local >> 4];
                let node = [0, 1, 2].map(|a| f64::from(4 * brick[a] + at[a] as u32));
                let depth = 0.5 - f.domain.position(Vec3::from(node)).length();
                let theta = 20.0 * (depth / (edge * f.domain.voxel())).clamp(-0.5, 0.5);
                f.density[slot * 64 + local] = theta;
            }
        }
        f
    }

    #[test]
    fn one_edge_mirrors_one_reflectance_whatever_the_voxels_and_its_width() {
        // Trilinear normals waver within a voxel: the mean over rays up to 40° from the normal.
        for (nodes, edge) in [(32, 3.0), (64, 3.0), (64, 5.0), (96, 4.0)] {
            let f = ball(nodes, edge);
            let (mut sum, mut r) = (0.0, Sequence(3));
            for _ in 0..200 {
                let d = r.vector().normalized();
                let aside = d.cross(r.vector()).normalized() * (0.32 * r.next());
                let ray = Ray { origin: aside - d * 3.0, direction: d };
                let s = Segment::straight(&ray, &f.domain, 0.0).unwrap();
                let points = quadrature(&f.domain, &[s], 0.25 * f.domain.voxel(), 0.5);
                let facing = facing(&samples(&f, &s, &points)).unwrap();
                assert!((facing.opacity - 1.0).abs() < 1e-3);
                let sine = aside.length() / facing.position.length();
                let exact = incidence((1.0 - sine * sine).sqrt(), 1.5).reflectance();
                sum += facing.reflection(d, 1.5).unwrap().share / exact / 200.0;
            }
            assert!((sum - 1.0).abs() < 0.01, "{nodes} nodes, edge of {edge} voxels: {sum}");
        }
    }

    #[test]
    fn fog_mirrors_nothing_and_what_is_mirrored_takes_from_the_rest() {
        let cube = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let domain = Domain::with_longest(cube, Extent::Bounded, 33);
        let fog =
            VoxelField::uniform(domain, BrickMap::dense(domain.resolution), ShDegree::new(0).unwrap(), 3.0);
        let ray = Ray { origin: vec3(0.0, 0.0, 3.0), direction: vec3(0.0, 0.0, -1.0) };
        let s = Segment::straight(&ray, &domain, 0.0).unwrap();
        let points = quadrature(&domain, &[s], 0.05, 0.5);
        let facing = facing(&samples(&fog, &s, &points)).unwrap();
        assert!(facing.opacity > 0.99 && facing.reflection(ray.direction, 1.5).is_none());
        // Between equal lights a clearcoat is invisible.
        let mut grey = ball(32, 2.0);
        grey.colour = AlignedVec::filled(grey.colour.len(), 0.0);
        let even = |degree: u8| ProbeGrid::grey(cube, [2; 3], ShDegree::new(degree).unwrap());
        let clearcoat = Clearcoat { ior: 1.5, strength: even(0), radiance: even(1) };
        let shown = shown(&grey, (&ray, &quadrature(&grey.domain, &[s], 0.02, 0.5)), &clearcoat, [0.5; 3]);
        assert!(shown.iter().all(|v| (v - 0.5).abs() < 1e-6), "{shown:?}");
    }
}
