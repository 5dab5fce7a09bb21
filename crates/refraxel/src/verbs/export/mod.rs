//! `refraxel export`: writes a run for other programs, and for browsers.
//!
//! Each region gets the mesh of its whole surface. Where bodies lie in each other the later region rules, theory (2.23): a
//! bubble is a closed surface of index 1 inside that of the glass, and where two overlap in part both surfaces run through
//! each other. Neither PLY nor glTF can state this order; path tracers know it as the priority of nested dielectrics.

mod cameras;
mod ellipsoid;
mod eyes;
mod gltf;
mod html;
mod obj;
mod opaque;
mod ply;
mod points;
mod report;
mod splats;
mod spz;
mod surfaces;
mod surroundings;
mod up;
mod verb;

pub use report::Report;
pub use verb::{run, write_gltf, write_obj, write_ply};
