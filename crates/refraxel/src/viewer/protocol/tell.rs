//! What a page is told.

use super::scene::SceneFacts;
use super::training::Training;
use crate::worker::Pace;
use serde::{Deserialize, Serialize};

/// What the program tells a page.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "tell", rename_all = "snake_case")]
pub enum Tell {
    /// The scene, when the page opens and when training has gone on.
    Scene(Box<SceneFacts>),
    /// The ray that was asked for.
    Ray {
        /// From the question.
        id: u64,
        /// The ray.
        ray: BentRay,
    },
    /// The surface of a region.
    Surface {
        /// Number of the region, from 0.
        region: usize,
        /// Pieces of lines on it.
        pieces: Vec<Piece>,
    },
    /// The hulls: only rays that meet one bend.
    Hull {
        /// Each in a box of its own.
        parts: Vec<HullPart>,
    },
    /// The outline of what the grid stores.
    Bricks {
        /// Lines between two places [scene unit].
        lines: Vec<[f32; 6]>,
        /// Edge of the blocks that are outlined [voxel].
        edge: u32,
    },
    /// Something happened in the training that is shown.
    Training(Training),
    /// Nothing changes any more, and the program ends soon.
    Ended {
        /// Why, and what to do next.
        why: String,
    },
    /// How far the film is that the page wishes.
    Film(FilmState),
    /// A question could not be answered.
    Refused {
        /// Why.
        why: String,
    },
}

/// How far a film is.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "film", rename_all = "snake_case")]
pub enum FilmState {
    /// It is rendered.
    Renders {
        /// How far that is.
        pace: Option<Pace>,
    },
    /// It can be fetched.
    Ready {
        /// The name of its file on this server.
        file: String,
    },
    /// It was stopped.
    Stopped,
    /// It cannot be made.
    Failed {
        /// Why, in full.
        why: String,
    },
}

/// Two ends of a piece of a line, in steps of the region's box, and the outward normal between them.
pub type Piece = [i16; 9];

/// A hull as lines.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct HullPart {
    /// Lowest corner of its box [scene unit].
    pub min: [f64; 3],
    /// Highest corner of its box [scene unit].
    pub max: [f64; 3],
    /// Pieces of lines on it.
    pub pieces: Vec<Piece>,
}

/// A ray as the renderer follows it. Places are in world coordinates [scene unit], angles in degrees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BentRay {
    /// Corners of the path, from the camera on; at least two.
    pub points: Vec<[f64; 3]>,
    /// Start and end of the same ray if it were straight.
    pub straight: [[f64; 3]; 2],
    /// What happens at sharp surfaces, in order.
    pub bounces: Vec<Bounce>,
    /// Angle between the first and the last direction [degree].
    pub turned: f64,
    /// Largest index on the path.
    pub densest: f64,
    /// ∫ n ds − ∫ ds over the path, by which light is late [scene unit].
    pub late: f64,
    /// The colour that the ray shows.
    pub colour: [u8; 3],
    /// Share of the background that is hidden on the path.
    pub opacity: f32,
    /// Arc length from the camera to what is seen, and its place; absent where little is.
    pub seen: Option<(f64, [f64; 3])>,
    /// The path is shown to its end: it left all media.
    pub is_whole: bool,
}

/// A sharp surface on the path of a ray.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Bounce {
    /// Where it is met [scene unit].
    pub place: [f64; 3],
    /// Number of the region whose surface it is, from 0.
    pub region: u16,
    /// The ray is turned back by total reflection.
    pub total: bool,
    /// The index before and beyond the surface.
    pub index: [f64; 2],
    /// Angles to the normal before and after [degree].
    pub angle: [f64; 2],
    /// Fresnel's reflectance, 0 to 1.
    pub reflectance: f64,
}
