//! Datasets made of arrays, without a file: what importers check is checked here too.

use crate::camera::{Coincidence, MIN_VIEWS, coincidence, one_place, repairs};
use crate::error::{MemoryError, ViewFault};
use crate::image::bad_pixel;
use crate::pose::CheckedPose;
use crate::size::Size;
use crate::{
    Backdrop, DataError, Dataset, Format, Image, LocalOrigin, Mask, MaskMeaning, Photo, PhotoSource, Pixels,
    Split, View, masks, pose,
};
use refraxel_core::Camera;
use std::collections::HashMap;

/// A photograph in memory with its camera.
///
/// The camera has the frame of [`Camera`]: camera to world, x right, y down, z forward, pixel centres at +0.5. Its
/// width and height are those of the image; nothing is scaled, and no EXIF tag is read. [`Image`] and [`Mask`] state
/// the shapes: rows from the top, channels fastest, sRGB-encoded with 8 bits or as `f32` (1 = white), alpha straight.
/// A mask has one value per pixel, 0 = black to 255 = white.
#[derive(Clone, Debug)]
pub struct PosedPhoto {
    /// A name that a file can have, unique within a part of the split: renderings of the view are saved under it.
    pub name: String,
    /// Pose, intrinsics and lens.
    pub camera: Camera,
    /// Image and, where there is one, mask.
    pub photo: Photo,
    /// What the white of the mask means.
    pub mask_meaning: MaskMeaning,
}

/// A rotation whose |RᵀR − 1| is at most this stays as it is, so that cameras of an opened dataset come back bit for
/// bit. Rounding in f64 stays below.
const ROUNDING: f64 = 1e-14;

impl Dataset {
    /// A dataset of photographs in memory. `split` holds indices into `photos`.
    ///
    /// What only files state is absent; set [`Dataset::stated_box`] and [`Dataset::points`], both relative to [`Dataset::origin`],
    /// [`Dataset::depth_range`] and [`Dataset::truth`] where it is known. Pixels are shared with `photos`, not copied. Rotations that are off
    /// by rounding are repaired with a note in [`Dataset::problems`].
    ///
    /// ```
    /// use refraxel_core::{Camera, vec3};
    /// use refraxel_data::{Backdrop, Dataset, Image, MaskMeaning, Photo, Pixels, PosedPhoto, Split};
    ///
    /// let [width, height] = [6, 4];
    /// let photo = |i: u32| {
    ///     let eye = vec3(4.0, f64::from(i), 1.0);
    ///     let camera = Camera::look_at(eye, vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0), 0.7, [width, height]);
    ///     let pixels = Pixels::U8(vec![200; (height * width * 3) as usize]);
    ///     let photo = Photo::new(Image { width, height, channels: 3, pixels }, None);
    ///     PosedPhoto { name: format!("{i}.png"), camera, photo, mask_meaning: MaskMeaning::Keep }
    /// };
    /// let split = Split { train: vec![0, 1], test: vec![2], ..Split::default() };
    /// let data = Dataset::in_memory((0..3).map(photo).collect(), split, Backdrop::Surroundings)?;
    /// assert_eq!(data.views[2].name, "2.png");
    /// # Ok::<(), refraxel_data::DataError>(())
    /// ```
    ///
    /// # Errors
    /// [`DataError::Memory`] with the view and what is wrong with it: a pose that is no rigid motion, a focal length
    /// that is not positive, an image or mask whose size is not the camera's or not that of its array, a value that is
    /// not finite, a name that is taken, a split that names views which do not exist or trains on none, fewer than 3
    /// views, and cameras that all coincide.
    pub fn in_memory(
        photos: Vec<PosedPhoto>,
        split: Split,
        backdrop: Backdrop,
    ) -> Result<Dataset, DataError> {
        if photos.len() < MIN_VIEWS {
            return Err(MemoryError::TooFewViews { found: photos.len() }.into());
        }
        let checked = photos.iter().enumerate().map(|(index, photo)| {
            let in_view = |fault| MemoryError::View { index, name: photo.name.clone(), fault };
            checked_camera(photo).map_err(in_view)
        });
        let checked: Vec<CheckedCamera> = checked.collect::<Result<_, _>>()?;
        check_split(&split, &photos)?;
        check_backdrop(backdrop)?;
        let mut problems = Vec::new();
        problems.extend(repairs(&checked.iter().map(|c| c.pose).collect::<Vec<_>>()));
        let view = |(posed, checked): (PosedPhoto, &CheckedCamera)| {
            let PosedPhoto { name, photo, mask_meaning, .. } = posed;
            View {
                name,
                source: PhotoSource::Memory(photo),
                mask_meaning,
                camera: checked.camera,
                depth: None,
            }
        };
        let views: Vec<View> = photos.into_iter().zip(&checked).map(view).collect();
        problems.extend(masks::summary(&views));
        let rule = if split.rule.is_empty() { "as given".to_owned() } else { split.rule };
        let data = Dataset {
            root: None,
            format: Format::Memory,
            origin: LocalOrigin::default(),
            views,
            split: Split { rule, ..split },
            backdrop,
            stated_box: None,
            up: None,
            points: Vec::new(),
            depth_range: None,
            truth: None,
            problems,
        };
        let mut data = data.recentred(None);
        match coincidence(data.views.iter().map(|view| &view.camera)) {
            Some(Coincidence::Pose) => Err(MemoryError::SamePose { count: data.views.len() }.into()),
            Some(Coincidence::Place) => {
                data.problems.push(one_place());
                Ok(data)
            }
            None => Ok(data),
        }
    }
}

