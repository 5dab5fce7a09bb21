//! What pages and the program say to each other.
//!
//! A page sends [`Ask`] as JSON text. The program answers with [`Tell`] as JSON text, and with pictures as binary messages: the
//! length of a JSON header as four bytes, least significant first, the header, and a JPEG file.

use super::page_camera::PageCamera;
use crate::worker::Pace;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// What a page asks for. Of each kind, the latest question is answered; earlier ones may not be.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "ask", rename_all = "snake_case", deny_unknown_fields)]
pub enum Ask {
    /// A picture of the scene, which gets better until the page asks for another.
    Look(Look),
    /// The page has received so many pictures.
    Got {
        /// Number of the last one.
        frame: u64,
    },
    /// The ray through a place of the picture last asked for.
    Ray {
        /// Returned with the answer.
        id: u64,
        /// To the right, in [0, 1].
        u: f64,
        /// Downwards, in [0, 1].
        v: f64,
    },
    /// A ray that was shown, in the medium of the picture last asked for.
    Follow {
        /// Returned with the answer.
        id: u64,
        /// Where it starts [scene unit].
        origin: [f64; 3],
        /// Its direction, of any length.
        direction: [f64; 3],
    },
    /// A photograph of the dataset.
    Photo {
        /// Its number in the list of views.
        view: usize,
    },
    /// The index of refraction in a plane across an axis of a region's box.
    Slice {
        /// Number of the region, from 0.
        region: usize,
        /// The axis that the plane is perpendicular to: 0, 1 or 2.
        axis: usize,
        /// Where the plane is between the ends of the box, in [0, 1].
        at: f64,
    },
    /// The surface of a region as lines.
    Surface {
        /// Number of the region, from 0.
        region: usize,
    },
    /// Training goes on, or waits.
    Pause {
        /// Whether it waits.
        paused: bool,
    },
    /// Training saves and ends.
    Stop,
    /// A film of the run along a camera path.
    Film(FilmWish),
    /// The film that is rendered is not wanted any more.
    StopFilm,
}

/// A film that a page wishes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmWish {
    /// The path: the text of a `camera_path.json`.
    pub path: String,
    /// What encodes the film.
    pub format: FilmFormat,
    /// What is shown.
    pub shown: Shown,
    /// Rays are straight.
    pub straight: bool,
    /// The index of all regions; absent where it is the learned one.
    pub index: Option<f64>,
}

/// The files that a film may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FilmFormat {
    /// H.264, by ffmpeg.
    Mp4,
    /// VP9, by ffmpeg.
    Webm,
    /// By this program alone.
    Gif,
}

/// How the scene is looked at.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Look {
    /// Returned with each picture.
    pub id: u64,
    /// The camera.
    pub camera: PageCamera,
    /// The lens and the principal point of this photograph count.
    #[serde(default)]
    pub photo: Option<usize>,
    /// What is shown.
    #[serde(default)]
    pub shown: Shown,
    /// Rays are straight.
    #[serde(default)]
    pub straight: bool,
    /// The camera moves: one coarse picture is enough.
    #[serde(default)]
    pub moving: bool,
    /// How the media are changed.
    #[serde(default)]
    pub edits: Edits,
}

/// What a picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shown {
    /// Colours.
    #[default]
    Colour,
    /// Distance to what is seen.
    Depth,
    /// Share of the background that is hidden.
    Opacity,
    /// The light that surfaces mirror, alone.
    Reflection,
    /// Everything but that light.
    Transmission,
    /// The index of refraction that differs most from 1.
    Index,
    /// Normals of the first refractive surface.
    Normal,
}

/// How the media of a scene are changed, one entry per region; those that are absent stay as they are.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edits {
    /// The index.
    #[serde(default)]
    pub index: Vec<Option<f32>>,
    /// Factor on the absorption; for a clear body, the grey optical thickness over the shortest edge of its box.
    #[serde(default)]
    pub absorption: Vec<Option<f32>>,
    /// Opposite corners of a box [scene unit]: of what is opaque, only that inside is shown.
    #[serde(default)]
    pub crop: Option<[[f64; 3]; 2]>,
}

/// What the program tells a page.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "tell", rename_all = "snake_case")]
pub enum Tell {
    /// The scene, when the page opens and when training has gone on.
    Scene(Value),
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
    /// Something happened in the training that is shown.
    Training(Value),
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

/// A ray as the renderer follows it. Places are in world coordinates [scene unit], angles in degrees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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

/// Two ends of a piece of a line, in steps of the region's box, and the outward normal between them.
pub type Piece = [i16; 9];

/// The header of a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "picture", rename_all = "snake_case")]
pub enum Header {
    /// The scene.
    Frame {
        /// Of the [`Look`].
        id: u64,
        /// Number of the picture, counted for each page.
        frame: u64,
        /// Size [pixel].
        size: [u32; 2],
        /// Rays per pixel; 0 where the picture is coarser than what was asked for.
        rays: u32,
        /// No better picture follows.
        last: bool,
        /// Time of computation [ms].
        ms: f64,
        /// Smallest and largest value of the colours, where the picture shows numbers.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        range: Option<[f32; 2]>,
        /// Steps of the training that the picture shows.
        step: u64,
    },
    /// A photograph.
    Photo {
        /// Its number.
        view: usize,
        /// Size [pixel].
        size: [u32; 2],
    },
    /// The index in a plane.
    Slice {
        /// Number of the region.
        region: usize,
        /// The axis across.
        axis: usize,
        /// Corners of the picture in the world: top left, top right, bottom right, bottom left [scene unit].
        corners: [[f64; 3]; 4],
        /// The index of the first and of the last colour.
        range: [f32; 2],
    },
}

/// The bytes of a picture's message.
pub fn message(header: &Header, jpeg: &[u8]) -> Vec<u8> {
    let header = serde_json::to_vec(header).unwrap_or_default(); // numbers and names: cannot fail
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend(&header);
    bytes.extend(jpeg);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_needs_a_camera_and_nothing_more() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let page = PageCamera { eye: [0.0; 3], axes, angle: 0.7, size: [40, 30] };
        let text = format!(r#"{{"ask":"look","id":1,"camera":{}}}"#, serde_json::to_string(&page).unwrap());
        let Ask::Look(look) = serde_json::from_str(&text).unwrap() else { panic!("no look") };
        assert_eq!((look.shown, look.straight, look.moving), (Shown::Colour, false, false));
        assert!(serde_json::from_str::<Ask>(r#"{"ask":"file","path":"/etc/passwd"}"#).is_err());
    }
}
