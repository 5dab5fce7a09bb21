//! Scores and pictures of a run under way.

use super::SessionError;
use super::start::Session;
use crate::cancel::Cancelled;
use crate::evaluation::{EvaluateError, Evaluation, Learned, Rendering, evaluate, render};
use crate::events::{Event, Observer};
use crate::schedule::rendering_marching;
use refraxel_core::Camera;
use refraxel_data::{Part, View};

impl Session {
    /// Render and score a part of the data; `each` sees every view. Rays skip the cells that training skips, as of its last
    /// look at most 32 steps ago; [`refresh_occupancy`](crate::backend::Backend::refresh_occupancy) on a copy sees the latest ones too.
    pub fn evaluate(
        &self,
        part: Part,
        observer: &mut dyn FnMut(Event),
        each: &mut dyn FnMut(&View, &Rendering),
    ) -> Result<Evaluation, SessionError> {
        let marching = rendering_marching(self.trainer.options(), self.trainer.plan().near);
        let mut observer = Observer::new(&self.cancel, observer);
        let mut each = |view: &View, rendering: &Rendering, _: &_| {
            each(view, rendering);
            Ok::<(), SessionError>(())
        };
        let (backend, alignment) = (self.backend(), self.trainer.alignment());
        let learned = Learned { backend, alignment, marching: &marching };
        let found = evaluate(learned, &self.data, part, &mut observer, &mut each);
        if let Err(SessionError::Evaluate(EvaluateError::Cancelled(_))) = &found {
            self.cancel.reset();
        }
        found
    }

    /// What a camera sees, unless somebody wishes to stop.
    pub fn render(&self, camera: &Camera) -> Result<Rendering, Cancelled> {
        let marching = rendering_marching(self.trainer.options(), self.trainer.plan().near);
        let rendering = render(self.backend(), camera, &marching, &self.cancel);
        if rendering.is_err() {
            self.cancel.reset();
        }
        rendering
    }
}
