//! Where the error of a hypothesis has several valleys: from which first values its search goes on, and which of the ends are apart.

use super::{AROUND, Fit};
use crate::recipe::hypotheses::{Proposal, Unknown};

/// Starts of a usual hypothesis at most.
const MOST: usize = 2;
/// A second valley must explain this part of what the deepest explains: the few rays of first values tell no more.
const DEPTH: f64 = 0.75;

/// The unknown of whose first values each is a start of its own: of a dear proposal, whose error has several valleys, the second.
pub(super) fn apart_in(proposal: &Proposal, unknowns: &[Unknown]) -> Option<usize> {
    (proposal.is_dear && unknowns.len() > 1).then_some(1)
}

/// How many starts a proposal has at most.
pub(super) fn most(proposal: &Proposal, unknowns: &[Unknown]) -> usize {
    apart_in(proposal, unknowns).map_or(MOST, |k| unknowns[k].first.len())
}

/// Of all first values of a proposal, the best first, those from which the search goes on: of a dear one the best with each value of
/// the second unknown, else the bottoms of the deepest valleys along the first. `straight` is the error of straight rays.
pub(super) fn starts(fits: Vec<Fit>, proposal: &Proposal, unknowns: &[Unknown], straight: f64) -> Vec<Fit> {
    let Some(best) = fits.first().map(|f| f.error) else { return fits };
    let along = apart_in(proposal, unknowns);
    let value = |f: &Fit| f.candidate.values[along.unwrap_or(0)];
    let mut lowest: Vec<Fit> = Vec::new();
    for fit in fits {
        if lowest.iter().all(|met| value(met) != value(&fit)) {
            lowest.push(fit);
        }
    }
    if along.is_some() {
        return lowest;
    }
    let mut profile: Vec<(f32, f64)> = lowest.iter().map(|f| (value(f), f.error)).collect();
    profile.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_bottom = |f: &Fit| {
        let at = profile.partition_point(|(v, _)| *v < value(f));
        let beside = [at.checked_sub(1), Some(at + 1)].into_iter().flatten().filter_map(|k| profile.get(k));
        beside.into_iter().all(|(_, error)| f.error <= *error)
    };
    let is_deep = |f: &Fit| f.error <= best || straight - f.error >= DEPTH * (straight - best);
    lowest.retain(|f| is_bottom(f) && is_deep(f));
    lowest.truncate(MOST);
    lowest
}

/// Those of one proposal in different valleys of the error: others differ in some unknown by more than a round of the last pass can.
pub(super) fn apart(mut fits: Vec<Fit>, unknowns: &[Unknown]) -> Vec<Fit> {
    let reach = |u: &Unknown| AROUND[AROUND.len() - 1] * u.fine.last().copied().unwrap_or(0.0);
    let are_apart = |a: &Fit, b: &Fit| {
        let values = a.candidate.values.iter().zip(&b.candidate.values);
        unknowns.iter().zip(values).any(|(u, (a, b))| (a - b).abs() > reach(u))
    };
    fits.sort_by(|a, b| a.error.total_cmp(&b.error));
    let mut kept: Vec<Fit> = Vec::new();
    for fit in fits {
        if kept.iter().all(|k| are_apart(k, &fit)) {
            kept.push(fit);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::initial::Site;
    use crate::options::Options;
    use crate::recipe::hypotheses::{Candidate, proposals};
    use crate::recipe::region::Region;
    use crate::verdict::Hypothesis;
    use refraxel_core::{Aabb, Vec3};

    /// A hypothesis, its unknowns, and how its fits are made.
    fn of(kind: Hypothesis) -> (&'static Proposal, Vec<Unknown>, impl Fn(&[f32], f64) -> Fit) {
        let bounds = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let options = Options::default();
        let site = Site { bounds, resolution: [17; 3], interpolation: options.index.interpolation.into() };
        let region = Region::body(site, |x| x.length() - 0.6, &options);
        let proposal = proposals(&region, &options).into_iter().find(|p| p.kind == kind).unwrap();
        let fit = move |values: &[f32], error| {
            let candidate = Candidate {
                proposal,
                values: values.to_vec(),
                searched: true,
                tint: [0.0; 3],
                refined: None,
            };
            Fit { misfit: error, error, candidate }
        };
        (proposal, (proposal.unknowns)(&region), fit)
    }

    fn values(fits: &[Fit], which: usize) -> Vec<f32> {
        fits.iter().map(|f| f.candidate.values[which]).collect()
    }

    #[test]
    fn ends_in_one_valley_are_one() {
        let (_, unknowns, fit) = of(Hypothesis::Shell);
        let near = unknowns[1].fine.last().unwrap();
        let at = |wall, error| fit(&[1.5, wall], error);
        let kept = apart(vec![at(0.3, 0.52), at(0.3 + near, 0.51), at(0.3 + 20.0 * near, 0.53)], &unknowns);
        assert_eq!(values(&kept, 1), [0.3 + near, 0.3 + 20.0 * near]);
    }

    #[test]
    fn a_usual_hypothesis_starts_in_its_two_deepest_valleys() {
        let (proposal, unknowns, fit) = of(Hypothesis::Solid);
        let from = |errors: &[(f32, f64)]| {
            let mut fits: Vec<Fit> = errors.iter().map(|(index, e)| fit(&[*index, 0.0], *e)).collect();
            // Off the hull all is worse.
            fits.extend(errors.iter().map(|(index, e)| fit(&[*index, 2.8], e + 0.05)));
            fits.sort_by(|a, b| a.error.total_cmp(&b.error));
            values(&starts(fits, proposal, &unknowns, 0.80), 0)
        };
        assert_eq!(from(&[(1.3, 0.71), (1.4, 0.73), (1.5, 0.70), (1.6, 0.72)]), [1.5, 1.3]);
        assert_eq!(from(&[(1.3, 0.76), (1.4, 0.77), (1.5, 0.70), (1.6, 0.72)]), [1.5], "shallow");
        assert_eq!(from(&[(1.3, 0.72), (1.4, 0.71), (1.5, 0.70), (1.6, 0.71)]), [1.5], "a slope");
        let three = [(1.1, 0.72), (1.2, 0.74), (1.3, 0.71), (1.4, 0.73), (1.5, 0.70)];
        assert_eq!(from(&three), [1.5, 1.3]);
    }

    #[test]
    fn a_dear_hypothesis_starts_with_each_value_of_its_second_unknown() {
        let (_, unknowns, fit) = of(Hypothesis::Shell);
        let dear = Proposal { is_dear: true, ..*fit(&[], 0.0).candidate.proposal };
        let fits = vec![fit(&[1.5, 0.2], 0.5), fit(&[1.4, 0.2], 0.6), fit(&[1.4, 0.3], 0.7)];
        let found = starts(fits, &dear, &unknowns, 0.8);
        assert_eq!((values(&found, 0), values(&found, 1)), (vec![1.5, 1.4], vec![0.2, 0.3]));
    }
}
