//! Lenses that learn: one focal length and one first radial coefficient for all photographs of a lens, theory (8.10)–(8.12).

use super::normal::{Normal, Weights};
use crate::least_squares::solved;
use refraxel_core::{Camera, Lens, Ray, Vec3};

/// Half of the difference of two lenses by which a ray's slopes are taken.
const DIFFERENCE: f64 = 1e-3;
/// Neither number goes further from what the data say.
const FURTHEST: f64 = 0.3;
/// How much what the data say counts beside what rays say.
const PRIOR: f64 = 1e-4;
/// Damping of the equations of a lens.
const DAMPING: f64 = 1e-3;
/// Numbers of a lens, and of a view beside those of its pose.
const PER_LENS: usize = 2;
const PER_VIEW: usize = 1 + 12 + 4 + 2;

/// How far a lens is from what the data say of it, theory (8.10).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LensCorrection {
    /// Natural logarithm of the focal length by that of the data.
    pub focal: f64,
    /// What is added to the first radial coefficient.
    pub radial: f64,
}

/// How far a lens is from what the data say of it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LensShift {
    /// Focal length by that of the data.
    pub focal: f64,
    /// First radial coefficient minus that of the data.
    pub radial: f64,
}

/// The lenses of all training views.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lenses {
    corrections: Vec<LensCorrection>,
    views: Vec<Coupling>,
}

/// What the rays of a view say of its lens, beside what they say of its pose.
#[derive(Clone, Debug, Default, PartialEq)]
struct Coupling {
    lens: usize,
    /// Rows of the mixed second derivatives: by number of the lens, by number of the pose.
    mixed: [[f64; 6]; 2],
    matrix: [[f64; 2]; 2],
    slope: [f64; 2],
}

impl LensCorrection {
    /// The camera with the lens as learned.
    pub fn of(&self, given: &Camera) -> Camera {
        if *self == Self::default() {
            return *given;
        }
        let lens = with_radial(given.lens, self.radial);
        let factor = if given.lens == Lens::Equirectangular { 1.0 } else { self.focal.exp() };
        Camera { focal: given.focal.map(|f| f * factor), lens, ..*given }
    }

    fn moved(&self, [focal, radial]: [f64; 2]) -> Self {
        let within = |x: f64| x.clamp(-FURTHEST, FURTHEST);
        Self { focal: within(self.focal + focal), radial: within(self.radial + radial) }
    }

    fn numbers(&self) -> [f64; 2] {
        [self.focal, self.radial]
    }
}

/// ∂d/∂(ln f, k₁) of a ray of a camera, d being its direction and its pixel fixed; zero where the lens has no such number.
pub fn lens_slopes(camera: &Camera, ray: &Ray<f32>) -> [Vec3<f64>; 2] {
    let pixel = camera.project(ray.origin.cast() + ray.direction.cast());
    [[1.0, 0.0], [0.0, 1.0]].map(|axis| {
        let at = |by: f64| {
            let moved = LensCorrection { focal: by * axis[0], radial: by * axis[1] };
            pixel.and_then(|[u, v]| moved.of(camera).ray(u, v)).map(|r| r.direction)
        };
        let (up, down) = (at(DIFFERENCE), at(-DIFFERENCE));
        up.zip(down).map_or_else(Vec3::zero, |(up, down)| (up - down) * (0.5 / DIFFERENCE))
    })
}

/// The lens with a larger first radial coefficient; unchanged if it has none.
fn with_radial(lens: Lens, by: f64) -> Lens {
    match lens {
        Lens::Pinhole if by != 0.0 => Lens::OpenCv { k: [by, 0.0, 0.0, 0.0], p: [0.0; 2] },
        Lens::OpenCv { k: [k1, k2, k3, k4], p } => Lens::OpenCv { k: [k1 + by, k2, k3, k4], p },
        Lens::FullOpenCv { k: [k1, k2, k3, k4, k5, k6], p } => {
            Lens::FullOpenCv { k: [k1 + by, k2, k3, k4, k5, k6], p }
        }
        Lens::Fisheye { k: [k1, k2, k3, k4] } => Lens::Fisheye { k: [k1 + by, k2, k3, k4] },
        Lens::ThinPrismFisheye { k: [k1, k2, k3, k4], p, s } => {
            Lens::ThinPrismFisheye { k: [k1 + by, k2, k3, k4], p, s }
        }
        Lens::Pinhole | Lens::Fov { .. } | Lens::Equirectangular => lens,
    }
}

impl Lenses {
    /// The lenses of these cameras as the data say: views whose lenses are equal share one.
    pub(super) fn new(cameras: &[Camera]) -> Self {
        let mut kinds: Vec<&Camera> = Vec::new();
        let view = |camera| {
            let known = kinds.iter().position(|k| k.has_lens_of(camera));
            let lens = known.unwrap_or_else(|| {
                kinds.push(camera);
                kinds.len() - 1
            });
            Coupling { lens, ..Coupling::default() }
        };
        let views = cameras.iter().map(view).collect();
        Self { corrections: vec![LensCorrection::default(); kinds.len()], views }
    }

