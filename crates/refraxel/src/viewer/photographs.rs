//! The photographs of a scene: where they were taken, and what they show.

use super::error::SceneError;
use super::page_camera::{LARGEST, PageCamera};
use super::protocol::ViewFacts;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, resize};
use image::{ImageBuffer, Rgb, RgbImage};
use refraxel_core::Camera;
use refraxel_data::{Backdrop, Dataset, LocalOrigin, View, load_photo};
use refraxel_train::alignment::Alignment;
use refraxel_train::evaluation::truth;
use std::collections::BTreeSet;

/// Quality of photographs, 1 to 100: their blocks must not be taken for errors of a rendering.
const QUALITY: u8 = 95;

/// The photographs of a scene.
#[derive(Debug, Default)]
pub struct Photographs {
    views: Vec<Photograph>,
    origin: LocalOrigin,
    backdrop: Option<Backdrop>,
}

#[derive(Debug)]
struct Photograph {
    view: View,
    /// Where and with which lens it was taken, as learned if these learn.
    camera: Camera,
    split: &'static str,
}

impl Photographs {
    /// Those of a dataset, held-out ones first.
    pub fn new(data: &Dataset, alignment: &Alignment) -> Self {
        let parts = [("test", &data.split.test), ("val", &data.split.val), ("train", &data.split.train)];
        let (mut views, mut known) = (Vec::new(), BTreeSet::new());
        let cameras = alignment.cameras(data);
        for (split, indices) in parts {
            for &i in indices {
                if !known.insert(i) {
                    continue; // a view can be looked at during training and be scored
                }
                let view = data.views[i].clone();
                views.push(Photograph { view, camera: cameras[i], split });
            }
        }
        Self { views, origin: data.origin, backdrop: Some(data.backdrop) }
    }

    /// The camera that a page begins with.
    pub fn first(&self) -> Option<Camera> {
        self.views.first().map(|v| v.camera)
    }

    /// Where a photograph was taken.
    pub fn camera(&self, view: usize) -> Result<Camera, SceneError> {
        self.get(view).map(|v| v.camera)
    }

    fn get(&self, view: usize) -> Result<&Photograph, SceneError> {
        self.views.get(view).ok_or(SceneError::Photo { found: view, count: self.views.len() })
    }

    /// Names and cameras for the page, in the user's world.
    pub fn describe(&self) -> Vec<ViewFacts> {
        let entry = |v: &Photograph| ViewFacts {
            name: v.view.name.clone(),
            split: v.split,
            camera: PageCamera::of(&self.origin.to_world(v.camera)),
        };
        self.views.iter().map(entry).collect()
    }

    /// A photograph as a JPEG file and its size, no larger than a page may ask for. An error says why it cannot be read.
    pub fn jpeg(&self, view: usize) -> Result<(Vec<u8>, [u32; 2]), String> {
        let found = self.get(view).map_err(|e| e.to_string())?;
        let photo = load_photo(&found.view).map_err(|e| e.to_string())?;
        let pixels = truth(&photo, self.backdrop.unwrap_or(Backdrop::Surroundings));
        let Camera { width, height, .. } = found.camera;
        let picture: Option<RgbImage> = ImageBuffer::from_raw(width, height, pixels.into_flattened());
        let mut picture = picture.ok_or("the photograph has another size than its camera")?;
        let largest = width.max(height);
        if largest > LARGEST {
            let fit = |n: u32| (u64::from(n) * u64::from(LARGEST) / u64::from(largest)).max(1) as u32;
            picture = resize(&picture, fit(width), fit(height), FilterType::Triangle);
        }
        let size = [picture.width(), picture.height()];
        Ok((encode(picture.as_raw(), size, QUALITY), size))
    }
}

/// A JPEG file of RGB pixels.
pub fn encode(pixels: &[u8], size: [u32; 2], quality: u8) -> Vec<u8> {
    let mut file = Vec::new();
    let picture = ImageBuffer::<Rgb<u8>, _>::from_raw(size[0], size[1], pixels);
    let picture = picture.expect("three bytes per pixel");
    JpegEncoder::new_with_quality(&mut file, quality).encode_image(&picture).expect("writing to memory");
    file
}
