//! Datasets whose scene is far from the origin of its world are moved near another one.

use crate::dataset::Problem;
use crate::origin::{LocalOrigin, Placed};
use crate::{Dataset, IndexSource, NamedCamera, scene_region};
use refraxel_core::Vec3;

/// How often the scene is looked at: from far away, cameras that stand close together seem to stand in one place.
const ROUNDS: usize = 2;

/// Positions in steps larger than this are wrong by parts of a voxel [longest edge of the box].
const COARSE: f64 = 1e-4;

impl Dataset {
    /// Moves the coordinates to an origin that somebody states, or to one near the scene where that is far from the origin of the
    /// world.
    pub(crate) fn recentred(self, stated: Option<LocalOrigin>) -> Self {
        let mut data = self.with_origin(stated.unwrap_or_default());
        for _ in 0..if stated.is_none() { ROUNDS } else { 0 } {
            let nearer = LocalOrigin::for_scene(&scene_region(&data).bounds);
            if nearer.is_of_world() {
                break;
            }
            let origin = LocalOrigin::at(data.origin.place() + nearer.place());
            data = data.with_origin(origin);
        }
        if !data.origin.is_of_world() {
            let across = scene_region(&data).bounds.extent().max_element();
            let said = std::iter::once(note(data.origin, across)).chain(rounded(&data, across));
            data.problems.extend(said.collect::<Vec<_>>());
        }
        data
    }

    /// The same data with another [origin](Dataset::origin).
    #[must_use]
    pub fn with_origin(mut self, origin: LocalOrigin) -> Self {
        if origin == self.origin {
            return self;
        }
        let by = self.origin.place() - origin.place();
        self.views.iter_mut().for_each(|view| view.camera = view.camera.moved(by));
        self.points.iter_mut().for_each(|p| *p = p.moved(by));
        self.stated_box = self.stated_box.map(|b| b.moved(by));
        self.origin = origin;
        self
    }
}

/// What is said where coordinates were moved, of a scene that is so large.
fn note(origin: LocalOrigin, across: f64) -> Problem {
    let [x, y, z] = origin.place().to_array();
    Problem::note(format!(
        "the scene is far from the origin of its coordinates: near ({x}, {y}, {z}), and {} across; it is computed relative to that \
         point, and stated, shown and exported in the coordinates of the data",
        about(across)
    ))
}

/// What is said where positions were rounded to single precision far from the origin, before they were written: that is beyond
/// repair.
fn rounded(data: &Dataset, across: f64) -> Option<Problem> {
    let eyes = data.views.iter().map(|view| data.origin.to_world(view.camera.world_from_camera.translation));
    let numbers: Vec<f64> = eyes.flat_map(Vec3::to_array).collect();
    let is_single = numbers.iter().all(|x| f64::from(*x as f32) == *x);
    let farthest = numbers.iter().map(|x| x.abs() as f32).fold(0.0, f32::max);
    let step = farthest.next_up() - farthest;
    (is_single && f64::from(step) > COARSE * across).then(|| {
        Problem::warning(format!(
            "the positions of all cameras are rounded to single precision, in steps of up to {step}, in a scene that is {} across; \
             rays miss by as much: write the poses in double precision, or relative to a point near the scene",
            about(across)
        ))
    })
}

