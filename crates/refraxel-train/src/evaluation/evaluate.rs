//! Scores of a part of the data: every view rendered and held against its photograph.

use super::error::EvaluateError;
use super::index_error::{IndexError, index_errors};
use super::rendering::{Rendering, render_by};
use super::score::{TruthChecksum, score, truth};
use crate::alignment::Alignment;
use crate::backend::{Backend, Layers, Marching, Objective};
use crate::cancel::{Cancel, Cancelled};
use crate::events::{Observer, Task};
use crate::exposures::{exposed, fitted};
use crate::metrics::{ImageScore, Scores};
use crate::poses::{find, is_black};
use refraxel_core::radiance::Pixel;
use refraxel_core::{Camera, Ray};
use refraxel_data::{Dataset, Part, Photo, View, load_photo};

/// Scores of a part of the data.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// Of the images.
    pub scores: Scores,
    /// Errors of the index, where the truth is known.
    pub index: Option<IndexError>,
    /// Checksum of the truth images: scores compare only where it is the same.
    pub truth_crc32: String,
}

/// What a run has learned, and how it is looked at.
#[derive(Clone, Copy)]
pub struct Learned<'a> {
    /// The scene.
    pub backend: &'a dyn Backend,
    /// What the photographs themselves have learned.
    pub alignment: &'a Alignment,
    /// How rays are marched.
    pub marching: &'a Marching,
}

/// Renders and scores a part of the data; `each` is told of every view, and may fail. Where photographs have learned their poses or
/// exposures, training views are rendered as learned; cameras of the others are [found](find) against the finished scene, and
/// exposures fitted, by half of their own pixels.
pub fn evaluate<E: From<EvaluateError>>(
    learned: Learned<'_>,
    data: &Dataset,
    part: Part,
    observer: &mut Observer,
    each: &mut dyn FnMut(&View, &Rendering, &ImageScore) -> Result<(), E>,
) -> Result<Evaluation, E> {
    let pixels = |rays: &[Ray<f32>]| learned.backend.render(rays, learned.marching, Layers::All);
    evaluate_by(learned, data, part, pixels, observer, each)
}

/// The same with `pixels` to say what rays show of what the backend holds. Cameras that have to be found are found by the backend.
pub fn evaluate_by<E: From<EvaluateError>>(
    Learned { backend, alignment, marching }: Learned<'_>,
    data: &Dataset,
    part: Part,
    pixels: impl Fn(&[Ray<f32>]) -> Vec<Pixel<f32>>,
    observer: &mut Observer,
    each: &mut dyn FnMut(&View, &Rendering, &ImageScore) -> Result<(), E>,
) -> Result<Evaluation, E> {
    let indices = part.views(data);
    if indices.is_empty() {
        return Err(EvaluateError::NoViews { part }.into());
    }
    let (mut scores, mut truths) = (Vec::new(), TruthChecksum::default());
    for (k, &i) in indices.iter().enumerate() {
        let progress = observer.progress(Task::Evaluating, k as u64, indices.len() as u64);
        progress.map_err(EvaluateError::from)?;
        let view = &data.views[i];
        let photo = load_photo(view).map_err(EvaluateError::from)?;
        let learned = (part == Part::Train).then_some(k);
        let camera = camera(backend, (view, &photo), data, learned, alignment, (marching, observer.cancel()));
        let camera = camera.map_err(EvaluateError::from)?;
        let rendering = render_by(backend, &camera, observer.cancel(), &pixels);
        let mut rendering = rendering.map_err(EvaluateError::from)?;
        let shown = truth(&photo, data.backdrop);
        if let Some(exposures) = &alignment.exposures {
            let is_black = |p: usize| is_black(p as u32 % camera.width, p as u32 / camera.width);
            let found = || fitted(&rendering.colour, &shown, is_black);
            let gain = learned.map_or_else(found, |view| exposures.gain(view));
            exposed(&mut rendering.colour, gain);
        }
        let score = score(&rendering, view, &photo, data.backdrop).map_err(EvaluateError::from)?;
        each(view, &rendering, &score)?;
        scores.push(score);
        truths.add(&shown);
    }
    let index = index_errors(data, backend.medium());
    Ok(Evaluation { scores: Scores::new(scores), index, truth_crc32: truths.text() })
}

/// Where the camera of a photograph is: of a training view as learned, of another one as its own pixels say.
fn camera(
    backend: &dyn Backend,
    (view, photo): (&View, &Photo),
    data: &Dataset,
    learned: Option<usize>,
    alignment: &Alignment,
    (marching, cancel): (&Marching, &Cancel),
) -> Result<Camera, Cancelled> {
    match (&alignment.poses, learned) {
        (None, _) => Ok(view.camera),
        (Some(poses), Some(k)) => Ok(poses.camera(k, &view.camera)),
        (Some(poses), None) => {
            let objective = Objective::still(*marching);
            let training = data.split.train.iter().map(|&i| &data.views[i].camera);
            let view = View { camera: alignment.with_lens(&view.camera, training), ..view.clone() };
            find(backend, &objective, (&view, photo), data.backdrop, poses.unit(), cancel)
        }
    }
}
