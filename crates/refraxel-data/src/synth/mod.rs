//! Exact reference renderings of refractive scenes, with ground truth.
//!
//! A tracer in double precision that shares no marching code with the differentiable renderer, so that each can be
//! tested against the other. Intersections are found in closed form or by sphere tracing, interfaces obey Snell and
//! Fresnel exactly, graded media are integrated with error control, and rays split deterministically; all light comes
//! from emissive textures, so that pictures carry no noise beyond that of the pixel filter. Colours are basic radiance
//! L/n², theory (1.4): a surface under water shows the colour that it shows in air.

mod cameras;
mod dataset;
mod elevations;
mod entry;
mod error;
mod grin;
mod hash;
mod medium;
mod moved;
mod optics;
mod output;
mod photographic;
mod render;
mod scene;
mod scenes;
mod shape;
mod texture;
mod trace;
mod truth;
mod vector;

pub use cameras::{
    CAMERA_ANGLE_X, CAMERA_RADIUS, CameraSet, Viewpoints, cameras, from_opengl_matrix, opengl_matrix,
};
pub use dataset::{Cost, DatasetOptions, ViewCounts};
pub use elevations::Elevations;
pub use error::SynthError;
pub use grin::Phase;
pub use medium::{Index, Medium};
#[cfg(test)]
pub(crate) use output::npz_of_index;
pub use output::{DEPTH_UNIT, Progress, Summary, SynthOptions, contact_sheet, synthesize};
pub use photographic::{
    EXPOSURE, Imperfection, Imperfections, JPEG_QUALITY, LENS_RADIUS, POSITION_ERROR, READ_NOISE, TURN_ERROR,
    UnknownImperfection, WANDER, WHITE_ELECTRONS,
};
pub use render::{Frame, Sampling, render_view, render_view_while};
pub use scene::{Body, Environment, Matter, Scene};
pub use scenes::{IorRange, Room, SceneInfo, SceneOptions, room, room_list, scene, scene_list};
pub use shape::{
    Crossing, Cuboid, Cylinder, HeightField, Implicit, MeshError, OPAQUE_OBJECT, Plane, Polyhedron,
    Primitive, Rectangle, Shape, Sphere, TriangleMesh, Wave,
};
pub use texture::{Face, Lamp, Mosaic, Paint, Panel, Picture, Rgb, Surface, Texture, Tiles};
pub use trace::{Limits, Reflection, Tally, Tracer};
pub use truth::{ConstantBody, IndexTruth};
