//! Where the coordinates of a dataset begin: scenes far from the origin of their world are computed around a nearer one.
//!
//! Single precision tells 2²⁴ steps apart. In a world whose unit is the metre and whose origin is the equator, as in UTM, these are
//! steps of half a metre. So what lies far away is moved, in double precision and before anything else: `local = world − origin`.

use refraxel_core::{Aabb, Camera, Vec3};

/// Scenes farther from the origin of their world than this are moved [longest edge of the box]. Nearer ones stay as they are: single
/// precision places a point there to a thousandth of a voxel, with 512 voxels along that edge.
const FAR: f64 = 50.0;

/// A point of the user's world: (0, 0, 0) of all coordinates of a [`Dataset`](crate::Dataset) and of what is trained on it.
///
/// Everything that a user states or reads is in the world. It passes this border by [`LocalOrigin::to_local`] and [`LocalOrigin::to_world`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LocalOrigin(Vec3<f64>);

/// Something with a place in the world.
pub trait Placed {
    /// The same elsewhere [scene unit].
    #[must_use]
    fn moved(self, by: Vec3<f64>) -> Self;
}

impl LocalOrigin {
    /// The origin at a point of the world.
    pub fn at(world: Vec3<f64>) -> Self {
        Self(world)
    }

    /// The origin for a scene in this box of the world: that of the world, unless the box is far from it. Its coordinates are
    /// multiples of a power of two, so that moving what lies near it rounds nothing.
    pub(crate) fn for_scene(bounds: &Aabb<f64>) -> Self {
        let (middle, longest) = (bounds.center(), bounds.extent().max_element());
        let is_far = middle.map(f64::abs).max_element() > FAR * longest;
        if !(is_far && longest > 0.0 && middle.is_finite()) {
            return Self::default();
        }
        let step = longest.log2().floor().exp2();
        Self(middle.map(|x| (x / step).round() * step))
    }

    /// Whether it is that of the world, so that nothing is moved.
    pub fn is_of_world(self) -> bool {
        self.0 == Vec3::zero()
    }

    /// Its place in the world [scene unit].
    pub fn place(self) -> Vec3<f64> {
        self.0
    }

    /// From the user's world to the coordinates that are computed with.
    pub fn to_local<T: Placed>(self, placed: T) -> T {
        if self.is_of_world() { placed } else { placed.moved(-self.0) }
    }

    /// From the coordinates that are computed with to the user's world.
    pub fn to_world<T: Placed>(self, placed: T) -> T {
        if self.is_of_world() { placed } else { placed.moved(self.0) }
    }
}

impl Placed for Vec3<f64> {
    fn moved(self, by: Vec3<f64>) -> Self {
        self + by
    }
}

impl Placed for Aabb<f64> {
    fn moved(self, by: Vec3<f64>) -> Self {
        Aabb::new(self.min + by, self.max + by)
    }
}

impl Placed for Camera {
    fn moved(mut self, by: Vec3<f64>) -> Self {
        self.world_from_camera.translation += by;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    #[test]
    fn scenes_near_the_origin_of_their_world_stay_as_they_are() {
        for scale in [1e-6, 1.0, 1e6] {
            for center in [vec3(0.0, 0.0, 0.0), vec3(3.0, -40.0, 9.0)] {
                assert!(
                    LocalOrigin::for_scene(&Aabb::cube_at(center * scale, 0.5 * scale)).is_of_world(),
                    "{center:?} {scale}"
                );
            }
        }
        assert!(
            LocalOrigin::for_scene(&Aabb::cube_at(vec3(1.0, 2.0, 3.0), 0.0)).is_of_world(),
            "a box without size"
        );
    }

    #[test]
    fn moving_to_a_far_origin_and_back_rounds_nothing() {
        for (center, edge) in [(vec3(471_233.7, 5_270_141.3, 530.2), 12.0), (vec3(1.0, -2.0, 0.3), 1e-3)] {
            let origin = LocalOrigin::for_scene(&Aabb::cube_at(center, 0.5 * edge));
            assert!((origin.place() - center).map(f64::abs).max_element() <= 0.5 * edge, "{origin:?}");
            for k in 0..100 {
                let t = f64::from(k);
                let x = center + vec3(t.sin(), t.cos(), (0.7 * t).sin()) * edge;
                assert_eq!(origin.to_world(origin.to_local(x)), x);
            }
        }
    }
}
