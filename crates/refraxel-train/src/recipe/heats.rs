//! What races: per region, what the search supports.

use super::Known;
use super::hypotheses::{Candidate, Unknown, WALL, proposals};
use super::region::Region;
use super::search::{Fit, Fits};
use crate::events::{Event, Watch};
use crate::options::Options;
use crate::verdict::Hypothesis;

/// Rivals at most.
const MOST_HEATS: usize = 3;
/// The best index must lower the error of straight rays to this part. Where it does not, what is seen through the body is
/// not known yet, and the search says nothing.
const DECISIVE: f64 = 0.97;
/// What races must lower it to this part, but for water seen from above, of which the search can say nothing: what is seen
/// through that is seen nowhere else.
const SUPPORTED: f64 = 0.99;
/// An index that bends nothing.
const STRAIGHT_INDEX: f32 = 1.03;

/// What races, and what is assumed where nothing can race.
pub(super) struct Heats {
    /// Per heat one candidate per region: the best of the search first.
    pub rivals: Vec<Vec<Candidate>>,
    /// Per region: the best of the search, or a guess where the search says nothing.
    pub assumed: Vec<Candidate>,
    /// Per region: the misfit of straight rays.
    pub straight: Vec<f64>,
}

/// What the search supports in each region: the best first, side by side with those of the other regions.
pub(super) fn heats(fits: &[Fits], regions: &[Region], known: &Known, watch: &mut Watch) -> Heats {
    let options = known.options;
    let (mut all, mut assumed) = (Vec::with_capacity(fits.len()), Vec::with_capacity(fits.len()));
    for (k, (found, region)) in fits.iter().zip(regions).enumerate() {
        let Some(first) = found.fits.first() else { continue };
        let says_nothing = first.candidate.searched && first.error > DECISIVE * found.straight;
        let guess = || Candidate::guess(proposals(region, options)[0], region, options);
        let best = if says_nothing { guess() } else { first.candidate.clone() };
        let mut rivals = rivals(found, region, options);
        // A guess races where the search supports nothing.
        if rivals.is_empty() {
            if !best.searched {
                watch.tell(guessed(k, found.straight, options));
            }
            rivals.push(best.clone());
        }
        all.push(rivals);
        assumed.push(best);
    }
    let count = all.iter().map(Vec::len).max().unwrap_or(0);
    let heat = |h: usize| all.iter().map(|r| r[h.min(r.len() - 1)].clone()).collect();
    let straight = fits.iter().map(|f| f.straight).collect();
    Heats { rivals: (0..count).map(heat).collect(), assumed, straight }
}

pub(super) fn guessed(region: usize, straight_misfit: f64, options: &Options) -> Event {
    Event::IndexGuessed { region, straight_misfit, index: options.search.guess }
}

/// What the search supports in a region, the best first.
fn rivals(found: &Fits, region: &Region, options: &Options) -> Vec<Candidate> {
    let Some(best) = found.fits.first() else { return Vec::new() };
    // What explains less than the simplest body does not race; with more unknowns it must explain more.
    let simplest = proposals(region, options)[0];
    let most = (simplest.unknowns)(region).len();
    let of_simplest = found.fits.iter().find(|f| *f.candidate.proposal == *simplest).map(|f| f.misfit);
    let is_worth_it = |f: &Fit| {
        let misfit = if f.candidate.values.len() > most { f.error } else { f.misfit };
        is_seen(&f.candidate) || of_simplest.is_none_or(|simplest| misfit <= simplest)
    };
    let is_supported = |f: &Fit| {
        let is_near = f.error <= options.judge.rivals * best.error;
        is_near && f.misfit < SUPPORTED * found.straight && is_worth_it(f)
    };
    let is_rival = |f: &&Fit| (f.candidate.relearns() || is_supported(f)) && bends(&f.candidate, region);
    let all: Vec<&Candidate> = found.fits.iter().filter(is_rival).map(|f| &f.candidate).collect();
    // The best numbers of each hypothesis before further numbers of one.
    let is_first = |k: &usize| !all[..*k].iter().any(|c| c.proposal.kind == all[*k].proposal.kind);
    let (firsts, further): (Vec<usize>, Vec<usize>) = (0..all.len()).partition(is_first);
    let mut rivals: Vec<Candidate> = firsts.into_iter().chain(further).map(|k| all[k].clone()).collect();
    // What silhouettes show to have flat faces may have them: rounded shapes fit many pixels by chance.
    if let Some(late) = rivals.iter().skip(MOST_HEATS).position(is_seen) {
        rivals.swap(MOST_HEATS - 1, MOST_HEATS + late);
    }
    rivals.truncate(MOST_HEATS);
    rivals
}