/// A number to three digits.
fn about(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

impl Placed for NamedCamera {
    fn moved(self, by: Vec3<f64>) -> Self {
        Self { camera: self.camera.moved(by), ..self }
    }
}

impl Placed for IndexSource {
    fn moved(self, by: Vec3<f64>) -> Self {
        match self {
            Self::Truth(truth) => Self::Truth(truth.moved(by)),
            Self::Volume(volume) => Self::Volume(volume.moved(by)),
            Self::Mesh(shape) => Self::Mesh(shape.moved(by)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Backdrop, Image, MaskMeaning, Photo, Pixels, PosedPhoto, Split};
    use refraxel_core::{Aabb, Camera, vec3};

    /// Cameras around a target, this far from it.
    fn around(target: Vec3<f64>, distance: f64) -> Dataset {
        let photo = |k: u32| {
            let angle = 0.7 * f64::from(k);
            let eye = target + vec3(angle.cos(), angle.sin(), 0.3) * distance;
            let camera = Camera::look_at(eye, target, vec3(0.0, 0.0, 1.0), 0.7, [4, 4]);
            let image = Image { width: 4, height: 4, channels: 3, pixels: Pixels::U8(vec![200; 48]) };
            let photo = Photo::new(image, None);
            PosedPhoto { name: format!("{k}.png"), camera, photo, mask_meaning: MaskMeaning::Keep }
        };
        let split = Split { train: (0..8).collect(), ..Split::default() };
        Dataset::in_memory((0..8).map(photo).collect(), split, Backdrop::Surroundings).unwrap()
    }

    #[test]
    fn a_scene_far_from_the_origin_is_computed_around_another_and_that_is_said() {
        let utm = vec3(471_233.7, 5_270_141.3, 530.2);
        for distance in [1e-2, 1.0, 300.0] {
            let (near, far) = (around(Vec3::zero(), distance), around(utm, distance));
            assert!(near.origin.is_of_world() && near.problems.is_empty());
            let [x, y, z] = far.origin.place().to_array();
            let said = &far.problems.last().unwrap().message;
            assert!(said.contains(&format!("near ({x}, {y}, {z})")), "{said}");
            assert!(far.problems.iter().all(|p| !p.message.contains("one point")), "{:?}", far.problems);
            let [a, b] = [&near, &far].map(|data| data.origin.to_world(scene_region(data).bounds));
            let rounding = 1e-8 + 1e-6 * distance;
            assert!((b.min - a.min - utm).length() < rounding, "{b:?} {a:?}");
            for (a, b) in near.views.iter().zip(&far.views) {
                let [a, b] = [a, b].map(|view| view.camera.world_from_camera.translation);
                assert!(b.length() < 10.0 * distance, "near the new origin");
                assert!((far.origin.to_world(b) - a - utm).length() < 1e-8, "rounding in f64");
            }
        }
    }

    #[test]
    fn positions_that_were_rounded_before_they_were_written_are_told_of() {
        let far = around(vec3(471_233.7, 5_270_141.3, 530.2), 6.0);
        let coarse = |data: &Dataset| data.problems.iter().any(|p| p.message.contains("steps of up to 0.5"));
        assert!(!coarse(&far));
        let single = |view: &crate::View| {
            let mut camera = far.origin.to_world(view.camera);
            camera.world_from_camera.translation = camera.world_from_camera.translation.cast::<f32>().cast();
            let crate::PhotoSource::Memory(photo) = view.source.clone() else { unreachable!() };
            PosedPhoto { name: view.name.clone(), camera, photo, mask_meaning: MaskMeaning::Keep }
        };
        let photos = far.views.iter().map(single).collect();
        let data = Dataset::in_memory(photos, far.split.clone(), Backdrop::Surroundings).unwrap();
        assert!(coarse(&data), "{:?}", data.problems);
    }

    #[test]
    fn with_another_origin_everything_keeps_its_place_in_the_world() {
        let mut data = around(Vec3::zero(), 2.0);
        data.points = vec![vec3(0.5, 0.25, 0.0)];
        data.stated_box = Some(Aabb::new(Vec3::zero(), vec3(1.0, 1.0, 1.0)));
        let moved = data.clone().with_origin(LocalOrigin::at(vec3(8.0, -4.0, 2.0)));
        assert_eq!(moved.points, [vec3(-7.5, 4.25, -2.0)]);
        assert_eq!(moved.origin.to_world(moved.stated_box.unwrap()), data.stated_box.unwrap());
        let back = moved.with_origin(LocalOrigin::default());
        assert_eq!((back.points, back.stated_box), (data.points, data.stated_box));
    }
}
