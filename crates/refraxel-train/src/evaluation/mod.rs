//! Rendering views and scoring them: pictures, a part of the data, errors of the index.

mod index_error;
mod posed;
mod rendering;
mod score;

pub use index_error::{IndexError, index_error};
pub use posed::posed;
pub use rendering::{Rendering, render, render_reflection, render_transmission};
pub use score::{score, truth, truth_checksum};

use crate::backend::{Backend, Marching};
use crate::cancel::Cancelled;
use crate::events::{Task, Watch};
use crate::exposures::{Exposures, exposed, fitted};
use crate::metrics::{ImageScore, MetricsError, Scores};
use crate::model::Refraction;
use crate::poses;
use refraxel_data::synth::IndexTruth;
use refraxel_data::{DataError, Dataset, View, load_photo};
use serde::{Deserialize, Serialize};

/// A part of a dataset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// The images trained on.
    Train,
    /// The images looked at during training.
    Val,
    /// The held-out images.
    #[default]
    Test,
}

impl Part {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
            Self::Test => "test",
        }
    }

    /// Its views, as indices.
    pub fn views(self, data: &Dataset) -> &[usize] {
        match self {
            Self::Train => &data.split.train,
            Self::Val => &data.split.val,
            Self::Test => &data.split.test,
        }
    }
}

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

/// Why a part cannot be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// There is nothing to evaluate.
    #[error("the data have no {part} images to evaluate; hold some out with --holdout, or evaluate --split train", part = part.name())]
    NoViews {
        /// The part that is empty.
        part: Part,
    },
    /// A photograph cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A picture cannot be scored.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
    /// Somebody wished to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Renders and scores a part of the data; `each` is told of every view, and may fail. Where exposures have learned, renderings are
/// exposed as their photographs: those of training views as learned, those of others as half of their pixels say.
pub fn evaluate<B: Backend, E: From<EvaluateError>>(
    backend: &B,
    data: &Dataset,
    part: Part,
    marching: &Marching,
    exposures: Option<&Exposures>,
    watch: &mut Watch,
    each: &mut dyn FnMut(&View, &Rendering, &ImageScore) -> Result<(), E>,
) -> Result<Evaluation, E> {
    let indices = part.views(data);
    if indices.is_empty() {
        return Err(EvaluateError::NoViews { part }.into());
    }
    let (mut scores, mut truths) = (Vec::new(), Vec::new());
    for (k, &i) in indices.iter().enumerate() {
        let progress = watch.progress(Task::Evaluating, k as u64, indices.len() as u64);
        progress.map_err(EvaluateError::from)?;
        let view = &data.views[i];
        let photo = load_photo(view).map_err(EvaluateError::from)?;
        let mut rendering = render(backend, &view.camera, marching);
        let shown = truth(&photo, data.backdrop);
        if let Some(exposures) = exposures {
            let is_black =
                |p: usize| poses::is_black(p as u32 % view.camera.width, p as u32 / view.camera.width);
            let found = || fitted(&rendering, &shown, is_black);
            let gain = if part == Part::Train { exposures.gain(k) } else { found() };
            exposed(&mut rendering, gain);
        }
        let score = score(&rendering, view, &photo, data.backdrop).map_err(EvaluateError::from)?;
        each(view, &rendering, &score)?;
        scores.push(score);
        truths.push(shown);
    }
    let truth_crc32 = truth_checksum(truths.iter().map(Vec::as_slice));
    Ok(Evaluation { scores: Scores::new(scores), index: index_errors(data, backend.medium()), truth_crc32 })
}

/// Errors of the index where the truth is known. Straight rays mean an index of 1 everywhere.
pub fn index_errors(data: &Dataset, refraction: &Refraction) -> Option<IndexError> {
    let truth = IndexTruth::from_scene_json(data.truth.as_ref()?)?;
    Some(index_error(&truth, |x| refraction.index(x.cast()).into()))
}
