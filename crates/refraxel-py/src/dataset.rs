//! Posed photographs, from files or from arrays.

use crate::arrays::shaped;
use crate::camera::Camera;
use crate::errors::{of_data, refused};
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use refraxel::verbs::files::absolute;
use refraxel_core::Vec3;
use refraxel_data::{
    Backdrop, Crop, Image, Mask, MaskMeaning, OpenOptions, Orientation, Photo, Pixels, PosedPhoto, Reduction,
    Split, load_photo, scene_region,
};
use refraxel_train::run::Source;
use std::path::PathBuf;

/// Posed photographs with masks and a split into training, validation and test views.
#[pyclass(frozen, module = "refraxel")]
pub struct Dataset {
    /// The data. Pixels in memory are shared with whoever trains on them.
    pub data: refraxel_data::Dataset,
    /// Where they come from, for runs to tell.
    pub source: Source,
}

impl Dataset {
    /// Data that came from no file.
    pub fn in_memory(data: refraxel_data::Dataset) -> Self {
        Self { source: Source::of(&data), data }
    }

    fn view(&self, index: usize) -> PyResult<&refraxel_data::View> {
        let count = self.data.views.len();
        self.data
            .views
            .get(index)
            .ok_or_else(|| refused(format!("there is no view {index}; there are {count}, from 0")))
    }
}

/// What the white of masks means.
pub fn meaning(name: &str) -> PyResult<MaskMeaning> {
    let expected = || refused(format!("mask_meaning is {name:?}; expected one of refractive, keep, ignore"));
    MaskMeaning::named(name).ok_or_else(expected)
}

/// Which pixels of images with an orientation tag are posed.
fn posed_pixels(name: &str) -> PyResult<Orientation> {
    match name {
        "stored" => Ok(Orientation::Stored),
        "upright" => Ok(Orientation::Upright),
        _ => Err(refused(format!("orientation is {name:?}; expected stored or upright"))),
    }
}

/// What lies behind: a word or a colour.
fn backdrop(value: &Bound<'_, PyAny>) -> PyResult<Backdrop> {
    if let Ok(colour) = value.extract::<[f32; 3]>() {
        return Ok(Backdrop::Color(colour));
    }
    let named = value.extract::<String>().ok().and_then(|text| text.parse().ok());
    named.ok_or_else(|| {
        refused(format!(
            "backdrop is {value}; expected \"surroundings\", \"transparent\", \"#rrggbb\" or three numbers from 0 to 1"
        ))
    })
}

/// An image of an array (height, width, 3 or 4), of uint8 or float32.
fn image(name: &str, array: &Bound<'_, PyAny>) -> PyResult<Image> {
    let wrong = |found: String| {
        refused(format!(
            "image {name} {found}; expected (height, width, 3 or 4) of uint8, or of float32 with 1 = white"
        ))
    };
    let (shape, pixels) = if let Ok(a) = array.extract::<PyReadonlyArrayDyn<'_, u8>>() {
        (a.shape().to_vec(), Pixels::U8(a.as_array().iter().copied().collect()))
    } else if let Ok(a) = array.extract::<PyReadonlyArrayDyn<'_, f32>>() {
        (a.shape().to_vec(), Pixels::F32(a.as_array().iter().copied().collect()))
    } else {
        return Err(wrong("is no numpy array of uint8 or float32".to_owned()));
    };
    match shape[..] {
        [height, width, channels @ (3 | 4)] => {
            Ok(Image { width: width as u32, height: height as u32, channels: channels as u32, pixels })
        }
        _ => Err(wrong(format!("has the shape {shape:?}"))),
    }
}

/// A mask of an array (height, width), of bool or uint8.
fn mask(name: &str, array: &Bound<'_, PyAny>) -> PyResult<Mask> {
    let wrong = |found: String| {
        refused(format!(
            "mask of {name} {found}; expected (height, width) of bool, or uint8 with 255 = white"
        ))
    };
    let (shape, coverage): (Vec<usize>, Vec<u8>) =
        if let Ok(a) = array.extract::<PyReadonlyArrayDyn<'_, bool>>() {
            (a.shape().to_vec(), a.as_array().iter().map(|&v| if v { 255 } else { 0 }).collect())
        } else if let Ok(a) = array.extract::<PyReadonlyArrayDyn<'_, u8>>() {
            (a.shape().to_vec(), a.as_array().iter().copied().collect())
        } else {
            return Err(wrong("is no numpy array of bool or uint8".to_owned()));
        };
    match shape[..] {
        [height, width] => Ok(Mask { width: width as u32, height: height as u32, coverage }),
        _ => Err(wrong(format!("has the shape {shape:?}"))),
    }
}