/// A camera whose rotation is orthonormal.
struct CheckedCamera {
    camera: Camera,
    pose: CheckedPose,
}

fn checked_camera(posed: &PosedPhoto) -> Result<CheckedCamera, ViewFault> {
    let camera = &posed.camera;
    if posed.name.is_empty() || posed.name.contains(['/', '\\']) {
        return Err(ViewFault::Name);
    }
    let checked = pose::check(&camera.world_from_camera)?;
    check_image(&posed.photo.image, camera)?;
    crate::camera::check(camera)?;
    if let Some(mask) = &posed.photo.mask {
        check_mask(mask, &posed.photo.image)?;
    }
    let world_from_camera = if checked.error > ROUNDING { checked.pose } else { camera.world_from_camera };
    Ok(CheckedCamera { camera: Camera { world_from_camera, ..*camera }, pose: checked })
}

fn check_image(image: &Image, camera: &Camera) -> Result<(), ViewFault> {
    let size = Size { width: image.width, height: image.height };
    let expected = Size { width: camera.width, height: camera.height };
    if size != expected {
        return Err(ViewFault::ImageSize { image: size, camera: expected });
    }
    if image.is_empty() {
        return Err(ViewFault::NoPixels(size));
    }
    if ![3, 4].contains(&image.channels) {
        return Err(ViewFault::Channels(image.channels));
    }
    let found = match &image.pixels {
        Pixels::U8(v) => v.len(),
        Pixels::F32(v) => v.len(),
    };
    let expected = area(size) * u128::from(image.channels);
    if found as u128 != expected {
        return Err(ViewFault::ImageValues { found, expected });
    }
    match &image.pixels {
        Pixels::U8(_) => Ok(()),
        Pixels::F32(values) => match bad_pixel(values, image.width, image.channels) {
            Some(pixel) => Err(ViewFault::Pixel(pixel)),
            None => Ok(()),
        },
    }
}

fn check_mask(mask: &Mask, image: &Image) -> Result<(), ViewFault> {
    let size = Size { width: mask.width, height: mask.height };
    let expected = Size { width: image.width, height: image.height };
    if size != expected {
        return Err(ViewFault::MaskSize { mask: size, image: expected });
    }
    let (found, expected) = (mask.coverage.len(), area(size));
    let fits = found as u128 == expected;
    fits.then_some(()).ok_or(ViewFault::MaskValues { found, expected })
}

/// Number of pixels; the product of two sizes may be larger than a u64.
fn area(size: Size) -> u128 {
    u128::from(size.width) * u128::from(size.height)
}

fn check_split(split: &Split, photos: &[PosedPhoto]) -> Result<(), MemoryError> {
    let parts = [("training", &split.train), ("validation", &split.val), ("test", &split.test)];
    for (part, indices) in parts {
        let mut names = HashMap::new();
        for &index in indices {
            let photo = photos.get(index);
            let photo = photo.ok_or(MemoryError::NoSuchView { part, index, count: photos.len() })?;
            match names.insert(&photo.name, index) {
                None => {}
                Some(first) if first == index => return Err(MemoryError::Repeated { part, index }),
                Some(first) => {
                    let name = photo.name.clone();
                    return Err(MemoryError::DuplicateName { part, first, second: index, name });
                }
            }
        }
    }
    if split.train.is_empty() { Err(MemoryError::NoTraining) } else { Ok(()) }
}

fn check_backdrop(backdrop: Backdrop) -> Result<(), MemoryError> {
    match backdrop {
        Backdrop::Color(found) if !found.iter().all(|c| (0.0..=1.0).contains(c)) => {
            Err(MemoryError::Backdrop { found })
        }
        _ => Ok(()),
    }
}
