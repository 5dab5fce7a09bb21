//! Surfaces that a ray can meet, each with its inside, its outward normal and its bounds.

mod any_shape;
mod convex;
mod crossing;
mod implicit;
mod mesh;
mod primitive;
mod rectangle;
mod root;
mod waves;

pub use any_shape::Shape;
pub use convex::{Cuboid, Cylinder, Plane, Polyhedron, Sphere};
pub use crossing::Crossing;
pub(super) use crossing::S_MIN;
pub use implicit::Implicit;
pub use mesh::{MeshError, OPAQUE_OBJECT, TriangleMesh};
pub use primitive::Primitive;
pub use rectangle::Rectangle;
pub use waves::{HeightField, Wave};