    /// The lens of a view.
    pub(super) fn of_view(&self, view: usize) -> LensCorrection {
        self.corrections[self.views[view].lens]
    }

    /// How far the lens that has moved furthest is from what the data say.
    pub(super) fn shift(&self) -> LensShift {
        let size = |c: &&LensCorrection| c.focal.abs().max(c.radial.abs());
        let furthest = self.corrections.iter().max_by(|a, b| size(a).total_cmp(&size(b)));
        let LensCorrection { focal, radial } = furthest.copied().unwrap_or_default();
        LensShift { focal: focal.exp(), radial }
    }

    /// The same lenses as the data say.
    pub(super) fn forgotten(&self) -> Self {
        Self {
            corrections: vec![LensCorrection::default(); self.corrections.len()],
            views: self.views.iter().map(|v| Coupling { lens: v.lens, ..Coupling::default() }).collect(),
        }
    }

    /// Forgets a part of what earlier batches said.
    pub(super) fn fade(&mut self, kept: f64) {
        for Coupling { mixed, matrix, slope, .. } in &mut self.views {
            mixed.as_flattened_mut().iter_mut().for_each(|m| *m *= kept);
            matrix.as_flattened_mut().iter_mut().chain(slope).for_each(|m| *m *= kept);
        }
    }

    /// A ray of a view by the gradients of its squared error by pose and lens.
    pub(super) fn add(&mut self, view: usize, pose: [f64; 6], lens: [f64; 2], weights: Weights) {
        if lens.iter().any(|s| !s.is_finite()) {
            return;
        }
        let Coupling { mixed, matrix, slope, .. } = &mut self.views[view];
        for i in 0..2 {
            (0..6).for_each(|k| mixed[i][k] += weights.squared * lens[i] * pose[k]);
            (0..2).for_each(|k| matrix[i][k] += weights.squared * lens[i] * lens[k]);
            slope[i] += weights.linear * lens[i];
        }
    }

    /// Moves the lenses to the least error for poses that follow, by at most so much, and tells the model of each pose. `normals`
    /// has what rays say of the pose of a view, and its six numbers.
    pub(super) fn learn(&mut self, normals: &mut [(&mut Normal, [f64; 6])], most: f64) {
        for lens in 0..self.corrections.len() {
            let Some(free) = self.step(lens, normals) else { continue };
            let shorter = (most / free[0].abs().max(free[1].abs())).min(1.0);
            let before = self.corrections[lens];
            let after = before.moved(free.map(|s| shorter * s));
            self.corrections[lens] = after;
            let (from, to) = (before.numbers(), after.numbers());
            let step = [to[0] - from[0], to[1] - from[1]];
            for (view, (normal, _)) in
                self.views.iter_mut().zip(&mut *normals).filter(|(v, _)| v.lens == lens)
            {
                for i in 0..2 {
                    normal.add_slope(&view.mixed[i].map(|m| m * step[i]));
                    view.slope[i] += dot(&view.matrix[i], &step);
                }
            }
        }
    }

    /// The step of a lens to the least error, with the poses of its views at their best for it, theory (8.12).
    fn step(&self, lens: usize, normals: &[(&mut Normal, [f64; 6])]) -> Option<[f64; 2]> {
        let (mut matrix, mut right, mut size) = ([0.0; 4], [0.0; 2], [0.0; 2]);
        for (view, (normal, from)) in self.views.iter().zip(normals).filter(|(v, _)| v.lens == lens) {
            let Some(pose) = normal.least(*from) else { continue };
            for i in 0..2 {
                let Some(follows) = normal.following(&view.mixed[i]) else { continue };
                right[i] -= view.slope[i] + dot(&view.mixed[i], &pose);
                size[i] += view.matrix[i][i];
                for j in 0..2 {
                    matrix[2 * i + j] += view.matrix[i][j] - dot(&view.mixed[j], &follows);
                }
            }
        }
        let from = self.corrections[lens].numbers();
        for i in 0..2 {
            matrix[3 * i] += PRIOR * size[i];
            right[i] -= PRIOR * size[i] * from[i];
        }
        let step = solved(&matrix, &right, DAMPING)?;
        Some([step[0], step[1]])
    }

    /// A view's pose has moved: the same model around where it is now.
    pub(super) fn pose_moved(&mut self, view: usize, step: &[f64; 6]) {
        let Coupling { mixed, slope, .. } = &mut self.views[view];
        (0..2).for_each(|i| slope[i] += dot(&mixed[i], step));
    }

    /// All numbers: how many lenses, each of them, then view by view.
    pub(super) fn to_numbers(&self) -> Vec<f64> {
        let mut all = vec![self.corrections.len() as f64];
        all.extend(self.corrections.iter().flat_map(LensCorrection::numbers));
        for Coupling { lens, mixed, matrix, slope } in &self.views {
            all.push(*lens as f64);
            all.extend(mixed.as_flattened().iter().chain(matrix.as_flattened()).chain(slope));
        }
        all
    }

