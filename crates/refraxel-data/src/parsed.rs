//! What an importer reads: everything that the files of a dataset state, before images are looked at and poses are
//! checked.

pub(crate) use crate::part::Part;
use crate::{
    Backdrop, DataError, DepthFile, Format, MaskMeaning, OpenOptions, Problem, camera, root::Root, size::Size,
};
use refraxel_core::{Aabb, Camera, Lens, Mat3, Pose, Vec3};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A dataset as its files state it. [`assemble`](crate::assemble) makes a [`Dataset`](crate::Dataset) of it.
pub(crate) struct ParsedDataset {
    pub root: Root,
    pub format: Format,
    pub frames: Vec<Frame>,
    /// What gave [`Frame::part`], where the description states a split by frame or by file.
    pub split_rule: Option<String>,
    /// Lists of image names in the description; they override [`ParsedDataset::split_rule`].
    pub split_lists: Vec<(Part, Vec<String>)>,
    pub backdrop: Option<Backdrop>,
    /// The layout is that of renderings, which stand before one colour unless their borders say otherwise.
    pub synthetic: bool,
    pub stated_box: Option<Aabb<f64>>,
    /// Unit vector upwards, where the tool has measured it.
    pub up: Option<Vec3<f64>>,
    pub points: Vec<Vec3<f64>>,
    /// Where the colours of points are, if they have some.
    pub coloured: Option<Coloured>,
    pub depth_range: Option<[f64; 2]>,
    pub problems: Vec<Problem>,
}

impl ParsedDataset {
    /// A dataset without frames, to which an importer adds what it reads.
    pub fn new(root: Root, format: Format) -> Self {
        Self {
            root,
            format,
            frames: Vec::new(),
            split_rule: None,
            split_lists: Vec::new(),
            backdrop: None,
            synthetic: false,
            stated_box: None,
            up: None,
            points: Vec::new(),
            coloured: None,
            depth_range: None,
            problems: Vec::new(),
        }
    }

    /// Whether the layout is that of renderings.
    pub fn is_rendered(&self) -> bool {
        self.format == Format::Nsvf || self.synthetic
    }

    /// Such a dataset whose files lie in a folder, or outside of it where that is allowed.
    pub fn below(folder: &Path, format: Format, options: &OpenOptions) -> Result<Self, DataError> {
        Ok(Self::new(Root::new(folder, options.allow_outside)?, format))
    }

    /// Such a dataset whose files lie beside the one that describes them.
    pub fn beside(file: &Path, format: Format, options: &OpenOptions) -> Result<Self, DataError> {
        Self::below(file.parent().unwrap_or(Path::new("")), format, options)
    }
}

/// Files of points with colours, which are read where pictures have to be compared with them.
#[derive(Clone, Debug)]
pub(crate) enum Coloured {
    /// The folder of a COLMAP model.
    Colmap(PathBuf),
    /// A PLY file.
    Ply(PathBuf),
}

/// A coloured point that a picture shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sighting {
    pub position: Vec3<f64>,
    /// sRGB.
    pub colour: [u8; 3],
}

/// One view as its file states it.
pub(crate) struct Frame {
    pub origin: Origin,
    /// The image's name as stated.
    pub file: String,
    /// The image, if it exists.
    pub image: Option<PathBuf>,
    /// The mask that the file names, if it exists.
    pub mask: Option<(PathBuf, StatedMask)>,
    /// The depth map that the file names, if it exists.
    pub depth: Option<DepthFile>,
    pub part: Option<Part>,
    pub intrinsics: Intrinsics,
    /// Camera to world, OpenCV axes; the rotation is not checked yet.
    pub pose: Pose,
    /// Why it cannot be used, where its file already shows that.
    pub lost: Option<Loss>,
}

impl Frame {
    /// A frame that has its place among the others and cannot be used.
    pub fn lost(origin: Origin, file: String, loss: Loss) -> Self {
        let intrinsics =
            Intrinsics { size: None, focal: Focal::Panorama, center: None, lens: Lens::Equirectangular };
        let pose = Pose { rotation: Mat3::identity(), translation: Vec3::splat(0.0) };
        Self {
            origin,
            file,
            image: None,
            mask: None,
            depth: None,
            part: None,
            intrinsics,
            pose,
            lost: Some(loss),
        }
    }
}

/// Why a view of the files cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Loss {
    /// Its frame names no image.
    NoName,
    /// Its camera was not found.
    NoPose,
    NoImage,
    /// Another view has the image that this one may mean.
    Taken,
    Empty,
    /// A picture that ends early.
    Cut,
    /// No picture.
    Undecodable,
    /// A picture that is as wide as its camera states to be high, and the other way round.
    Turned,
}

/// Where a frame was stated, for messages.
#[derive(Clone, Debug)]
pub(crate) struct Origin {
    pub path: Arc<PathBuf>,
    pub key: String,
}

/// What a file says about the meaning of its masks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StatedMask {
    /// The key or the folder has one meaning everywhere.
    Context(MaskMeaning),
    /// It depends on the dataset.
    Open,
    /// It depends on the masks: tools write what to use and what an object covers under the same key.
    Shown,
    /// An alpha channel: what is covered is used, unless it shows something refractive.
    Alpha,
}

