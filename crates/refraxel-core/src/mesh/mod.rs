//! Closed triangle meshes of the zero level of a function, for programs that do not read level sets.
//!
//! [`Mesh::of_level`] marches through tetrahedra: whatever the function, each edge belongs to two triangles of the same
//! orientation, so that the mesh has an inside. Then the vertices move along the surface until the triangles are well
//! shaped, theory (2.32).

mod measure;
mod of_level;
mod parts;
mod relax;
mod tetrahedra;
mod triangles;

#[cfg(test)]
mod tests;

pub use triangles::Mesh;