/// Which views train and which are held out.
fn split(
    count: usize,
    train: Option<Vec<usize>>,
    val: Vec<usize>,
    test: Option<Vec<usize>>,
    holdout: usize,
) -> Split {
    let is_held_out = |k: &usize| holdout > 0 && k.is_multiple_of(holdout);
    let (rule, held_out) = match test {
        Some(test) => ("as given".to_owned(), test),
        None if train.is_some() || holdout == 0 => ("none held out".to_owned(), Vec::new()),
        None => (format!("every {holdout}th view is held out"), (0..count).filter(is_held_out).collect()),
    };
    let rest = || (0..count).filter(|k| !held_out.contains(k) && !val.contains(k)).collect();
    Split { train: train.unwrap_or_else(rest), val, test: held_out, rule }
}

#[pymethods]
impl Dataset {
    /// Opens a dataset of any supported format; pixels are read when they are needed.
    ///
    /// holdout: hold out every n-th view where the data state no split (8 if absent, 0 for none). mask_meaning: what the white of all masks
    /// means, whatever the files say. backdrop: what lies behind everything ("surroundings", "transparent", "#rrggbb" or three numbers
    /// from 0 to 1), and alpha: what alpha channels mean ("backdrop", "mask" or "ignore"), whatever the photographs show. allow_outside:
    /// the data may name files outside of their folder. crop: pixels cut off each photograph and mask (left, top, right, bottom).
    /// orientation: which pixels of images with an orientation tag (EXIF) the poses belong to, "stored" or "upright", whatever the files
    /// say. up: which way is up, where the cameras do not say it. downscale: by which edges are divided (1 to 32), or the longer edge in
    /// pixels (64 or more); without it, images that are too large are reduced.
    #[staticmethod]
    #[pyo3(signature = (path, *, holdout = None, mask_meaning = None, allow_outside = false, crop = None, orientation = None,
        up = None, downscale = None, backdrop = None, alpha = None))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn open(
        py: Python<'_>,
        path: PathBuf,
        holdout: Option<usize>,
        mask_meaning: Option<&str>,
        allow_outside: bool,
        crop: Option<[u32; 4]>,
        orientation: Option<&str>,
        up: Option<[f64; 3]>,
        downscale: Option<u32>,
        backdrop: Option<Bound<'_, PyAny>>,
        alpha: Option<&str>,
    ) -> PyResult<Self> {
        let mask_meaning = mask_meaning.map(meaning).transpose()?;
        let crop =
            crop.map(|[left, top, right, bottom]| Crop { left, top, right, bottom }).unwrap_or_default();
        let up = up.map(Vec3::from);
        if up.is_some_and(|up| !(1e-6..1e6).contains(&up.length())) {
            return Err(refused("up has no direction; expected three numbers that are not all 0".to_owned()));
        }
        let backdrop = backdrop.map(|b| self::backdrop(&b)).transpose()?;
        let expected = |_| refused(format!("alpha is {alpha:?}; expected one of backdrop, mask, ignore"));
        let alpha = alpha.map(|alpha| alpha.parse().map_err(expected)).transpose()?;
        let orientation = orientation.map(posed_pixels).transpose()?;
        let options = OpenOptions {
            holdout,
            allow_outside,
            backdrop,
            alpha,
            mask_meaning,
            orientation,
            crop,
            up,
            ..OpenOptions::default()
        };
        let mut data = py.detach(|| refraxel_data::Dataset::open(&path, &options)).map_err(of_data)?;
        let reduction = match downscale.map(Reduction::try_from).transpose() {
            Ok(Some(reduction)) => {
                data.reduce(&(0..data.views.len()).collect::<Vec<_>>(), reduction);
                Some(reduction)
            }
            Ok(None) => data.fit(),
            Err(none) => return Err(refused(format!("downscale: {none}"))),
        };
        let source = Source {
            downscale: reduction.map(u32::from),
            ..Source::of_files(absolute(&path), &options, &data)
        };
        Ok(Self { source, data })
    }

    /// A dataset of images in memory, one (height, width, 3 or 4) array and one camera per view, at least 3.
    ///
    /// images: uint8, or float32 with 1 = white; sRGB-encoded, a fourth channel is straight alpha. masks: (height, width) bool or uint8,
    /// or None. train, val, test: numbers of views; without train and test every `holdout`-th view is held out. backdrop: what lies behind
    /// everything: "surroundings" (learned), "transparent" (images have alpha) or one colour. Arrays are copied once.
    #[staticmethod]
    #[pyo3(signature = (images, cameras, *, masks = None, names = None, train = None, val = Vec::new(), test = None, holdout = 8,
        backdrop = None, mask_meaning = "refractive"))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn from_arrays(
        images: Vec<Bound<'_, PyAny>>,
        cameras: Vec<Camera>,
        masks: Option<Vec<Option<Bound<'_, PyAny>>>>,
        names: Option<Vec<String>>,
        train: Option<Vec<usize>>,
        val: Vec<usize>,
        test: Option<Vec<usize>>,
        holdout: usize,
        backdrop: Option<Bound<'_, PyAny>>,
        mask_meaning: &str,
    ) -> PyResult<Self> {
        let (count, mask_meaning) = (images.len(), meaning(mask_meaning)?);
        let masks = masks.unwrap_or_else(|| vec![None; count]);
        let names = names.unwrap_or_else(|| (0..count).map(|k| format!("{k:04}.png")).collect());
        for (what, found) in [("cameras", cameras.len()), ("masks", masks.len()), ("names", names.len())] {
            if found != count {
                return Err(refused(format!(
                    "there are {found} {what} for {count} images; expected one each"
                )));
            }
        }
        let backdrop = backdrop.map_or(Ok(Backdrop::Surroundings), |b| self::backdrop(&b))?;
        let mut photos = Vec::with_capacity(count);
        for (((array, Camera(camera)), coverage), name) in images.iter().zip(cameras).zip(&masks).zip(names) {
            let coverage = coverage.as_ref().map(|m| mask(&name, m)).transpose()?;
            let photo = Photo::new(image(&name, array)?, coverage);
            photos.push(PosedPhoto { name, camera, photo, mask_meaning });
        }
        let split = split(count, train, val, test, holdout);
        if let Some(both) = split.test.iter().find(|k| split.train.contains(k)) {
            return Err(refused(format!(
                "view {both} is among train and test; scores of views that are trained on are meaningless, so name it once"
            )));
        }
        refraxel_data::Dataset::in_memory(photos, split, backdrop).map(Self::in_memory).map_err(of_data)
    }

    fn __len__(&self) -> usize {
        self.data.views.len()
    }

    /// Names of all views.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.data.views.iter().map(|v| v.name.as_str()).collect()
    }

    /// Cameras of all views.
    #[getter]
    fn cameras(&self) -> Vec<Camera> {
        self.data.views.iter().map(|v| Camera(self.data.origin.to_world(v.camera))).collect()
    }

    /// Numbers of the training views.
    #[getter]
    fn train(&self) -> Vec<usize> {
        self.data.split.train.clone()
    }

    /// Numbers of the validation views.
    #[getter]
    fn val(&self) -> Vec<usize> {
        self.data.split.val.clone()
    }

    /// Numbers of the held-out views.
    #[getter]
    fn test(&self) -> Vec<usize> {
        self.data.split.test.clone()
    }

    /// What was repaired, left out or looks wrong, one sentence each.
    #[getter]
    fn problems(&self) -> Vec<&str> {
        self.data.problems.iter().map(|p| p.message.as_str()).collect()
    }

    /// The box that training would choose, lower and upper corner, (2, 3) [scene unit].
    #[getter]
    fn bounds(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let bounds = self.data.origin.to_world(scene_region(&self.data).bounds);
        shaped(py, bounds.to_arrays().concat(), &[2, 3])
    }

    /// The point of the data's coordinates that computation begins at, (3,) [scene unit]: 0, unless the scene is far from there.
    #[getter]
    fn origin(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        shaped(py, self.data.origin.place().to_array().to_vec(), &[3])
    }

    /// The pixels of a view, (height, width, 3 or 4), as stored: uint8, or float32.
    fn image(&self, py: Python<'_>, index: usize) -> PyResult<Py<PyAny>> {
        let view = self.view(index)?;
        let photo = py.detach(|| load_photo(view)).map_err(of_data)?;
        let image = &photo.image;
        let shape = [image.height as usize, image.width as usize, image.channels as usize];
        match &image.pixels {
            Pixels::U8(pixels) => shaped(py, pixels.clone(), &shape),
            Pixels::F32(pixels) => shaped(py, pixels.clone(), &shape),
        }
    }

    /// The mask of a view, (height, width) uint8, or None.
    fn mask(&self, py: Python<'_>, index: usize) -> PyResult<Option<Py<PyAny>>> {
        let view = self.view(index)?;
        let photo = py.detach(|| load_photo(view)).map_err(of_data)?;
        let shape = |m: &Mask| [m.height as usize, m.width as usize];
        photo.mask.as_ref().map(|m| shaped(py, m.coverage.clone(), &shape(m))).transpose()
    }

    fn __repr__(&self) -> String {
        let split = &self.data.split;
        format!(
            "Dataset({}: {} views, {} train, {} val, {} test)",
            self.source.name(),
            self.data.views.len(),
            split.train.len(),
            split.val.len(),
            split.test.len()
        )
    }
}
