//! Photographs without their borders: frames, dates and lens caps teach nothing.

use crate::reduce::size_of;
use crate::size::Size;
use crate::{DataError, Image, Mask, Photo, PhotoSource, Pixels, Stored, View};
use refraxel_core::Camera;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// Columns and rows that are cut off each photograph [pixel of the files].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Crop {
    /// Columns on the left.
    pub left: u32,
    /// Rows on top.
    pub top: u32,
    /// Columns on the right.
    pub right: u32,
    /// Rows at the bottom.
    pub bottom: u32,
}

/// Photographs that are cut have at least so many columns and rows.
const LEAST: u32 = 8;

impl Crop {
    /// Whether nothing is cut off.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// What is left of a picture of this size; `None` where that is hardly anything.
    pub fn size(&self, [width, height]: [u32; 2]) -> Option<[u32; 2]> {
        let rest = |n: u32, a, b| n.checked_sub(a)?.checked_sub(b).filter(|n| *n >= LEAST);
        Some([rest(width, self.left, self.right)?, rest(height, self.top, self.bottom)?])
    }

    /// What is left of a picture of this size and so many channels.
    fn cut<T: Copy>(&self, values: &[T], size: [u32; 2], channels: usize) -> Vec<T> {
        let [width, height] = size.map(|n| n as usize);
        let rows = self.top as usize..height - self.bottom as usize;
        let columns = self.left as usize * channels..(width - self.right as usize) * channels;
        rows.flat_map(|y| &values[y * width * channels..][columns.clone()]).copied().collect()
    }
}

/// A text that is no [`Crop`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected the pixels cut off on the left, on top, on the right and at the bottom: L,T,R,B, such as 0,0,0,40"
)]
pub struct NoCrop;

impl FromStr for Crop {
    type Err = NoCrop;

    fn from_str(text: &str) -> Result<Self, NoCrop> {
        let numbers: Result<Vec<u32>, _> = text.split(',').map(|n| n.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[left, top, right, bottom]) => Ok(Self { left, top, right, bottom }),
            _ => Err(NoCrop),
        }
    }
}

impl fmt::Display for Crop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{},{}", self.left, self.top, self.right, self.bottom)
    }
}

impl View {
    /// A camera of this view for the whole pictures of its files, before anything was cut off them or reduced.
    pub fn camera_of_files(&self, camera: &Camera) -> Camera {
        let PhotoSource::Files { stored: Some(Stored { size: [width, height], crop }), .. } = self.source
        else {
            return *camera;
        };
        let kept = [width - crop.left - crop.right, height - crop.top - crop.bottom];
        let mut whole = camera.resized(kept[0], kept[1]);
        (whole.width, whole.height) = (width, height);
        whole.center[0] += f64::from(crop.left);
        whole.center[1] += f64::from(crop.top);
        whole
    }

    /// The same view without its borders: pixels, mask and camera.
    pub(crate) fn cropped(mut self, crop: Crop) -> Result<Self, DataError> {
        let before = size_of(&self.camera);
        let [width, height] = crop.size(before).ok_or_else(|| DataError::Crop {
            crop,
            name: self.name.clone(),
            size: Size { width: before[0], height: before[1] },
        })?;
        (self.camera.width, self.camera.height) = (width, height);
        self.camera.center[0] -= f64::from(crop.left);
        self.camera.center[1] -= f64::from(crop.top);
        match &mut self.source {
            PhotoSource::Files { stored, .. } => *stored = Some(Stored { size: before, crop }),
            PhotoSource::Memory(photo) => *photo = photo.cropped(crop),
        }
        Ok(self)
    }
}

impl Photo {
    /// The photo without its borders.
    ///
    /// # Panics
    /// If less than nothing is left.
    pub(crate) fn cropped(&self, crop: Crop) -> Self {
        let mask = self.mask.as_ref().map(|mask| mask.cropped(crop));
        let Image { width, height, channels, pixels } = &*self.image;
        let (size, of) = ([*width, *height], *channels as usize);
        let pixels = match pixels {
            Pixels::U8(values) => Pixels::U8(crop.cut(values, size, of)),
            Pixels::F32(values) => Pixels::F32(crop.cut(values, size, of)),
        };
        let [width, height] = [size[0] - crop.left - crop.right, size[1] - crop.top - crop.bottom];
        let depth = self.depth.as_ref().map(|depth| Arc::new(depth.cropped(crop, size)));
        Self { depth, ..Self::new(Image { width, height, channels: *channels, pixels }, mask) }
    }
}

impl Mask {
    /// As [`Photo::cropped`].
    pub(crate) fn cropped(&self, crop: Crop) -> Self {
        let coverage = crop.cut(&self.coverage, [self.width, self.height], 1);
        let [width, height] = [self.width - crop.left - crop.right, self.height - crop.top - crop.bottom];
        Self { width, height, coverage }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Vec3, vec3};

    #[test]
    fn four_numbers_are_a_crop() {
        let crop = Crop { left: 1, top: 2, right: 3, bottom: 40 };
        assert_eq!("1, 2,3,40".parse(), Ok(crop));
        assert_eq!(crop.to_string().parse(), Ok(crop));
        for wrong in ["", "1,2,3", "1,2,3,4,5", "1,2,3,-4", "a,b,c,d"] {
            assert_eq!(wrong.parse::<Crop>(), Err(NoCrop), "{wrong}");
        }
        assert_eq!(crop.size([100, 100]), Some([96, 58]));
        assert_eq!(crop.size([11, 100]), None);
        assert_eq!(Crop { left: u32::MAX, ..crop }.size([100, 100]), None);
    }

    #[test]
    fn a_cut_view_shows_what_it_showed_there() {
        let up = vec3(0.0, 0.0, 1.0);
        let camera = Camera::look_at(vec3(3.0, 1.0, 2.0), Vec3::zero(), up, 0.8, [20, 16]);
        let pixels = Pixels::U8((0..20 * 16 * 3).map(|k| (k / 3 % 251) as u8).collect());
        let mask = Mask { width: 20, height: 16, coverage: (0..320).map(|k| (k % 256) as u8).collect() };
        let photo = Photo::new(Image { width: 20, height: 16, channels: 3, pixels }, Some(mask));
        let whole = View { source: PhotoSource::Memory(photo.clone()), ..View::of_file("a.png", camera) };
        let crop = Crop { left: 3, top: 2, right: 5, bottom: 1 };
        let cut = whole.cropped(crop).unwrap();
        let PhotoSource::Memory(part) = &cut.source else { panic!("it stays in memory") };
        assert_eq!([part.image.width, part.image.height], [12, 13]);
        for (x, y) in [(0, 0), (11, 0), (4, 7), (11, 12)] {
            let (here, there) = (y * 12 + x, (y + 2) * 20 + x + 3);
            assert_eq!(part.image.rgba(here), photo.image.rgba(there));
            let masks = [part, &photo].map(|p| p.mask.clone().unwrap());
            assert_eq!(masks[0].coverage[here], masks[1].coverage[there]);
            let [ray, same] = [(&cut.camera, [x, y]), (&camera, [x + 3, y + 2])]
                .map(|(c, [x, y])| c.ray(x as f64 + 0.5, y as f64 + 0.5).unwrap());
            assert_eq!(ray, same);
        }
        let refused = cut.cropped(Crop { bottom: 6, ..Crop::default() }).unwrap_err().to_string();
        assert!(refused.contains("a.png") && refused.contains("12x13"), "{refused}");
    }
}
