//! What pages and the program say to each other.
//!
//! A page sends [`Ask`] as JSON text. The program answers with [`Tell`] as JSON text, and with pictures as binary messages: the
//! length of a JSON header as four bytes, least significant first, the header, and a JPEG file.

use super::bend::BentRay;
use super::contours::Piece;
use refraxel_core::{Camera, Lens, Mat3, Pose, Vec3, vec3};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Largest edge of a picture that a page may ask for [pixel].
pub const LARGEST: u32 = 2048;
/// Smallest edge [pixel].
const SMALLEST: u32 = 16;
/// Fields of view that a page may ask for [rad].
const ANGLES: [f64; 2] = [0.01, 2.8];

/// What a page asks for.
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
}

impl Ask {
    /// Whether nobody wants the answer any more once the other is asked.
    pub fn is_replaced_by(&self, later: &Self) -> bool {
        match (self, later) {
            (Self::Surface { region: a }, Self::Surface { region: b }) => a == b,
            (Self::Ray { .. }, Self::Ray { .. })
            | (Self::Follow { .. }, Self::Follow { .. })
            | (Self::Slice { .. }, Self::Slice { .. }) => true,
            _ => false,
        }
    }
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

/// A camera of a page.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PageCamera {
    /// Where it is [scene unit].
    pub eye: [f64; 3],
    /// Its axes to the right, downwards and forward.
    pub axes: [[f64; 3]; 3],
    /// Horizontal field of view [rad].
    pub angle: f64,
    /// Width and height of the picture [pixel].
    pub size: [u32; 2],
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
    /// A question could not be answered.
    Refused {
        /// Why.
        why: String,
    },
}

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

impl PageCamera {
    /// The same camera for the renderer; an error says which number makes no sense.
    pub fn camera(&self) -> Result<Camera, String> {
        let Self { eye, axes, angle, size } = *self;
        if let Some(edge) = size.iter().find(|n| !(SMALLEST..=LARGEST).contains(n)) {
            return Err(format!("camera.size: found {edge}; expected {SMALLEST} to {LARGEST} pixels"));
        }
        if !(ANGLES[0]..=ANGLES[1]).contains(&angle) {
            let [low, high] = ANGLES;
            return Err(format!("camera.angle: found {angle}; expected {low} to {high} rad"));
        }
        if !eye.iter().all(|x| x.abs() < 1e9) {
            return Err("camera.eye: expected finite numbers".to_owned());
        }
        let rotation = right_handed(axes.map(|[x, y, z]| vec3(x, y, z)))
            .ok_or("camera.axes: expected the axes to the right, downwards and forward, of unit length")?;
        let focal = 0.5 * f64::from(size[0]) / (0.5 * angle).tan();
        let translation = vec3(eye[0], eye[1], eye[2]);
        Ok(Camera {
            width: size[0],
            height: size[1],
            focal: [focal; 2],
            center: size.map(|n| 0.5 * f64::from(n)),
            lens: Lens::Pinhole,
            world_from_camera: Pose { rotation, translation },
        })
    }

    /// The camera of a page that is where this one is and sees as much from left to right.
    pub fn of(camera: &Camera) -> Self {
        let Pose { rotation, translation } = camera.world_from_camera;
        let angle = 2.0 * (0.5 * f64::from(camera.width) / camera.focal[0]).atan();
        Self {
            eye: translation.to_array(),
            axes: rotation.columns.map(|c| c.to_array()),
            angle: angle.clamp(ANGLES[0], ANGLES[1]),
            size: [camera.width, camera.height],
        }
    }
}

/// Axes that are nearly orthonormal, made so.
fn right_handed([right, down, forward]: [Vec3<f64>; 3]) -> Option<Mat3<f64>> {
    let near = |x: f64, y: f64| (x - y).abs() < 1e-3;
    let are_unit = [right, down, forward].iter().all(|a| near(a.length(), 1.0));
    if !are_unit || !near(right.dot(forward), 0.0) || !near(forward.cross(right).dot(down), 1.0) {
        return None;
    }
    let forward = forward.normalized();
    let right = (right - forward * right.dot(forward)).normalized();
    Some(Mat3 { columns: [right, forward.cross(right), forward] })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page() -> PageCamera {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        PageCamera { eye: [0.0; 3], axes, angle: 0.7, size: [40, 30] }
    }

    #[test]
    fn a_camera_that_goes_to_the_page_and_back_is_the_same() {
        let eye = vec3(2.0, -3.0, 1.0);
        let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [40, 30]);
        let back = PageCamera::of(&camera).camera().unwrap();
        let (a, b) = (camera.ray(3.0, 4.0).unwrap(), back.ray(3.0, 4.0).unwrap());
        assert!((a.direction - b.direction).length() < 1e-12 && a.origin == b.origin);
    }

    #[test]
    fn cameras_that_make_no_sense_are_refused_by_name() {
        let refused = |page: PageCamera, name: &str| {
            let why = page.camera().unwrap_err();
            assert!(why.starts_with(name), "{why}");
        };
        refused(PageCamera { size: [1, 30], ..page() }, "camera.size");
        refused(PageCamera { size: [40, 100_000], ..page() }, "camera.size");
        refused(PageCamera { angle: f64::NAN, ..page() }, "camera.angle");
        refused(PageCamera { eye: [f64::INFINITY, 0.0, 0.0], ..page() }, "camera.eye");
        refused(PageCamera { axes: [[0.0; 3]; 3], ..page() }, "camera.axes");
        let mirrored = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        refused(PageCamera { axes: mirrored, ..page() }, "camera.axes");
    }

    #[test]
    fn a_look_needs_a_camera_and_nothing_more() {
        let text = format!(r#"{{"ask":"look","id":1,"camera":{}}}"#, serde_json::to_string(&page()).unwrap());
        let Ask::Look(look) = serde_json::from_str(&text).unwrap() else { panic!("no look") };
        assert_eq!((look.shown, look.straight, look.moving), (Shown::Colour, false, false));
        assert!(serde_json::from_str::<Ask>(r#"{"ask":"file","path":"/etc/passwd"}"#).is_err());
    }
}