/// Whether silhouettes themselves show that the hypothesis may hold.
fn is_seen(candidate: &Candidate) -> bool {
    [Hypothesis::Polyhedron, Hypothesis::WaterSurface].contains(&candidate.proposal.kind)
}

/// Whether rays bend at all: otherwise it is straight rays again. A wall at the least thickness that is searched hardly bends
/// any, and wins the first round of a race by that, over all that has to be learned anew.
fn bends(candidate: &Candidate, region: &Region) -> bool {
    let unknowns = (candidate.proposal.unknowns)(region);
    let thinnest = |(u, v): (&Unknown, &f32)| u.name == WALL && *v <= u.range[0];
    let is_bare = unknowns.iter().zip(&candidate.values).any(thinnest);
    !candidate.searched || (candidate.values.first().is_none_or(|n| *n > STRAIGHT_INDEX) && !is_bare)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::initial::Site;
    use refraxel_core::{Aabb, Vec3};

    fn region() -> Region {
        let bounds = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let interpolation = Options::default().index.interpolation.into();
        let site = Site { bounds, resolution: [17; 3], interpolation };
        Region::body(site, |x| x.length() - 0.6, &Options::default())
    }

    /// A searched candidate of a hypothesis, of this misfit and this error beside others.
    fn fit(kind: Hypothesis, misfit: f64, error: f64) -> Fit {
        let region = region();
        let options = Options::default();
        let all = proposals(&region, &options);
        let proposal = all.into_iter().find(|p| p.kind == kind).unwrap();
        let guess = Candidate::guess(proposal, &region, &options);
        Fit { misfit, error, candidate: Candidate { searched: true, ..guess } }
    }

    fn racing(straight: f64, fits: Vec<Fit>) -> Vec<Hypothesis> {
        let rivals = rivals(&Fits { straight, fits }, &region(), &Options::default());
        rivals.iter().map(|c| c.proposal.kind).collect()
    }

    #[test]
    fn what_explains_less_than_a_solid_body_does_not_race() {
        use Hypothesis::{Graded, Shell, Solid};
        let more = |misfit| {
            let mut fit = fit(Shell, misfit, 1.015 * misfit);
            fit.candidate.values.push(0.0);
            fit
        };
        let simplest = || fit(Solid, 0.50, 0.50);
        assert_eq!(racing(0.8, vec![simplest(), more(0.50)]), [Solid], "more unknowns");
        assert_eq!(
            racing(0.8, vec![simplest(), fit(Shell, 0.50, 0.50), fit(Graded, 0.501, 0.501)]),
            [Solid, Shell]
        );
        assert_eq!(
            racing(0.8, vec![more(0.48), fit(Graded, 0.499, 0.499), simplest()]),
            [Shell, Graded, Solid]
        );
    }

    #[test]
    fn further_numbers_of_a_hypothesis_race_behind_the_others() {
        use Hypothesis::{Graded, Shell, Solid};
        let [best, second] = [0.48, 0.481].map(|misfit| fit(Shell, misfit, misfit));
        let solid = || fit(Solid, 0.49, 0.49);
        assert_eq!(racing(0.8, vec![best.clone(), second.clone(), solid()]), [Shell, Solid, Shell]);
        assert_eq!(
            racing(0.8, vec![best, second, fit(Graded, 0.485, 0.485), solid()]),
            [Shell, Graded, Solid]
        );
    }

    #[test]
    fn what_explains_no_more_than_straight_rays_does_not_race() {
        assert!(racing(0.5, vec![fit(Hypothesis::Solid, 0.499, 0.499)]).is_empty());
        assert_eq!(racing(0.5, vec![fit(Hypothesis::Solid, 0.45, 0.45)]), [Hypothesis::Solid]);
    }

    #[test]
    fn an_index_or_a_wall_that_bends_nothing_does_not_race() {
        let mut air = fit(Hypothesis::Solid, 0.3, 0.3);
        air.candidate.values[0] = 1.02;
        assert!(racing(0.5, vec![air.clone()]).is_empty());
        air.candidate.searched = false;
        assert_eq!(racing(0.5, vec![air]), [Hypothesis::Solid], "nobody searched for what is known");
        let mut bare = fit(Hypothesis::Shell, 0.3, 0.3);
        let wall = (bare.candidate.proposal.unknowns)(&region()).iter().position(|u| u.name == WALL).unwrap();
        bare.candidate.values[wall] = 0.0;
        assert!(racing(0.5, vec![bare]).is_empty());
    }
}
