//! Bodies and media at another place of the world.

use super::medium::Index;
use super::scene::{Body, Matter};
use super::shape::{
    Cuboid, Cylinder, HeightField, Implicit, Plane, Polyhedron, Primitive, Rectangle, Shape, Sphere, Wave,
};
use crate::origin::Placed;
use refraxel_core::Vec3;

impl Placed for Body {
    fn moved(self, by: Vec3<f64>) -> Self {
        let matter = match self.matter {
            Matter::Refractive { mut medium, priority, visible } => {
                medium.index = medium.index.moved(by);
                Matter::Refractive { medium, priority, visible: visible.map(|shape| shape.moved(by)) }
            }
            opaque => opaque,
        };
        Self { shape: self.shape.moved(by), matter, ..self }
    }
}

impl Placed for Index {
    fn moved(mut self, by: Vec3<f64>) -> Self {
        match &mut self {
            Self::Constant { .. } => {}
            Self::Luneburg { center, .. }
            | Self::FishEye { center, .. }
            | Self::Gaussian { center, .. }
            | Self::Fibre { center, .. } => *center += by,
            Self::Layered { z_bottom, z_top, .. } => {
                *z_bottom += by.z;
                *z_top += by.z;
            }
        }
        self
    }
}

impl Placed for Shape {
    fn moved(self, by: Vec3<f64>) -> Self {
        let flat = |[x, y]: [f64; 2]| [x + by.x, y + by.y];
        match self {
            Self::Sphere(s) => Self::Sphere(Sphere { center: s.center + by, ..s }),
            Self::Box(s) => Self::Box(Cuboid { min: s.min + by, max: s.max + by }),
            Self::Cylinder(s) => Self::Cylinder(Cylinder { from: s.from + by, to: s.to + by, ..s }),
            Self::Polyhedron(s) => {
                let face = |f: &Plane| Plane { offset: f.offset + f.normal.dot(by), ..*f };
                Self::Polyhedron(Polyhedron { faces: s.faces.iter().map(face).collect() })
            }
            Self::Rectangle(s) => {
                Self::Rectangle(Rectangle { min: flat(s.min), max: flat(s.max), z: s.z + by.z })
            }
            Self::Implicit(s) => {
                let (parts, blend) = s.parts();
                Self::Implicit(Implicit::new(parts.iter().map(|p| p.moved(by)).collect(), blend))
            }
            Self::Mesh(s) => Self::Mesh(s.moved(by)),
            Self::HeightField(s) => {
                let wave = |w: &Wave| {
                    let [kx, ky] = w.vector;
                    Wave { phase: w.phase - kx * by.x - ky * by.y, ..*w }
                };
                let (min, max) = (s.min + by, flat(s.max));
                let waves = s.waves.iter().map(wave).collect();
                Self::HeightField(HeightField { min, max, level: s.level + by.z, waves })
            }
        }
    }
}

impl Placed for Primitive {
    fn moved(mut self, by: Vec3<f64>) -> Self {
        match &mut self {
            Self::Sphere { center, .. }
            | Self::Torus { center, .. }
            | Self::Disk { center, .. }
            | Self::Bowl { center, .. } => *center += by,
            Self::Capsule { from, to, .. } => {
                *from += by;
                *to += by;
            }
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::super::scenes::{SceneOptions, scene, scene_list};
    use super::super::truth::IndexTruth;
    use super::*;
    use refraxel_core::vec3;

    #[test]
    fn what_is_moved_has_everywhere_what_it_had_before() {
        let by = vec3(3.0, -20.0, 0.7);
        for info in scene_list() {
            let Some(truth) = IndexTruth::of_scene(&scene(info.name, &SceneOptions::default()).unwrap())
            else {
                continue;
            };
            let moved = truth.clone().moved(by);
            let corner = moved.bounding_box().min - truth.bounding_box().min;
            assert!((corner - by).length() < 1e-8, "{}", info.name); // meshes pad their boxes
            for k in 0..200_u32 {
                let t = f64::from(k);
                let x = vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 2.37).sin()) * 0.6;
                let [a, b] = [truth.signed_distance_like(x), moved.signed_distance_like(x + by)];
                assert!((a - b).abs() < 1e-9, "{} {x:?}: {a} {b}", info.name);
                if a.abs() > 1e-9 {
                    let [a, b] = [truth.n(x), moved.n(x + by)];
                    assert!((a - b).abs() < 1e-9, "{} {x:?}: {a} {b}", info.name);
                }
            }
        }
    }
}
