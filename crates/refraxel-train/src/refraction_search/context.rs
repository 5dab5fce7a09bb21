//! What is known when rays begin to bend, and what comes of it.

use crate::cancel::Cancelled;
use crate::model::Gate;
use crate::options::Options;
use crate::rays::RaySampler;
use crate::schedule::Progress;
use crate::verdict::{Baseline, StayReason, Verdict};
use refraxel_data::{IndexSource, LocalOrigin};

/// Why nothing can bend.
#[derive(Debug, thiserror::Error)]
pub enum SearchError {
    /// Neither masks nor a box.
    #[error(
        "nothing says where the glass is: the dataset has no masks of refractive things; give masks (`refraxel mask` makes some), or \
         a box and its shape (--refraction-box x0,y0,z0,x1,y1,z1 --set shape.start=ball), or leave --refraction out, so that the \
         glass is searched for"
    )]
    Nowhere,
    /// The shape is to come from a file, and there is none.
    #[error("option `shape.start` is `file`, but no index is given; name its file with --index-from")]
    NoFile,
    /// What there is leads nowhere: rays stay straight.
    #[error(transparent)]
    Stay(#[from] StayReason),
    /// Somebody wished to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What is known when rays begin to bend.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// The photographs.
    pub sampler: &'a RaySampler,
    /// The options.
    pub options: &'a Options,
    /// Nothing nearer to a camera is seen [scene unit].
    pub near: f32,
    /// Where coordinates begin.
    pub origin: LocalOrigin,
    /// The index relative to that origin, where somebody knows it.
    pub index: Option<&'a IndexSource>,
    /// What was found where no mask shows it.
    pub found: Option<&'a Gate>,
    /// Where the run stands.
    pub progress: Progress,
}

/// What is decided when rays were to bend.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Why all rays stay straight, if they do.
    pub stays: Option<StayReason>,
    /// How it was decided, where there was a judge.
    pub verdict: Option<Verdict>,
    /// What straight rays had learned by then, where bent ones are judged by it later.
    pub baseline: Option<Baseline>,
}

impl Decision {
    pub(super) fn straight(why: StayReason, verdict: Option<Verdict>) -> Self {
        Self { stays: Some(why), verdict, baseline: None }
    }
}
