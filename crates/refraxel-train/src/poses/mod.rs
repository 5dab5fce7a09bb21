//! Poses that learn. Each camera has six numbers that say how far it is from where the data put it; Gauss–Newton steps on the
//! error of its rays, straight or bent, move it, theory (8.1)–(8.5).

mod find;
mod gauge;
mod lens;
mod normal;

pub use find::{find, is_black};
pub use lens::{LensCorrection, LensShift, lens_slopes};

use crate::backend::RayGradient;
use crate::order_statistics::largest_and_median;
use gauge::without_gauge;
use lens::Lenses;
use normal::{NUMBERS, Normal};
use refraxel_core::{Camera, Mat3, Pose, Ray, Vec3};

/// Numbers that say all of a view: where the data put it, its correction and its normal equations.
const PER_VIEW: usize = 12 + 6 + NUMBERS;

/// How far a camera is from where the data put it: R' = exp(ω) R, t' = t + τ, theory (8.1).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// ω: the axis times the angle, in the world [rad].
    pub rotation: Vec3<f64>,
    /// τ [scene unit].
    pub translation: Vec3<f64>,
}

impl Correction {
    /// Where the camera is.
    pub fn of(&self, given: &Pose) -> Pose {
        let rotation = Mat3::turning(self.rotation) * given.rotation;
        Pose { rotation, translation: given.translation + self.translation }
    }

    /// The same in one unit for all six numbers.
    fn numbers(&self, unit: f64) -> [f64; 6] {
        let (r, t) = (self.rotation, self.translation * (1.0 / unit));
        [r.x, r.y, r.z, t.x, t.y, t.z]
    }

    /// A step further, in one unit for all six numbers.
    fn moved(&self, step: &[f64; 6], unit: f64) -> Self {
        let part = |k: usize| Vec3 { x: step[k], y: step[k + 1], z: step[k + 2] };
        Self { rotation: self.rotation + part(0), translation: self.translation + part(3) * unit }
    }
}

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

/// The poses of all training views.
#[derive(Clone, Debug, PartialEq)]
pub struct Poses {
    given: Vec<Pose>,
    /// Distance of the cameras from the scene: what a turn of 1 rad counts like [scene unit].
    unit: f64,
    views: Vec<View>,
    /// Their lenses, if these learn.
    lenses: Option<Lenses>,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct View {
    correction: Correction,
    normal: Normal,
}

/// How far cameras are from where the data put them.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PoseShift {
    /// Largest turn [degree].
    pub largest_turn: f64,
    /// Median turn [degree].
    pub median_turn: f64,
    /// Largest way [scene unit].
    pub largest_way: f64,
    /// Median way [scene unit].
    pub median_way: f64,
    /// How far the lens that has changed most is from what the data say of it, if lenses learn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<LensShift>,
}

impl Poses {
    /// Cameras at such a distance from the scene, where the data put them.
    pub fn new(given: Vec<Pose>, distance: f64) -> Self {
        let views = vec![View::default(); given.len()];
        Self { given, unit: distance, views, lenses: None }
    }

    /// The same, with lenses that learn from what the data say of these cameras, one per view.
    ///
    /// # Panics
    /// If there is not one camera per view.
    #[must_use]
    pub fn with_lenses(self, given: &[Camera]) -> Self {
        assert_eq!(given.len(), self.len(), "one camera per view");
        Self { lenses: Some(Lenses::new(given)), ..self }
    }

    /// The camera of a view, which the data put here.
    pub fn camera(&self, view: usize, given: &Camera) -> Camera {
        Camera { world_from_camera: self.pose(view), ..self.lens(view).of(given) }
    }

    /// How far the lens of a view is from what the data say.
    pub fn lens(&self, view: usize) -> LensCorrection {
        self.lenses.as_ref().map(|l| l.of_view(view)).unwrap_or_default()
    }

    /// Whether lenses learn, too.
    pub fn learns_lenses(&self) -> bool {
        self.lenses.is_some()
    }