    /// The lenses of these numbers; `None` if they make no sense.
    pub(super) fn of_numbers(numbers: &[f64]) -> Option<Self> {
        let (&count, rest) = numbers.split_first()?;
        let lenses = count as usize;
        let is_sound = numbers.iter().all(|n| n.is_finite())
            && lenses as f64 == count
            && lenses.checked_mul(PER_LENS).is_some_and(|n| n <= rest.len());
        let (corrections, views) = is_sound.then(|| rest.split_at(lenses * PER_LENS))?;
        let correction = |n: &[f64]| LensCorrection { focal: n[0], radial: n[1] };
        let coupling = |n: &[f64]| {
            let lens = n[0] as usize;
            let part = |first: usize| std::array::from_fn(|k| n[first + k]);
            let mixed = [0, 6].map(|first| std::array::from_fn(|k| n[1 + first + k]));
            let matrix = [0, 2].map(|first| std::array::from_fn(|k| n[13 + first + k]));
            (lens < lenses && lens as f64 == n[0]).then(|| Coupling { lens, mixed, matrix, slope: part(17) })
        };
        let corrections: Vec<_> = corrections.chunks(PER_LENS).map(correction).collect();
        let near = |c: &LensCorrection| c.numbers().iter().all(|n| n.abs() <= FURTHEST);
        let is_whole = views.len().is_multiple_of(PER_VIEW) && corrections.iter().all(near);
        let views = is_whole.then(|| views.chunks(PER_VIEW).map(coupling).collect::<Option<Vec<_>>>())??;
        Some(Self { corrections, views })
    }

    /// Number of views.
    pub(super) fn len(&self) -> usize {
        self.views.len()
    }
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    fn camera(lens: Lens) -> Camera {
        let up = vec3(0.0, 0.0, 1.0);
        Camera { lens, ..Camera::look_at(vec3(3.0, 1.0, 2.0), Vec3::zero(), up, 0.8, [80, 60]) }
    }

    #[test]
    fn the_slopes_of_a_pinhole_are_those_of_its_formula() {
        let camera = camera(Lens::Pinhole);
        for at in [[3.0, 7.0], [40.0, 30.0], [77.5, 50.0]] {
            let [by_focal, by_radial] = lens_slopes(&camera, &camera.ray(at[0], at[1]).unwrap().cast());
            let [x, y] = [0, 1].map(|a| (at[a] - camera.center[a]) / camera.focal[a]);
            let squared = x * x + y * y;
            let rotation = camera.world_from_camera.rotation;
            // p = (x, y, 1): ∂p/∂ln f = −(x, y, 0), and x = x_u (1 + k₁ r²) at k₁ = 0: ∂p/∂k₁ = −r² (x, y, 0).
            let (p, moved) = (rotation * vec3(x, y, 1.0), rotation * vec3(-x, -y, 0.0));
            let d = p.normalized();
            let tangent = (moved - d * d.dot(moved)) * (1.0 / p.length());
            assert!((by_focal - tangent).length() < 1e-6, "{by_focal:?} {tangent:?}");
            assert!((by_radial - tangent * squared).length() < 1e-6, "{by_radial:?}");
        }
    }

    #[test]
    fn a_lens_without_a_number_keeps_it() {
        let correction = LensCorrection { focal: 0.1, radial: 0.05 };
        let sphere = camera(Lens::Equirectangular);
        assert_eq!(correction.of(&sphere), sphere);
        let fov = camera(Lens::Fov { omega: 0.9 });
        assert_eq!(correction.of(&fov).lens, fov.lens);
        let ray = fov.ray(10.0, 10.0).unwrap().cast();
        assert!(lens_slopes(&fov, &ray)[1].length() < 1e-15);
        let bent = correction.of(&camera(Lens::Pinhole));
        assert_eq!(bent.lens, Lens::OpenCv { k: [0.05, 0.0, 0.0, 0.0], p: [0.0; 2] });
    }

    #[test]
    fn equal_lenses_are_one() {
        let (wide, narrow) = (camera(Lens::Pinhole), camera(Lens::Fisheye { k: [0.0; 4] }));
        let mut elsewhere = wide;
        elsewhere.world_from_camera.translation.x += 1.0;
        let lenses = Lenses::new(&[wide, narrow, elsewhere]);
        assert_eq!(lenses.views.iter().map(|v| v.lens).collect::<Vec<_>>(), [0, 1, 0]);
        assert_eq!(Lenses::of_numbers(&lenses.to_numbers()), Some(lenses.clone()));
        let mut wrong = lenses.to_numbers();
        wrong[5] = 2.0;
        assert!(Lenses::of_numbers(&wrong).is_none() && Lenses::of_numbers(&[1e300]).is_none());
    }
}
