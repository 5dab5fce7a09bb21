//! What prediction says of a region: whether rays bend there, and the evidence.

use super::look::{JUDGED, Look, SURELY, Standing};
use crate::events::{Event, Observer};
use crate::evidence::{Detail, Difference, Predicted, Scores, Shown, Way, interval, predict};
use crate::model::Refraction;
use crate::verdict::Evidence;

/// A verdict needs a prediction that scores more than looking straight through by this much, and by so many standard errors.
const LEAST_SCORE: f64 = 0.05;
const SIGNIFICANT: f64 = 3.0;
/// From so many standard errors on it may be right: further views decide, or a race.
const GLIMPSED: f64 = 1.0;
/// Straight rays that have learned what is inside the masks explain it if they make up for this part of what the prediction lacks, or if
/// the prediction gains less over looking straight through than this part of what they gain over it.
const EXPLAINED: f64 = 0.5;
/// Straight rays that score this much see what is there.
const SEEN_STRAIGHT: f64 = 0.9;

fn is_more(above: Difference, errors: f64) -> bool {
    above.mean > LEAST_SCORE && above.significance() > errors
}

/// The glass shows its surroundings where the candidate says. `is_above`: the prediction surely scores more than looking straight through.
fn is_seen(evidence: &Evidence, is_above: bool) -> bool {
    let Evidence { predicted, other_photographs: others, .. } = evidence;
    is_above && predicted.mean > others.mean + SURELY * others.error
}

/// Whether rays bend, if the evidence knows. `lacks`: by how much the prediction scores less than straight rays that have learned what is
/// inside the masks.
fn bends(evidence: &Evidence, is_seen: bool, lacks: f64) -> Option<bool> {
    let Evidence { predicted, trained_straight, above, .. } = evidence;
    // Straight rays that show nearly everything leave nothing to explain. Otherwise what stands in a body, which is seen through it alone,
    // may be what they have learned, and what prediction lacks. Where they gain much more over the prediction than it gains over looking
    // straight through, its shape is too far from the truth.
    let least = EXPLAINED * (1.0 - predicted.mean);
    let is_explained = if is_seen {
        lacks > least.min(above.mean / EXPLAINED)
    } else {
        lacks > least && trained_straight.mean > SEEN_STRAIGHT
    };
    // What is seen in a cavity, which nobody knows before it is learned, straight rays may explain, and a prediction cannot.
    (is_seen != is_explained).then_some(is_seen)
}

/// What prediction says of a region.
#[derive(Default)]
pub(super) struct Opinion {
    /// Whether rays bend there, if it knows.
    pub(super) bends: Option<bool>,
    /// It surely shows more than looking straight through, and than other views would.
    pub(super) is_seen: bool,
    /// It shows more than looking straight through, if not surely.
    pub(super) is_glimpsed: bool,
    pub(super) evidence: Option<Evidence>,
}

/// What is known of a region but for straight rays that have learned its inside.
pub(super) struct Judged {
    predicted: Predicted,
    scores: Scores,
    through: Scores,
    others: Difference,
    /// Whether it scores more than looking straight through, as far as views say that were kept aside, and those that straight rays
    /// learned from where they are faint.
    is_above: bool,
    index: Option<[f32; 2]>,
    pub(super) shown: Option<Shown>,
}

impl Look<'_> {
    /// The evidence on views kept aside.
    pub(super) fn judged(&mut self, at: &Standing, region: usize, observer: &mut Observer) -> Option<Judged> {
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
        let straight = |photographs, medium: &Refraction| {
            predict(at.backend, &at.marching, photographs, JUDGED, medium, Way::Straight)
        };
        let (aside, learned) = (&self.seen.aside, &self.seen.learned);
        let medium = at.medium(candidate.bodies(place, self.options));
        let predicted = predict(at.backend, &at.marching, aside, JUDGED, &medium, Way::Bent);
        let (scores, through) = (predicted.scores(aside), straight(aside, &medium).scores(aside));
        // Few views kept aside leave faint evidence open. All others decide then, by numbers alone: a surface that was refined fits them
        // by chance, and looking straight through gains by what straight rays fitted to them.
        let above = scores.above(&through);
        let in_learned = || {
            let plain = at.medium(self.unrefined.as_ref().unwrap_or(candidate).bodies(place, self.options));
            let bent = predict(at.backend, &at.marching, learned, JUDGED, &plain, Way::Bent).scores(learned);
            bent.above(&straight(learned, &plain).scores(learned))
        };
        let is_above =
            is_more(above, SIGNIFICANT) || is_more(above, GLIMPSED) && is_more(in_learned(), SIGNIFICANT);
        let shown = scores.middle().and_then(|(view, score)| {
            let scores = [through.of_view(view), score];
            Shown::new(at.backend, &at.marching, (aside, view), (&medium, scores), region)
        });
        let others = predicted.scores_of_others(aside).mean();
        observer.tell(Event::IndexSearched {
            region,
            hypothesis: candidate.proposal.kind,
            found: candidate.found(self.region),
            likeness: scores.mean().mean,
        });
        Some(Judged { predicted, scores, through, others, is_above, index, shown })
    }

    /// Whether rays bend here.
    pub(super) fn opinion(&self, judged: &Judged, trained: &Predicted) -> Opinion {
        let Judged { predicted, scores, through, others, is_above, index, .. } = judged;
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
        let is_seen = is_seen(&evidence, *is_above);
        let bends = bends(&evidence, is_seen, lacks.mean)
            .filter(|bends| *bends || self.options.judge.straight.is_on());
        let is_glimpsed = is_more(above, GLIMPSED);
        Opinion { bends, is_seen, is_glimpsed, evidence: Some(evidence) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evidence([predicted, through, straight]: [f64; 3]) -> Evidence {
        let of = |mean| Difference { mean, error: 0.02, views: 9 };
        Evidence {
            predicted: of(predicted),
            straight_through: of(through),
            other_photographs: of(0.0),
            trained_straight: of(straight),
            above: of(predicted - through),
            index: None,
        }
    }

    fn verdict(scores: [f64; 3]) -> Option<bool> {
        let evidence = evidence(scores);
        let is_seen = is_seen(&evidence, is_more(evidence.above, SIGNIFICANT));
        bends(&evidence, is_seen, scores[2] - scores[0])
    }

    #[test]
    fn evidence_decides_where_neither_prediction_nor_straight_rays_lack_much() {
        assert_eq!(verdict([0.65, 0.03, 0.15]), Some(true), "glass shows its surroundings where it should");
        assert_eq!(verdict([0.45, 0.02, 0.33]), Some(true));
        assert_eq!(verdict([0.08, 0.05, 0.95]), Some(false), "an opaque thing");
        assert_eq!(verdict([0.08, 0.05, 0.5]), None, "neither shows it");
        assert_eq!(verdict([0.4, 0.1, 0.85]), None, "what stands in a vessel is seen through it alone");
        assert_eq!(verdict([0.31, 0.15, 0.46]), Some(true), "an empty glass, too");
        assert_eq!(verdict([0.11, 0.01, 0.45]), None, "the shape is too far from the truth");
    }
}