    /// Where the camera of a view is.
    pub fn pose(&self, view: usize) -> Pose {
        self.views[view].correction.of(&self.given[view])
    }

    /// How far that is from where the data put them.
    pub fn shift(&self) -> PoseShift {
        let all = || self.views.iter().map(|v| v.correction);
        let [largest_turn, median_turn] = largest_and_median(all().map(|c| c.rotation.length().to_degrees()));
        let [largest_way, median_way] = largest_and_median(all().map(|c| c.translation.length()));
        let lens = self.lenses.as_ref().map(Lenses::shift);
        PoseShift { largest_turn, median_turn, largest_way, median_way, lens }
    }

    /// Takes note of what rays of some views say, and moves the cameras; what all cameras do together is left out, theory (8.5).
    /// Where lenses learn, `slopes` has the [slopes](lens_slopes) of each ray.
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

    /// The same cameras, where the data put them.
    #[must_use]
    pub fn forgotten(&self) -> Self {
        let lenses = self.lenses.as_ref().map(Lenses::forgotten);
        Self { lenses, ..Self::new(self.given.clone(), self.unit) }
    }

    /// Distance of the cameras from the scene [scene unit].
    pub fn unit(&self) -> f64 {
        self.unit
    }

    /// All that there is to know of them but their lenses: the unit, then view by view.
    pub fn to_numbers(&self) -> Vec<f64> {
        let mut all = vec![self.unit];
        for (given, view) in self.given.iter().zip(&self.views) {
            all.extend(given.rotation.rows().as_flattened());
            all.extend(given.translation.to_array());
            all.extend(view.correction.numbers(1.0));
            all.extend(view.normal.numbers());
        }
        all
    }

    /// All that there is to know of their lenses, if these learn.
    pub fn lenses_to_numbers(&self) -> Option<Vec<f64>> {
        self.lenses.as_ref().map(Lenses::to_numbers)
    }

    /// The same poses with the lenses of these numbers; `None` if those make no sense.
    #[must_use]
    pub fn with_lenses_of_numbers(self, numbers: &[f64]) -> Option<Self> {
        let lenses = Lenses::of_numbers(numbers).filter(|l| l.len() == self.len())?;
        Some(Self { lenses: Some(lenses), ..self })
    }

    /// The poses of these numbers, with the lenses of the data; `None` if they make no sense.
    pub fn of_numbers(numbers: &[f64]) -> Option<Self> {
        let (&unit, views) = numbers.split_first()?;
        let is_sound =
            unit > 0.0 && views.len().is_multiple_of(PER_VIEW) && numbers.iter().all(|n| n.is_finite());
        let part = |n: &[f64], first: usize| Vec3 { x: n[first], y: n[first + 1], z: n[first + 2] };
        let given = |n: &[f64]| {
            let rotation = Mat3 { columns: [0, 3, 6].map(|k| part(n, k)) }.transpose();
            Pose { rotation, translation: part(n, 9) }
        };
        let view = |n: &[f64]| View {
            correction: Correction { rotation: part(n, 12), translation: part(n, 15) },
            normal: Normal::of_numbers(std::array::from_fn(|k| n[18 + k])),
        };
        is_sound.then(|| Self {
            given: views.chunks(PER_VIEW).map(given).collect(),
            unit,
            views: views.chunks(PER_VIEW).map(view).collect(),
            lenses: None,
        })
    }

    /// Number of views.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }
}

