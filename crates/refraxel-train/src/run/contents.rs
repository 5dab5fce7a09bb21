//! All that a run consists of.

use super::source::Source;
use super::state::State;
use crate::alignment::Alignment;
use crate::model::{Gate, Model, Optimiser};
use crate::options::Options;
use crate::plan::Plan;
use crate::schedule::Progress;

/// A run: everything needed to render it or to go on training.
#[derive(Clone, Debug)]
pub struct Run {
    /// Its options.
    pub options: Options,
    /// Its plan.
    pub plan: Plan,
    /// Where it stands.
    pub state: State,
    /// What it was trained on.
    pub source: Source,
    /// Its parameters.
    pub model: Model,
    /// The state of its optimiser.
    pub optimiser: Optimiser,
    /// What was found without masks.
    pub detected: Option<Gate>,
    /// What its photographs themselves have learned.
    pub alignment: Alignment,
}

/// A run that somebody else holds: saving copies nothing.
#[derive(Clone, Copy, Debug)]
pub struct RunRef<'a> {
    /// See [`Run`].
    pub options: &'a Options,
    /// See [`Run`].
    pub plan: &'a Plan,
    /// See [`Run`].
    pub state: &'a State,
    /// See [`Run`].
    pub source: &'a Source,
    /// See [`Run`].
    pub model: &'a Model,
    /// See [`Run`].
    pub optimiser: &'a Optimiser,
    /// See [`Run`].
    pub detected: Option<&'a Gate>,
    /// See [`Run`].
    pub alignment: &'a Alignment,
}

impl Run {
    /// The run without its ownership.
    pub fn view(&self) -> RunRef<'_> {
        let Self { options, plan, state, source, model, optimiser, detected, alignment } = self;
        let detected = detected.as_ref();
        RunRef { options, plan, state, source, model, optimiser, detected, alignment }
    }
}

impl RunRef<'_> {
    /// Whether the run has reached its end.
    pub(crate) fn is_finished(&self) -> bool {
        Progress::of(self.options, self.state.step, self.state.seconds).0 >= 1.0
    }

    /// A copy.
    pub fn to_owned(&self) -> Run {
        Run {
            options: self.options.clone(),
            plan: self.plan.clone(),
            state: self.state.clone(),
            source: self.source.clone(),
            model: self.model.clone(),
            optimiser: self.optimiser.clone(),
            detected: self.detected.cloned(),
            alignment: self.alignment.clone(),
        }
    }
}
