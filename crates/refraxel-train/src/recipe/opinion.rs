//! What prediction says of a region: whether rays bend there, and the evidence.

use super::hypotheses::Body;
use super::look::{JUDGED, Look, SURELY, Standing};
use crate::backend::Backend;
use crate::events::{Event, Watch};
use crate::evidence::{Detail, Difference, Predicted, Scores, Shown, interval, predict, without_bending};
use crate::model::Refraction;
use crate::verdict::Evidence;

/// A verdict needs a prediction that scores more than looking straight through by this much, and by so many standard errors.
const LEAST_SCORE: f64 = 0.05;
const SIGNIFICANT: f64 = 3.0;
/// From so many standard errors on it may be right: further views decide, or a race.
const GLIMPSED: f64 = 1.0;
/// Straight rays that have learned what is inside the masks explain it if they make up for this part of what the prediction lacks.
const EXPLAINED: f64 = 0.5;
/// Straight rays that score this much see what is there.
const OPAQUE: f64 = 0.9;

/// What prediction says of a region.
#[derive(Default)]
pub(super) struct Opinion {
    /// Whether rays bend there, if it knows.
    pub(super) bends: Option<bool>,
    /// It shows more than looking straight through, but not surely.
    pub(super) is_glimpsed: bool,
    pub(super) evidence: Option<Evidence>,
}

/// What is known of a region but for straight rays that have learned its inside.
pub(super) struct Judged {
    predicted: Predicted,
    scores: Scores,
    through: Scores,
    others: Difference,
    /// By how much its numbers alone score more than looking straight through, in all views that straight rays learned from.
    in_learned: Difference,
    index: Option<[f32; 2]>,
    pub(super) shown: Option<Shown>,
}

impl Look<'_> {
    /// The evidence on views kept aside.
    pub(super) fn judged<B: Backend>(
        &mut self,
        at: &Standing<B>,
        region: usize,
        watch: &mut Watch,
    ) -> Option<Judged> {
        let candidate = self.standing.as_mut()?;
        let place = self.sketch.as_ref().unwrap_or(self.region);
        let unknowns = (candidate.proposal.unknowns)(self.region);
        let telling = candidate.telling(self.region);
        let found = interval(candidate.values[telling], unknowns[telling].range, |n| {
            let mut other = candidate.clone();
            other.values[telling] = n;
            let bodies = other.bodies(place, self.options);
            at.predicted(&self.seen.scanned, Detail::Fine, bodies).scores(&self.seen.scanned)
        });
        let index = found.map(|f| f.range);
        if let Some(found) = found {
            candidate.values[telling] = found.best;
        }
        let unbent = |bodies: &[Body]| -> Vec<Body> {
            bodies.iter().map(|b| Body { grid: without_bending(&b.grid), ..b.clone() }).collect()
        };
        let plain = self.unrefined.as_ref().unwrap_or(candidate).bodies(place, self.options);
        let learned = &self.seen.learned;
        let in_learned =
            [unbent(&plain), plain].map(|bodies| at.predicted(learned, JUDGED, bodies).scores(learned));
        let in_learned = in_learned[1].above(&in_learned[0]);
        let bodies = candidate.bodies(place, self.options);
        let straight = unbent(&bodies);
        let [bent, straight] = [bodies, straight].map(|bodies| at.medium(bodies));
        let of = |medium: &Refraction| predict(at.backend, &at.marching, &self.seen.aside, JUDGED, medium);
        let predicted = of(&bent);
        let (scores, through) = (predicted.scores(&self.seen.aside), of(&straight).scores(&self.seen.aside));
        let shown = scores.middle().and_then(|(view, score)| {
            let media = [(&straight, through.of_view(view)), (&bent, score)];
            Shown::new(at.backend, &at.marching, (&self.seen.aside, view), media, region)
        });
        let others = predicted.scores_of_others(&self.seen.aside).mean();
        watch.tell(Event::IndexSearched {
            region,
            hypothesis: candidate.proposal.kind,
            found: candidate.found(self.region),
            misfit: 1.0 - scores.mean().mean,
        });
        Some(Judged { predicted, scores, through, others, in_learned, index, shown })
    }

    /// Whether rays bend here.
    pub(super) fn opinion(&self, judged: &Judged, trained: &Predicted) -> Opinion {
        let Judged { predicted, scores, through, others, in_learned, index, .. } = judged;
        let straight = predicted.scores_of(trained, &self.seen.aside);
        let (above, lacks) = (scores.above(through), straight.above(scores));
        let evidence = Evidence {
            predicted: scores.mean(),
            straight_through: through.mean(),
            other_photographs: *others,
            trained_straight: straight.mean(),
            above,
            index: *index,
        };
        // Straight rays that show nearly everything leave nothing to explain. Otherwise what stands in a body, which is seen through it
        // alone, may be what they have learned, and what prediction lacks.
        let is_more = |d: Difference, errors: f64| d.mean > LEAST_SCORE && d.significance() > errors;
        // Few views kept aside leave faint evidence open. All others decide then, by numbers alone: a surface that was refined fits them
        // by chance, and looking straight through gains by what straight rays fitted to them.
        let is_seen = (is_more(above, SIGNIFICANT)
            || is_more(above, GLIMPSED) && is_more(*in_learned, SIGNIFICANT))
            && evidence.predicted.mean > others.mean + SURELY * others.error;
        let is_explained = lacks.mean > EXPLAINED * (1.0 - evidence.predicted.mean)
            && (is_seen || evidence.trained_straight.mean > OPAQUE);
        // What is seen in a cavity, which nobody knows before it is learned, straight rays may explain, and a prediction cannot.
        let is_unknown = is_seen == is_explained || (is_explained && !self.options.judge.straight.is_on());
        let is_glimpsed = is_more(above, GLIMPSED) && !is_seen && !is_explained;
        Opinion { bends: (!is_unknown).then_some(is_seen), is_glimpsed, evidence: Some(evidence) }
    }
}
