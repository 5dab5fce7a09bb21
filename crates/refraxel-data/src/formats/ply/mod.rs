//! Vertex positions of PLY files, ASCII or binary, as nerfstudio's `ply_file_path` names them, and triangle meshes.

mod faces;
mod header;
mod vertices;

pub use faces::OPAQUE_REGION;
pub(crate) use faces::mesh;
#[cfg(test)]
pub(crate) use faces::tests::tetrahedron;
pub(crate) use vertices::{coloured_points, points};
