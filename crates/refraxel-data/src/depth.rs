//! Depth that a sensor measured, or a renderer: maps beside photographs.

use crate::decoding::{self, Header};
use crate::formats::{lzfse, npy};
use crate::{Crop, DataError, Orientation, PhotoSource, Problem, View, limits};
use ::image::DynamicImage;
use refraxel_core::Vec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A depth map in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthFile {
    /// A picture of one channel (16 bits, or floating point in EXR), a NumPy array of (height, width), or compressed numbers. 0 means
    /// that nothing was measured.
    pub path: PathBuf,
    /// Scene units along the optical axis per step of its values.
    pub unit: f64,
    /// Columns and rows, at least 1 each, of numbers compressed by LZFSE (Record3D), whose file does not state them; `None` for other
    /// files.
    pub size: Option<[u32; 2]>,
}

/// Depths of a photograph, on a lattice of their own: sensors of depth have fewer pixels than cameras.
#[derive(Clone, Debug, PartialEq)]
pub struct Depth {
    /// Columns and rows.
    size: [u32; 2],
    /// Depth along the optical axis [scene unit], rows from the top; NaN where it is unknown.
    values: Vec<f32>,
    /// Which part of it the photograph covers: left, top, right, bottom, as shares of width and height.
    part: [f64; 4],
}

impl Depth {
    /// A map of (height, width), rows from the top, of depths along the optical axis [scene unit]; what is not a number above 0 is
    /// unknown.
    ///
    /// # Panics
    /// If there is not one value per place of the map, or none.
    pub fn new(size: [u32; 2], mut values: Vec<f32>) -> Self {
        let count = size[0] as usize * size[1] as usize;
        assert!(count > 0 && values.len() == count, "{} values for {size:?}", values.len());
        values.iter_mut().filter(|v| !v.is_finite() || **v <= 0.0).for_each(|v| *v = f32::NAN);
        Self { size, values, part: [0.0, 0.0, 1.0, 1.0] }
    }

    /// Depth at a place of the photograph, given as shares of its width and height; NaN where it is unknown.
    pub fn at(&self, place: [f64; 2]) -> f32 {
        let [x, y] = std::array::from_fn(|a| {
            let share = self.part[a] + place[a] * (self.part[2 + a] - self.part[a]);
            ((share * f64::from(self.size[a])) as usize).min(self.size[a] as usize - 1)
        });
        self.values[y * self.size[0] as usize + x]
    }

    /// That of a photograph of this size from which borders are cut off.
    #[must_use]
    pub(crate) fn cropped(&self, crop: Crop, [width, height]: [u32; 2]) -> Self {
        let [w, h] = [width, height].map(f64::from);
        let cut = [f64::from(crop.left) / w, f64::from(crop.top) / h];
        let kept = [1.0 - f64::from(crop.right) / w, 1.0 - f64::from(crop.bottom) / h];
        let of = |share: f64, a: usize| self.part[a] + share * (self.part[2 + a] - self.part[a]);
        Self { part: [of(cut[0], 0), of(cut[1], 1), of(kept[0], 0), of(kept[1], 1)], ..self.clone() }
    }

    /// Depths that are known, in no order.
    fn known(&self) -> impl Iterator<Item = f32> + '_ {
        self.values.iter().copied().filter(|v| v.is_finite())
    }
}

/// The depth map of a file.
///
/// Errors: it cannot be read, has more than one channel, another shape than (height, width), or not the stated size.
pub(crate) fn load(file: &DepthFile) -> Result<Arc<Depth>, DataError> {
    let DepthFile { path, unit, size } = file;
    let (size, values) = if let Some(size) = *size {
        (size, lzfse::floats(path, &limits::read(path, limits::BINARY_BYTES)?, size)?)
    } else if is_array(path) {
        let array = npy::array(path, &limits::read(path, limits::BINARY_BYTES)?)?;
        let shape: Option<[usize; 2]> = match array.shape[..] {
            [height, width] | [height, width, 1] | [1, height, width] => Some([width, height]),
            _ => None,
        };
        let size = shape.filter(|s| s.iter().all(|n| (1..=u32::MAX as usize).contains(n)));
        let size = size.ok_or_else(|| DataError::Value {
            path: path.clone(),
            key: "the 'shape'".into(),
            found: format!("{:?}", array.shape),
            expected: "(height, width) of a depth map",
        })?;
        (size.map(|n| n as u32), array.values)
    } else {
        single_channel(path)?
    };
    Ok(Arc::new(Depth::new(size, values.into_iter().map(|v| (v * unit) as f32).collect())))
}

/// The values of a picture of one channel, as they are stored: whole numbers, or floating-point ones.
fn single_channel(path: &Path) -> Result<([u32; 2], Vec<f64>), DataError> {
    let decoded = decoding::decode(path)?.image;
    let size = [decoded.width(), decoded.height()];
    let values = match decoded {
        DynamicImage::ImageLuma8(image) => image.into_raw().into_iter().map(f64::from).collect(),
        DynamicImage::ImageLuma16(image) => image.into_raw().into_iter().map(f64::from).collect(),
        // Formats of floating-point numbers are decoded with three equal channels.
        DynamicImage::ImageRgb32F(image) => image.pixels().map(|p| f64::from(p.0[0])).collect(),
        DynamicImage::ImageRgba32F(image) => image.pixels().map(|p| f64::from(p.0[0])).collect(),
        other => {
            let (path, key, found) = (path.to_owned(), "the pixels".into(), format!("{:?}", other.color()));
            return Err(DataError::Value {
                path,
                key,
                found,
                expected: "a depth map: one channel of 8 or 16 bits, or EXR",
            });
        }
    };
    Ok((size, values))
}