/// Focal length as stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Focal {
    /// (fx, fy) [pixel of the stated size].
    Pixels([f64; 2]),
    /// Full field of view.
    Angles(FieldOfView),
    /// The whole sphere across the image.
    Panorama,
}

/// Full fields of view as stated [rad]; where pixels are square, one tells the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FieldOfView {
    /// Across the width.
    X(f64),
    /// Across the height.
    Y(f64),
    /// Across both.
    Both([f64; 2]),
}

impl FieldOfView {
    /// The focal lengths in a picture of this size [pixel].
    pub fn focal(self, [w, h]: [f64; 2]) -> [f64; 2] {
        let focal = |edge: f64, angle: f64| 0.5 * edge / (0.5 * angle).tan();
        match self {
            Self::X(x) => [focal(w, x); 2],
            Self::Y(y) => [focal(h, y); 2],
            Self::Both([x, y]) => [focal(w, x), focal(h, y)],
        }
    }
}

/// Intrinsics as stated, for an image size that may differ from the real one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Intrinsics {
    /// Stated size [pixel]; may be fractional.
    pub size: Option<[f64; 2]>,
    pub focal: Focal,
    /// Principal point [pixel of the stated size]; the middle when not stated.
    pub center: Option<[f64; 2]>,
    pub lens: Lens,
}

impl Intrinsics {
    /// The size of pictures of which the stated principal point is the middle, where no size is stated and the image has the same shape
    /// and clearly another size, to which the focal length belongs as well.
    pub fn implied_size(&self, real: Size) -> Option<[f64; 2]> {
        /// Sizes within this factor are one, whose principal point is off.
        const CLEAR: f64 = 1.4;
        /// Shapes within this factor are one.
        const SHAPE: f64 = 1.05;
        /// Focal lengths of more edges are not those of the size, as where a middle of 0.5 has no unit and they have.
        const LONGEST: f64 = 10.0;
        let Focal::Pixels(focal) = self.focal else { return None };
        let size = self.center.filter(|_| self.size.is_none())?.map(|c| 2.0 * c);
        if focal[0].max(focal[1]) > LONGEST * size[0].max(size[1]) {
            return None;
        }
        let [x, y] = [size[0] / f64::from(real.width), size[1] / f64::from(real.height)];
        let is_shape = x > 0.0 && y > 0.0 && (x / y).max(y / x) < SHAPE;
        (is_shape && x.max(1.0 / x) > CLEAR).then_some(size)
    }

    /// Whether an image of this size lies on its side for the camera: width and height change places, and they differ.
    pub fn lies_across(&self, real: Size) -> bool {
        /// Shapes within this factor are equal: reduced copies of a few hundred pixels are rounded by less.
        const EQUAL: f64 = 1.01;
        /// Pictures whose edges differ by less than this factor could be square ones that were cropped.
        const CLEAR: f64 = 1.05;
        let ratio = |a: f64, b: f64| (a / b).max(b / a);
        let [rw, rh] = [f64::from(real.width), f64::from(real.height)];
        self.size.is_some_and(|[w, h]| ratio(rw, rh) > CLEAR && ratio(w / h, rh / rw) < EQUAL)
    }

    /// Whether the stated principal point is nearer to the middle of a picture with width and height in exchange than to that of the
    /// stated size: then these were exchanged where the file was written.
    pub fn has_swapped_size(&self) -> bool {
        /// So much nearer: a calibrated point is off the middle by less than a tenth of an edge, while the middles of both sizes are half
        /// of the difference of edges apart.
        const NEARER: f64 = 0.5;
        let (Some([w, h]), Some([x, y])) = (self.size, self.center) else { return false };
        let away = |w: f64, h: f64| (x - 0.5 * w).hypot(y - 0.5 * h);
        away(h, w) < NEARER * away(w, h)
    }

    /// The camera of an image that really has `size`; the stated values are scaled to it.
    pub fn camera(&self, size: Size, pose: Pose, origin: &Origin) -> Result<Camera, DataError> {
        let real = [f64::from(size.width), f64::from(size.height)];
        let [w, h] = self.size.unwrap_or(real);
        let focal = match self.focal {
            Focal::Pixels(focal) => focal,
            Focal::Angles(angles) => angles.focal([w, h]),
            Focal::Panorama => [w / (2.0 * PI), h / PI],
        };
        let center = self.center.unwrap_or([0.5 * w, 0.5 * h]);
        let scale = [real[0] / w, real[1] / h];
        let camera = Camera {
            width: size.width,
            height: size.height,
            focal: [focal[0] * scale[0], focal[1] * scale[1]],
            center: [center[0] * scale[0], center[1] * scale[1]],
            lens: self.lens,
            world_from_camera: pose,
        };
        let refused =
            |fault| DataError::Camera { path: origin.path.to_path_buf(), key: origin.key.clone(), fault };
        camera::check(&camera).map_err(refused)?;
        Ok(camera)
    }
}