/// dLoss/d(six numbers) of a ray, theory (8.2): d × ∂L/∂d, and ∂L/∂o in the unit.
fn slope(ray: &Ray<f32>, d: &RayGradient, unit: f64) -> [f64; 6] {
    let turn = ray.direction.cast::<f64>().cross(d.direction.cast());
    let way = d.origin.cast::<f64>() * unit;
    [turn.x, turn.y, turn.z, way.x, way.y, way.z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use refraxel_core::{Camera, vec3};

    /// A coloured plane z = 0: what a ray shows, and dLoss/d(ray) for a target.
    fn shown(ray: &Ray<f32>) -> [f32; 3] {
        let x = ray.at(-ray.origin.z / ray.direction.z);
        [(3.0 * x.x).sin(), (2.0 * x.y + 1.0).sin(), (2.0 * x.x - 3.0 * x.y).cos()].map(|c| 0.5 + 0.3 * c)
    }

    fn gradient(ray: &Ray<f32>, target: [f32; 3]) -> RayGradient {
        let seen = shown(ray);
        let residual = [0, 1, 2].map(|c| seen[c] - target[c]);
        let loss = |ray: &Ray<f32>| {
            let seen = shown(ray);
            (0..3).map(|c| (seen[c] - target[c]).powi(2)).sum::<f32>()
        };
        const H: f32 = 1e-3;
        let mut out = RayGradient { residual, ..RayGradient::zero() };
        for a in 0..3 {
            let moved = |by: f32| {
                let (mut o, mut d) = (*ray, *ray);
                o.origin[a] += by;
                d.direction[a] += by;
                [loss(&o), loss(&d)]
            };
            let (up, down) = (moved(H), moved(-H));
            (out.origin[a], out.direction[a]) =
                ((up[0] - down[0]) / (2.0 * H), (up[1] - down[1]) / (2.0 * H));
        }
        out
    }

    fn cameras() -> Vec<Camera> {
        let around = |k: u32| {
            let angle = 2.0 * f64::from(k);
            let eye = vec3(3.0 * angle.cos(), 3.0 * angle.sin(), 2.5 + 0.2 * f64::from(k % 3));
            Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [40, 40])
        };
        (0..7).map(around).collect()
    }

    fn current(poses: &Poses) -> Vec<Pose> {
        (0..poses.len()).map(|view| poses.pose(view)).collect()
    }

    /// Corrections of half a degree and one part in a hundred, without what all cameras do together.
    fn disturbances(given: &[Pose], unit: f64) -> Vec<Correction> {
        let random = Random::new(4);
        let number = |k: usize, i: u64| random.uniform(k as u64, i) - 0.5;
        let of = |k: usize| Correction {
            rotation: vec3(number(k, 0), number(k, 1), number(k, 2)) * 0.015,
            translation: vec3(number(k, 3), number(k, 4), number(k, 5)) * 0.06,
        };
        let mut all: Vec<Correction> = (0..given.len()).map(of).collect();
        without_gauge(given, unit, true, &mut all);
        all
    }

    #[test]
    fn disturbed_cameras_find_back() {
        let (cameras, unit) = (cameras(), 4.0);
        let truth: Vec<Pose> = cameras.iter().map(|c| c.world_from_camera).collect();
        let off = disturbances(&truth, unit);
        // Given: the true poses moved the other way, so that the corrections found are `off`.
        let given: Vec<Pose> = truth
            .iter()
            .zip(&off)
            .map(|(p, c)| Correction { rotation: -c.rotation, translation: -c.translation }.of(p))
            .collect();
        let (mut poses, random) = (Poses::new(given, unit), Random::new(9));
        let far = |poses: &Poses| {
            let current = current(poses);
            let distance = |(a, b): (&Pose, &Pose)| {
                let turn = (a.rotation.transpose() * b.rotation).rows();
                let angle = (0..3)
                    .map(|i| (0..3).filter(|j| *j != i).map(|j| turn[i][j].powi(2)).sum::<f64>())
                    .sum::<f64>();
                (angle / 2.0).sqrt().max((a.translation - b.translation).length() / unit)
            };
            current.iter().zip(&truth).map(distance).fold(0.0, f64::max)
        };
        let before = far(&poses);
        for step in 0..60 {
            let (mut views, mut rays, mut gradients) = (Vec::new(), Vec::new(), Vec::new());
            let current = current(&poses);
            for k in 0..700_u64 {
                let view = (k % 7) as usize;
                let at = [0, 1].map(|a| 40.0 * random.uniform(step, 2 * k + a));
                let target = shown(&cameras[view].ray(at[0], at[1]).unwrap().cast());
                let moved = Camera { world_from_camera: current[view], ..cameras[view] };
                let ray: Ray<f32> = moved.ray(at[0], at[1]).unwrap().cast();
                views.push(view);
                gradients.push(gradient(&ray, target));
                rays.push(ray);
            }
            poses.learn(&views, &rays, &gradients, &[], PoseRate { memory: 0.7, pixel: 0.01, most: 0.01 });
        }
        let after = far(&poses);
        assert!(before > 4e-3 && after < 0.1 * before, "{before} {after}");
    }

    #[test]
    fn a_wrong_lens_is_found_together_with_wrong_poses() {
        let unit = 4.0;
        let truth = LensCorrection { focal: 0.04, radial: -0.03 };
        let given = cameras();
        let taken: Vec<Camera> = given.iter().map(|c| truth.of(c)).collect();
        let poses: Vec<Pose> = given.iter().map(|c| c.world_from_camera).collect();
        let off = disturbances(&poses, unit);
        let wrong: Vec<Pose> = poses.iter().zip(&off).map(|(p, c)| c.of(p)).collect();
        let random = Random::new(5);
        let mut found = Poses::new(wrong, unit).with_lenses(&given);
        for step in 0..150 {
            let (mut views, mut rays, mut gradients, mut slopes) = (vec![], vec![], vec![], vec![]);
            for k in 0..1400_u64 {
                let view = (k % 7) as usize;
                let at = [0, 1].map(|a| 40.0 * random.uniform(step, 2 * k + a));
                let target = shown(&taken[view].ray(at[0], at[1]).unwrap().cast());
                let camera = found.camera(view, &given[view]);
                let ray: Ray<f32> = camera.ray(at[0], at[1]).unwrap().cast();
                views.push(view);
                gradients.push(gradient(&ray, target));
                slopes.push(lens_slopes(&camera, &ray));
                rays.push(ray);
            }
            let rate = PoseRate { memory: 0.7, pixel: 0.01, most: 0.01 };
            found.learn(&views, &rays, &gradients, &slopes, rate);
        }
        let lens = found.lens(0);
        assert!((lens.focal - truth.focal).abs() < 0.1 * truth.focal, "{lens:?}");
        assert!((lens.radial - truth.radial).abs() < 0.15 * truth.radial.abs(), "{lens:?}");
        let shift = found.shift().lens.unwrap();
        assert!((shift.focal - lens.focal.exp()).abs() < 1e-12 && shift.radial == lens.radial);
        let numbers = (found.to_numbers(), found.lenses_to_numbers().unwrap());
        let again = Poses::of_numbers(&numbers.0).unwrap().with_lenses_of_numbers(&numbers.1);
        assert_eq!(again, Some(found.clone()));
        assert_eq!(found.forgotten().lens(3), LensCorrection::default());
    }

    #[test]
    fn numbers_say_all_of_poses() {
        let given: Vec<Pose> = cameras().iter().map(|c| c.world_from_camera).collect();
        let mut poses = Poses::new(given.clone(), 4.0);
        let ray: Ray<f32> = cameras()[2].ray(10.0, 20.0).unwrap().cast();
        poses.learn(
            &[2],
            &[ray],
            &[gradient(&ray, [0.1, 0.9, 0.4])],
            &[],
            PoseRate { memory: 0.9, pixel: 0.01, most: 0.01 },
        );
        assert_eq!(Poses::of_numbers(&poses.to_numbers()), Some(poses.clone()));
        assert!(poses.shift().largest_turn > 0.0);
        let [few, infinite] = [&[4.0, 0.0][..], &[f64::INFINITY]];
        assert!(Poses::of_numbers(few).is_none() && Poses::of_numbers(infinite).is_none());
        assert_eq!(poses.forgotten(), Poses::new(given, 4.0));
    }
}