fn is_array(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"))
}

/// Leaves out the maps of photographs that are turned upright: whether a map is turned, too, nothing says.
pub(crate) fn leave_out_turned(views: &mut [View], headers: &[Header]) -> Option<Problem> {
    let mut count = 0;
    for (view, header) in views.iter_mut().zip(headers) {
        let is_upright = matches!(view.source, PhotoSource::Files { orientation: Orientation::Upright, .. });
        if header.turned() && is_upright && view.depth.take().is_some() {
            count += 1;
        }
    }
    (count > 0).then(|| {
        Problem::warning(format!(
            "{count} depth maps are not used: their photographs are turned upright by an orientation tag (EXIF), and nothing says whether \
             the maps are turned, too; store both upright and without a tag"
        ))
    })
}

/// Views that are looked at to check depth against the points of a reconstruction, at most.
const LOOKED_AT: usize = 8;
/// Fewest points in maps that tell whether a unit is right.
const ENOUGH: usize = 20;
/// A unit is right if half of the points lie within this factor of what maps say.
const AGREES: f64 = 1.15;

/// What is said about the depth maps of these views: how many there are and their unit; and whether the points of the reconstruction lie
/// where they say. Where these do not, no view keeps its map.
///
/// Errors: a map that is looked at cannot be read.
pub(crate) fn check(views: &mut [View], points: &[Vec3<f64>]) -> Result<Vec<Problem>, DataError> {
    let with: Vec<usize> = (0..views.len()).filter(|&k| views[k].depth.is_some()).collect();
    let Some(first) = with.first().and_then(|&k| views[k].depth.clone()) else { return Ok(Vec::new()) };
    let (mut ratios, mut known) = (Vec::new(), 0);
    for &k in with.iter().step_by(with.len().div_ceil(LOOKED_AT)) {
        let View { camera, depth: Some(file), .. } = &views[k] else { continue };
        let map = load(file)?;
        known += map.known().count();
        for point in points {
            let Some([u, v]) = camera.project_into(*point) else { continue };
            let place = [u / f64::from(camera.width), v / f64::from(camera.height)];
            let depth = camera.forward().dot(*point - camera.world_from_camera.translation);
            ratios.push(depth / f64::from(map.at(place)));
        }
    }
    ratios.retain(|r| r.is_finite());
    ratios.sort_by(f64::total_cmp);
    let counted = format!("{} of {} views have a depth map", with.len(), views.len());
    let ratio = ratios.get(ratios.len() / 2).copied().filter(|_| ratios.len() >= ENOUGH);
    let is_wrong = |r: f64| !(1.0 / AGREES..=AGREES).contains(&r);
    let refused = match ratio {
        _ if known == 0 => Some("they hold no depth above 0".to_owned()),
        Some(r) if is_wrong(r) => Some(format!(
            "points of the reconstruction lie {r:.3} times as far away as they say, so their unit is not that of the poses; state \
             \"depth_unit_scale_factor\": {:.6} if that is so",
            first.unit * r
        )),
        _ => None,
    };
    if let Some(why) = refused {
        views.iter_mut().for_each(|view| view.depth = None);
        return Ok(vec![Problem::warning(format!("{counted}, which are not used: {why}"))]);
    }
    let checked = match ratio {
        Some(r) => format!("points of the reconstruction lie {r:.3} times as far away"),
        None => "nothing says whether that is the unit of the poses".to_owned(),
    };
    let unit = first.unit;
    Ok(vec![Problem::note(format!(
        "{counted}, {unit} scene units a step; {checked} (--set field.depth=0 trains without them)"
    ))])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cropped_photograph_has_the_depths_of_what_is_left() {
        let values: Vec<f32> = (1..=32).map(|v| v as f32).collect();
        let map = Depth::new([8, 4], values);
        // A photograph of twice the resolution.
        let crop = Crop { left: 4, top: 2, right: 2, bottom: 0 };
        let left = map.cropped(crop, [16, 8]);
        for (y, x) in (0..6).flat_map(|y| (0..10).map(move |x| (y, x))) {
            let at = |x: u32, y: u32, w: f64, h: f64| [(f64::from(x) + 0.5) / w, (f64::from(y) + 0.5) / h];
            assert_eq!(left.at(at(x, y, 10.0, 6.0)), map.at(at(x + 4, y + 2, 16.0, 8.0)), "{x} {y}");
        }
    }

    #[test]
    fn what_was_not_measured_is_unknown() {
        let map = Depth::new([2, 2], vec![0.0, 1.5, f32::INFINITY, -2.0]);
        let known = [[0.2, 0.2], [0.8, 0.2], [0.2, 0.8], [0.8, 0.8]].map(|p| map.at(p).is_finite());
        assert_eq!(known, [false, true, false, false]);
    }
}
