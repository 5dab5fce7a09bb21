//! What a page asks for.

use crate::viewer::page_camera::PageCamera;
use serde::{Deserialize, Serialize};

/// What a page asks for. Of each kind, the latest question is answered; earlier ones may not be.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
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
    /// The hulls that tell which rays bend, as lines.
    Hull,
    /// The outline of the stored bricks of the grid, as lines.
    Bricks,
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
#[cfg_attr(test, derive(ts_rs::TS))]
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
#[cfg_attr(test, derive(ts_rs::TS))]
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
#[cfg_attr(test, derive(ts_rs::TS))]
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
#[cfg_attr(test, derive(ts_rs::TS))]
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
#[cfg_attr(test, derive(ts_rs::TS))]
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
